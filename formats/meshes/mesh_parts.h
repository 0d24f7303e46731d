// SPDX-License-Identifier: Apache-2.0
// Building blocks of the readers of PLY, STL, OBJ and arrays: the file, vertex deduplication,
// polygons, normals, materials and textures. A faulty file raises Error (kInput) with its position
// as `where`.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/error.h>
#include <peeler/scene.h>
#include "formats/file/read_warnings.h"
#include "formats/file/reading_limits.h"
#include "formats/gltf/gltf_files.h"
#include "formats/meshes/scene_reader.h"

namespace peeler {

// ply_scene.cpp, stl_scene.cpp, obj_scene.cpp, array_scene.cpp: the functions in the format table.

Scene readPlyScene(const std::filesystem::path& path, const SceneReadOptions& options);
Scene readStlScene(const std::filesystem::path& path, const SceneReadOptions& options);
bool isStl(std::string_view begin, std::uint64_t size);
Scene readObjScene(const std::filesystem::path& path, const SceneReadOptions& options);
bool isObj(std::string_view begin, std::uint64_t size);
Scene readArrayScene(const std::filesystem::path& path, const SceneReadOptions& options);
bool isArrayScene(std::string_view begin, std::uint64_t size);

/// Returns the text without a UTF-8 byte order mark.
std::string_view withoutByteOrderMark(std::string_view text);

// mesh_file.cpp.

/// A mesh file being read, and its scene.
class MeshFile {
  public:
    /// Reads the whole file.
    MeshFile(const std::filesystem::path& path, const SceneReadOptions& options);
    MeshFile(const MeshFile&) = delete;
    MeshFile& operator=(const MeshFile&) = delete;

    std::span<const std::uint8_t> bytes() const { return bytes_; }
    std::string_view text() const;
    const std::string& name() const { return name_; }  ///< the path
    std::string stem() const;                          ///< for unnamed objects
    const SceneReadOptions& options() const { return options_; }
    Scene& scene() { return scene_; }

    /// Checks the memory budget; call it before an allocation whose size the file controls. Throws
    /// Error (kMemory) if the budget is exceeded.
    void allow(std::uint64_t bytes) { memory_.allow(bytes, name_); }
    /// Checks the memory budget and max_geometry_bytes, for the scene's vertices and indices.
    void allowGeometry(std::uint64_t bytes);

    /// Return a position in the file as text: "part.obj:12", "part.stl, byte 84".
    std::string atLine(std::size_t place) const;
    std::string atByte(std::size_t place) const;
    void warn(const Text& sentence, const Text& where = {}) { warnings_.warn(sentence, where); }

    /// Reads another file of the folder and adds its bytes to the scene's hash. `where` is the line
    /// that names it; `from` is the folder of the file with that line.
    std::vector<std::uint8_t> readBeside(const std::string& file, const std::string& from,
                                         const std::string& where);
    /// Returns the folder of a referenced file, relative to the scene's.
    std::string folderOf(const std::string& file) const;
    /// Warns of an unavailable texture or material file.
    void missing(const std::string& what, const Error& problem, const std::string& where);

    /// Adds a node, with the mesh if it draws anything. Returns its index.
    int addNode(const std::string& node_name, Mesh mesh);
    /// Returns the plain grey material, created on first use.
    int neutralMaterial();
    /// Returns the white material for meshes with their own colours, created on first use.
    int colorMaterial();
    /// Finishes the scene (normals, default material, roots) and returns it.
    Scene finish();

  private:
    const SceneReadOptions& options_;
    std::string name_;
    ReadingMemory memory_;
    SizeLimit geometry_;
    std::vector<std::uint8_t> bytes_;
    GltfFolder folder_;
    ReadWarnings warnings_;
    Scene scene_;
    int neutral_ = -1, colored_ = -1;
};

/// Returns a two-sided material that is neither metallic nor glossy; `color` is linear.
Material plainMaterial(const std::string& name, const glm::vec4& color);

/// Returns a number as a 32-bit float; nothing if it is NaN, infinite or too large.
std::optional<float> coordinate(double value);

/// Colour storage types: the largest value of each, 1 for floating point.
struct ColorTypes {
    double rgb = 1, alpha = 1;
};
/// Converts a file's colours, sRGB with straight alpha, to linear. White is 255 in byte types. In
/// other types white is the least of 1 (floating point only), 255 and 65,535 that no value exceeds;
/// the last two require whole numbers. Returns false if values were out of range and were clamped.
/// Colours with negative alpha stay unchanged.
bool makeLinear(std::vector<glm::vec4>& colors, const ColorTypes& types);

// corner_index.cpp.

/// Numbers distinct keys of three words in order of first appearance. The numbering depends on
/// nothing else, and a secret hash keeps the time independent of the file's choice of keys.
class CornerIndex {
  public:
    using Key = std::array<std::uint32_t, 3>;

    /// Calls `allow` with the bytes before each allocation.
    explicit CornerIndex(std::function<void(std::uint64_t bytes)> allow);

    /// Reserves memory for that many keys at once, which is faster than growing.
    void reserve(std::size_t keys);

    std::uint32_t indexOf(const Key& key) {
        if (keys_.size() >= limit_) growTo(2 * slots_.size());
        for (std::size_t slot = hash(key) & mask_;; slot = (slot + 1) & mask_) {
            const std::uint32_t found = slots_[slot];
            if (found == kNone) {
                slots_[slot] = static_cast<std::uint32_t>(keys_.size());
                keys_.push_back(key);
                return slots_[slot];
            }
            if (keys_[found] == key) return found;
        }
    }
    /// Returns the keys by number.
    const std::vector<Key>& keys() const { return keys_; }

