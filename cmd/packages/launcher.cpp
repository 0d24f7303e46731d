// SPDX-License-Identifier: Apache-2.0
// The launcher of the archive's programs. It starts libexec/NAME, where NAME is its own name, with
// the newer of two C libraries: the machine's and the archive's. GL drivers of the machine are
// loaded into the same process, so each library that they share with us must be the newer one, too.
// The launcher is linked statically, because it must run before a C library is chosen.
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <climits>
#include <compare>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace {

#if defined(__x86_64__)
#define PEELER_ARCHITECTURE "x86_64-linux-gnu"
constexpr char kLoader[] = "/lib64/ld-linux-x86-64.so.2";
constexpr std::uint32_t kCacheFlags = 0x0303;  // FLAG_X8664_LIB64 | FLAG_ELF_LIBC6
#elif defined(__aarch64__)
#define PEELER_ARCHITECTURE "aarch64-linux-gnu"
constexpr char kLoader[] = "/lib/ld-linux-aarch64.so.1";
constexpr std::uint32_t kCacheFlags = 0x0a03;  // FLAG_AARCH64_LIB64 | FLAG_ELF_LIBC6
#else
#error "add this architecture's dynamic linker, and its flags in glibc's dl-cache.h"
#endif

using Path = std::string;
using Version = std::array<unsigned, 3>;

/// The contents of a file; empty if it cannot be read.
class MappedFile {
  public:
    explicit MappedFile(const Path& path) {
        const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
        if (file < 0) return;
        struct stat status {};
        if (fstat(file, &status) == 0 && S_ISREG(status.st_mode) && status.st_size > 0) {
            const auto size = static_cast<std::size_t>(status.st_size);
            void* const bytes = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0);
            if (bytes != MAP_FAILED) text_ = {static_cast<const char*>(bytes), size};
        }
        close(file);
    }
    MappedFile(const MappedFile&) = delete;
    MappedFile& operator=(const MappedFile&) = delete;
    ~MappedFile() {
        if (!text_.empty()) munmap(const_cast<char*>(text_.data()), text_.size());
    }
    std::string_view text() const { return text_; }

  private:
    std::string_view text_;
};

Path realPath(const Path& path) {
    std::array<char, PATH_MAX> real{};
    return realpath(path.c_str(), real.data()) ? Path(real.data()) : Path();
}

bool isThere(const Path& path) {
    return access(path.c_str(), R_OK) == 0;
}

Path folderOf(const Path& path) {
    return path.substr(0, path.rfind('/'));
}

/// Returns the highest symbol version that a library defines, such as 2.36 for "GLIBC_"; 0 if it
/// defines none.
Version symbolVersion(const Path& library, std::string_view prefix) {
    const MappedFile file(library);
    Version highest{};
    for (std::size_t at = 0; (at = file.text().find(prefix, at)) != std::string_view::npos;) {
        at += prefix.size();
        Version version{};
        // Version names end with a null character within the file.
        std::sscanf(file.text().data() + at, "%u.%u.%u", version.data(), &version[1], &version[2]);
        if (version > highest) highest = version;
    }
    return highest;
}

/// Libraries that the dynamic linker's cache lists (glibc, sysdeps/generic/dl-cache.h).
class LinkerCache {
  public:
    LinkerCache() {
        // Some files begin with a table in the format of before 1999.
        const std::size_t at = file_.text().find("glibc-ld.so.cache1.1");
        if (at != std::string_view::npos) table_ = file_.text().substr(at);
    }
    /// Returns a library's path, or nothing.
    Path find(std::string_view name) const {
        const std::uint32_t count = number(kHeader - 28);
        if (table_.size() < kHeader + std::size_t{count} * kEntry) return {};
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t entry = kHeader + i * kEntry;
            if (number(entry) == kCacheFlags && text(number(entry + 4)) == name)
                if (Path path(text(number(entry + 8))); isThere(path)) return path;
        }
        return {};
    }

  private:
    static constexpr std::size_t kHeader = 48, kEntry = 24;
    std::uint32_t number(std::size_t at) const {
        std::uint32_t value = 0;
        if (at + sizeof value <= table_.size()) std::memcpy(&value, &table_[at], sizeof value);
        return value;
    }
    std::string_view text(std::size_t at) const {
        if (at >= table_.size()) return {};
        return table_.substr(at, table_.find('\0', at) - at);
    }

    MappedFile file_{"/etc/ld.so.cache"};
    std::string_view table_;
};

