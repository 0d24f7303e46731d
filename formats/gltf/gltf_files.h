// SPDX-License-Identifier: Apache-2.0
// The files that a glTF, or another scene, may name: inside its own folder, regular files, capped.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace peeler {

/// Whether this is a `data:` URI.
bool isDataUri(std::string_view uri);

/// The bytes of a `data:` URI (RFC 2397), base64 or percent-encoded, of any media type. Throws
/// Error(kInput) with `where` if it is malformed.
std::vector<std::uint8_t> decodeDataUri(std::string_view uri, const std::string& where);

/// What the URIs of a glTF, and the names in other scenes, may reach. A scene from a stranger must
/// not read the user's other files, so: relative references only, no "..", and nothing that
/// symbolic links lead out of the folder. The user may allow all of that; it has to be a regular
/// file under the size cap in any case.
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
    std::vector<std::uint8_t> read(const std::string& uri, const std::string& where) const;

    /// The same of a name that is no URI, as it stands.
    std::optional<std::filesystem::path> findFile(const std::string& file_name) const;
    std::vector<std::uint8_t> readFile(const std::string& name, const std::string& where) const;

  private:
    std::vector<std::uint8_t> read(const std::string& name, const std::string& shown,
                                   const std::string& where) const;

    std::filesystem::path folder_;
    std::uint64_t max_file_bytes_;
    bool allow_outside_;
};

}  // namespace peeler
