// SPDX-License-Identifier: Apache-2.0
// Sandboxed access to the files to which a glTF or other scene refers: regular files of limited
// size in the scene's folder.
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

bool isDataUri(std::string_view uri);

/// White space that base64 may contain: MIME breaks base64 into lines. Browsers also skip white
/// space.
inline constexpr const char* kBase64Space = " \t\r\n";

/// Returns the bytes of a `data:` URI (RFC 2397), base64 or percent-encoded, of any media type.
/// Throws Error (kInput) with `where` if the URI is malformed.
std::vector<std::uint8_t> decodeDataUri(std::string_view uri, const std::string& where);

/// The sandbox for the URIs in a glTF file and the file names in other scenes. An untrusted scene
/// must not read the user's other files. So absolute paths, "..", and symbolic links that lead out
/// of the folder are rejected unless the user allows them. Files must always be regular and within
/// the size limit.
///
/// Scenes often arrive without their original folder structure. If a name does not lead to a
/// readable file, the name's first folders are removed one by one until the rest leads to a file in
/// the folder. For "C:\Users\me\textures\A.PNG", the last two attempts are "textures/A.PNG" and
/// "A.PNG". Case is ignored if only one file then matches. A warning names the file that is used
/// instead. Not thread-safe.
class GltfFolder {
  public:
    /// Opens the sandbox for the folder of this scene file.
    GltfFolder(const std::filesystem::path& scene_file, std::uint64_t max_file_bytes,
               bool allow_outside = false);

    /// Returns the path of a URI, percent-decoded (RFC 3986). The file need not exist. Returns no
    /// value for a data: URI, or if the path leads out of the folder without permission.
    std::optional<std::filesystem::path> find(const std::string& uri) const;

    /// Returns the bytes of a URI's file. Throws Error (kInput) with `where`, the JSON pointer of
    /// the URI.
    std::vector<std::uint8_t> read(const std::string& uri, const std::string& where,
                                   ReadWarnings& warnings) const;

    /// Returns the path as find() does, but for a plain file name: with or without quotation marks,
    /// with slashes or backslashes. The name is relative to `from`, a subfolder; "" means the
    /// folder itself.
    std::optional<std::filesystem::path> findFile(const std::string& name,
                                                  const std::string& from = {}) const;
    /// Returns the name, relative to the folder, of the file that readFile() reads for `name`.
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