/// Returns a library of the machine, where its dynamic linker would find it; or nothing.
Path machineLibrary(const LinkerCache& cache, const char* name) {
    if (Path found = cache.find(name); !found.empty()) return found;
    for (const Path& folder :
         {folderOf(realPath(kLoader)), Path("/lib/" PEELER_ARCHITECTURE),
          Path("/usr/lib/" PEELER_ARCHITECTURE), Path("/lib64"), Path("/usr/lib64")})
        if (isThere(folder + '/' + name)) return folder + '/' + name;
    return {};
}

/// A library in lib/shared/NAME that GL drivers use, too.
struct SharedLibrary {
    const char* name;
    const char* symbols;  ///< prefix of its symbol versions; empty: it is as new as the C library
};
constexpr SharedLibrary kShared[] = {
    {"libstdc++.so.6", "GLIBCXX_"}, {"libgcc_s.so.1", "GCC_"}, {"libgomp.so.1", "GOMP_"},
    {"libz.so.1", "ZLIB_"},         {"liblzma.so.5", "XZ_"},   {"libzstd.so.1", ""},
    {"libbz2.so.1.0", ""},          {"libexpat.so.1", ""},
};

[[noreturn]] void fail(const std::string& text) {
    std::fprintf(stderr, "peeler: error: %s\n", text.c_str());
    std::exit(70);
}

/// Returns the archive's folder: the nearest one around the launcher that has libexec.
Path archiveOf(const Path& launcher) {
    for (Path folder = folderOf(launcher); !folder.empty(); folder = folderOf(folder))
        if (isThere(folder + "/libexec")) return folder;
    fail("there is no folder libexec around " + launcher +
         "\npeeler: hint: unpack the archive again, and keep its files together");
}

/// Returns the folders with libraries, separated by colons.
Path searchPath(const Path& archive, const LinkerCache& cache, bool uses_own_c_library) {
    Path path = uses_own_c_library ? archive + "/lib/glibc:" : Path();
    for (const SharedLibrary& library : kShared) {
        const Path folder = archive + "/lib/shared/" + library.name;
        const Path other = machineLibrary(cache, library.name);
        bool newer = uses_own_c_library;
        if (*library.symbols != '\0')
            newer = symbolVersion(folder + '/' + library.name, library.symbols) >
                    symbolVersion(other, library.symbols);
        if (other.empty() || newer) path += folder + ':';
    }
    path += archive + "/lib";
    // --library-path replaces this variable.
    if (const char* const set = std::getenv("LD_LIBRARY_PATH"); set && *set != '\0')
        path += std::string(":") + set;
    // Debian's dynamic linker does not search these folders by itself.
    return path + ":/usr/lib64:/lib64";
}

}  // namespace

int main(int, char** arguments) {
    const Path launcher = realPath("/proc/self/exe");
    if (launcher.empty()) fail("cannot find its own file\npeeler: hint: mount /proc");
    const Path archive = archiveOf(launcher), own = archive + "/lib/glibc";
    const LinkerCache cache;
    const bool uses_own =
        !isThere(kLoader) || symbolVersion(own + "/libc.so.6", "GLIBC_") >
                                 symbolVersion(machineLibrary(cache, "libc.so.6"), "GLIBC_");

    Path loader = uses_own ? own + std::strrchr(kLoader, '/') : kLoader;
    Path option = "--library-path", path = searchPath(archive, cache, uses_own);
    Path program = archive + "/libexec" + launcher.substr(launcher.rfind('/'));
    std::vector<char*> line = {loader.data(), option.data(), path.data(), program.data()};
    while (*arguments && *++arguments)
        line.push_back(*arguments);
    line.push_back(nullptr);
    execv(loader.c_str(), line.data());
    fail("cannot start " + loader + ": " + std::strerror(errno));
}
