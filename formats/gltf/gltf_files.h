// SPDX-License-Identifier: Apache-2.0
// The files that a glTF, or another scene, may name: inside its own folder, regular files, capped.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/file/read_warnings.h"

namespace peeler {

/// Whether this is a `data:` URI.
bool isDataUri(std::string_view uri);

/// White space that is passed over in base64, as browsers do: MIME breaks its lines.
inline constexpr const char* kBase64Space = " \t\r\n";

/// The bytes of a `data:` URI (RFC 2397), base64 or percent-encoded, of any media type. Throws
/// Error(kInput) with `where` if it is malformed.
std::vector<std::uint8_t> decodeDataUri(std::string_view uri, const std::string& where);

/// What the URIs of a glTF, and the names in other scenes, may reach. A scene from a stranger must
/// not read the user's other files, so: nothing absolute, no ".." that leads out of the folder, and
/// nothing that symbolic links lead out of it. The user may allow all of that; it has to be a
/// regular file under the size cap in any case.
///
/// Scenes travel without what their names say. Where a name does not lead to a file that may be
/// read, the file in the folder is taken that has the end of its path, the longest that there is:
/// "textures/a.png" or "a.png" for "C:\Users\me\textures\A.PNG". Letters may differ in case
/// where no other file differs so. The caller is warned. Belongs to one thread.
class GltfFolder {
  public:
    /// The folder of this scene file.
    GltfFolder(const std::filesystem::path& scene_file, std::uint64_t max_file_bytes,
               bool allow_outside = false);

    /// Where the file is that a URI names, percent-decoded (RFC 3986), there or not; none for a
    /// data: URI, and for a path that leads out of the folder without leave.
    std::optional<std::filesystem::path> find(const std::string& uri) const;

    /// The bytes of the file that a URI names. Throws Error(kInput), `where` being the JSON pointer
    /// handed in.
    std::vector<std::uint8_t> read(const std::string& uri, const std::string& where,
                                   ReadWarnings& warnings) const;

    /// The same of a name that is no URI, as programs write it: in quotes or not, with slashes or
    /// backslashes. It leads from `from`, a folder in this one ("" = this one).
    std::optional<std::filesystem::path> findFile(const std::string& name,
                                                  const std::string& from = {}) const;
    /// The name that the file has from the folder on.
    std::string nameOf(const std::string& name) const;
    std::vector<std::uint8_t> readFile(const std::string& name, const std::string& from,
                                       const std::string& where, ReadWarnings& warnings) const;

  private:
    struct Named;
    struct Found;
    using Listing = std::multimap<std::string, std::string>;
    Found look(const Named& named) const;
    std::filesystem::path allowed(const std::filesystem::path& name) const;
    const Listing& listing(const std::filesystem::path& folder) const;
    std::optional<std::filesystem::path> present(const std::filesystem::path& name) const;
    std::optional<std::filesystem::path> withSameEnd(const Named& named) const;
    std::vector<std::uint8_t> read(const Named& named, const std::string& where,
                                   ReadWarnings& warnings) const;

    std::filesystem::path folder_;
    std::uint64_t max_file_bytes_;
    bool allow_outside_;
    mutable std::map<std::filesystem::path, Listing> listings_;
};

}  // namespace peeler