  private:
    static constexpr std::uint32_t kNone = 0xFFFFFFFF;

    std::size_t hash(const Key& key) const {
        const unsigned __int128 product =
            static_cast<unsigned __int128>((std::uint64_t{key[0]} << 32U | key[1]) ^ secret_[0]) *
            (key[2] ^ secret_[1]);
        return static_cast<std::size_t>(product >> 64U) ^ static_cast<std::size_t>(product);
    }
    void growTo(std::size_t size);

    std::function<void(std::uint64_t)> allow_;
    std::array<std::uint64_t, 2> secret_;
    std::vector<Key> keys_;
    std::vector<std::uint32_t> slots_;
    std::size_t mask_ = 0, limit_ = 0;
};

// polygon_cutter.cpp.

/// Triangulates polygons (G. H. Meisters, "Polygons Have Ears", 1975), deterministically: n − 2
/// triangles for n corners, none for one or two. A polygon whose corners all turn the same way
/// becomes a fan around its first corner. From others ears are cut off, in projection along the
/// axis nearest to the normal. Collinear corners, repeated corners and bridges to holes stay. A
/// self-intersecting polygon gets the right number of triangles, though not necessarily the right
/// ones.
class PolygonCutter {
  public:
    using Triangle = std::array<std::uint32_t, 3>;

    /// Returns the triangles as indices into `corners`, valid until the next call. Throws Error
    /// (kInput) without `where` if all polygons together take more than 2^29 steps.
    std::span<const Triangle> cut(std::span<const glm::vec3> corners);

  private:
    void fan();
    bool turnsOneWay() const;
    void project(std::span<const glm::vec3> corners);
    void cutEars();
    bool isEar(std::uint32_t corner) const;
    void cutOff(std::uint32_t corner);
    double turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const;
    void spend(std::uint64_t steps);

    std::vector<glm::dvec2> points_;  ///< counter-clockwise
    std::vector<std::uint32_t> next_, previous_;
    std::vector<char> reflex_;
    std::uint32_t left_ = 0;  ///< remaining corners
    std::vector<Triangle> triangles_;
    std::uint64_t spent_ = 0;
};

// smooth_normals.cpp.

/// Adds normals to a primitive of indexed triangles, smooth within patches. A patch continues
/// across an edge if two triangles share its positions in opposite directions and the edge turns by
/// at most `degrees`. A normal is the mean of the patch's triangle normals at the position,
/// weighted by angle (G. Thürmer and C. A. Wüthrich, "Computing Vertex Normals from Polygonal
/// Facets", 1998). Vertices with several normals are split.
void addSmoothNormals(Primitive& primitive, double degrees,
                      const std::function<void(std::uint64_t bytes)>& allow);

// mesh_textures.cpp.

/// A texture reference: the file, and its mapping (U, V from the lower left).
struct MeshMap {
    std::string file{};   ///< "" = none
    std::string where{};  ///< the line with the reference
    std::string from{};   ///< the folder it is relative to, from the scene's
    glm::vec2 scale{1}, offset{0};
    bool clamp = false;
    float strength = 1;
    std::vector<std::string> lost{};  ///< unsupported options

    explicit operator bool() const { return !file.empty(); }
};

/// The textures of a scene, each file decoded once.
class MeshTextures {
  public:
    explicit MeshTextures(MeshFile& file) : file_(file) {}

    /// Returns the texture; none, with a warning, if it is unavailable.
    TextureRef texture(const MeshMap& map);
    /// Returns a texture of channels from others: channel i is channel `of[i].channel` of the
    /// texture `of[i].map`, at the nearest pixel, or 255 without a map.
    struct Source {
        const MeshMap* map = nullptr;
        int channel = 0;
    };
    TextureRef combined(const std::array<Source, 4>& of);

  private:
    int image(const MeshMap& map);

    MeshFile& file_;
    std::map<std::string, int> images_;  ///< by file; −1 = unavailable
};

// obj_materials.cpp.

/// Returns a name in an OBJ or MTL, which may contain blanks: the text before a comment (" # ").
std::string_view objName(std::string_view text);

/// The materials of an OBJ's .mtl files, in file order. A texture is read when its material is
/// first used.
class ObjMaterials {
  public:
    explicit ObjMaterials(MeshFile& file);
    ~ObjMaterials();

    /// Reads the files listed by `mtllib`; `where` is its line.
    void load(std::string_view names, const std::string& where);
    /// Returns the material's index in the scene; for an unknown name the neutral one, with a
    /// warning.
    int use(const std::string& material, const std::string& where);
    /// Reports that faces of the material (returned by use()) lack texture coordinates.
    void useWithoutTexcoords(int material);
    /// Adds the materials to the scene.
    void finish();

  private:
    struct Mtl;
    /// A problem that several materials have.
    struct Fault {
        std::size_t count = 0;
        std::string first{};  ///< name of the first such material

        void add(const Mtl& mtl);
    };
    void read(const std::string& name, std::string_view text);
    void lose(Mtl& mtl, const std::string& sentence, const std::string& where);
    bool readNumbers(Mtl& mtl, std::string_view word, std::string_view rest,
                     const std::string& where);
    float opacity(const Mtl& mtl);
    Material material(const Mtl& mtl);
    void warnOf(const Fault& fault, const std::string& what, const std::string& more);

    MeshFile& file_;
    MeshTextures textures_;
    std::set<std::string> libraries_;  ///< already read
    std::vector<Mtl> materials_;
    std::map<std::string, int, std::less<>> numbers_;
    Fault contradictory_, invisible_, tinted_, unplaced_;
};

}  // namespace peeler
