// SPDX-License-Identifier: Apache-2.0
// Building blocks for the readers of PLY, STL, OBJ, 3MF and arrays: the file, vertex deduplication,
// polygons, normals, materials and textures. They throw Error (kInput), with the position in the
// file as `where`, if the file is faulty.
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

// The functions in the format table, defined in ply_scene.cpp, stl_scene.cpp, obj_scene.cpp,
// threemf_scene.cpp and array_scene.cpp.

Scene readPlyScene(const std::filesystem::path& path, const SceneReadOptions& options);
Scene readStlScene(const std::filesystem::path& path, const SceneReadOptions& options);
bool isStl(std::string_view begin, std::uint64_t size);
Scene readObjScene(const std::filesystem::path& path, const SceneReadOptions& options);
bool isObj(std::string_view begin, std::uint64_t size);
Scene readThreeMfScene(const std::filesystem::path& path, const SceneReadOptions& options);
bool isThreeMf(std::string_view begin, std::uint64_t size);
Scene readArrayScene(const std::filesystem::path& path, const SceneReadOptions& options);
bool isArrayScene(std::string_view begin, std::uint64_t size);

// The same for Gaussian splats, defined in the room formats/splats.

Scene readSplatPly(const std::filesystem::path& path, const SceneReadOptions& options);
bool isSplatPly(std::string_view begin, std::uint64_t size);
Scene readCompressedSplatPly(const std::filesystem::path& path, const SceneReadOptions& options);
bool isCompressedSplatPly(std::string_view begin, std::uint64_t size);
Scene readSpz(const std::filesystem::path& path, const SceneReadOptions& options);
bool isSpz(std::string_view begin, std::uint64_t size);
Scene readDotSplat(const std::filesystem::path& path, const SceneReadOptions& options);
bool mayBeDotSplat(std::string_view begin, std::uint64_t size);

/// Returns the text without a UTF-8 byte order mark.
std::string_view withoutByteOrderMark(std::string_view text);

// Defined in scene_reader.cpp.

/// Returns the transform from a file's axes and units to those of the scene. It is exact if the
/// unit is a metre.
glm::dmat4 placeOf(Axis up, double unit);

// Defined in mesh_file.cpp.

/// A mesh file that is being read, and the scene made from it.
class MeshFile {
  public:
    /// Reads the whole file.
    MeshFile(const std::filesystem::path& path, const SceneReadOptions& options);
    MeshFile(const MeshFile&) = delete;
    MeshFile& operator=(const MeshFile&) = delete;

    std::span<const std::uint8_t> bytes() const { return bytes_; }
    std::string_view text() const;
    /// Returns the file's path.
    const std::string& name() const { return name_; }
    /// Returns the name for objects without a name: the file's name without extension.
    std::string stem() const;
    const SceneReadOptions& options() const { return options_; }
    Scene& scene() { return scene_; }

    /// Throws Error (kMemory) if this many more bytes exceed the memory budget. Call it before any
    /// allocation whose size the file controls.
    void allow(std::uint64_t bytes) { memory_.allow(bytes, name_); }
    /// Checks the memory budget and max_geometry_bytes, for vertices and indices of the scene.
    void allowGeometry(std::uint64_t bytes);
    /// Returns the rest of the memory budget, in bytes.
    std::uint64_t memoryLeft() const;

    /// These return the text of a position in the file: "part.obj:12", "part.stl, byte 84".
    std::string atLine(std::size_t place) const;
    std::string atByte(std::size_t place) const;
    void warn(const Text& sentence, const Text& where = {}) { warnings_.warn(sentence, where); }

    /// Reads another file in the scene's folder, and adds its bytes to the scene's hash. `where` is
    /// the line that names the file; `from` is the folder of the file with that line.
    std::vector<std::uint8_t> readBeside(const std::string& file, const std::string& from,
                                         const std::string& where);
    /// Returns the folder of a referenced file, relative to the scene's folder.
    std::string folderOf(const std::string& file) const;
    /// Warns that a texture file or material file is not available.
    void missing(const std::string& what, const Error& problem, const std::string& where);

    /// Adds a mesh, which several nodes may place. Returns its index.
    int addMesh(const std::string& mesh_name, Mesh mesh);
    /// Adds a node, and the mesh unless it is empty. Returns the node's index.
    int addNode(const std::string& node_name, Mesh mesh);
    /// Returns the index of the plain grey material. The first call adds it.
    int neutralMaterial();
    /// Returns the index of the white material, for meshes with their own colours. The first call
    /// adds it.
    int colorMaterial();
    /// Completes the scene (normals, default material, roots) and returns it.
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

/// Returns a number as a 32-bit float, or nothing if it is NaN, infinite, or beyond the range of
/// floats.
std::optional<float> coordinate(double value);

/// The maximum values of the types that store colours; 1 for floating point.
struct ColorTypes {
    double rgb = 1, alpha = 1;
};
/// Converts a file's colours (sRGB with straight alpha) to linear. For byte types, white is 255.
/// For other types, white is 1 if no value exceeds 1 (floating point only), else 255 if no value
/// exceeds 255, else 65,535; 255 and 65,535 require that all values are integers. Returns false if
/// values were out of range and have been clamped. Leaves colours with negative alpha unchanged.
bool makeLinear(std::vector<glm::vec4>& colors, const ColorTypes& types);

// Defined in corner_index.cpp.

/// A numbering of distinct keys of three words in the order of their first appearance. The numbers
/// depend on nothing else. The hash has a secret random key, so that no file can be crafted to make
/// the numbering slow.
class CornerIndex {
  public:
    using Key = std::array<std::uint32_t, 3>;

    /// `allow` is called with the number of bytes before each allocation.
    explicit CornerIndex(std::function<void(std::uint64_t bytes)> allow);

    /// Reserves memory for this many keys at once, which is faster than growing.
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
    /// Returns the keys, ordered by their numbers.
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

// Defined in polygon_cutter.cpp.

/// A triangulator of polygons (G. H. Meisters, "Polygons Have Ears", 1975). It is deterministic: n
/// corners give n − 2 triangles, and one or two corners give none. A polygon whose corners all turn
/// the same way becomes a fan around its first corner. Other polygons are projected along the axis
/// nearest to their normal, and ears are cut off. Collinear corners, repeated corners and bridges
/// to holes are kept. A self-intersecting polygon gets the right number of triangles, though not
/// necessarily the right triangles.
class PolygonCutter {
  public:
    using Triangle = std::array<std::uint32_t, 3>;

    /// Returns the triangles as indices into `corners`, valid until the next call. Throws Error
    /// (kInput) without `where` if all polygons so far take more than 2^29 steps together.
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

    std::vector<glm::dvec2> points_;  ///< corners in counter-clockwise order
    std::vector<std::uint32_t> next_, previous_;
    std::vector<char> reflex_;
    std::uint32_t left_ = 0;  ///< number of corners not yet cut off
    std::vector<Triangle> triangles_;
    std::uint64_t spent_ = 0;
};

// Defined in smooth_normals.cpp.

/// Adds normals, which are smooth within patches, to a primitive of indexed triangles. A patch
/// continues across an edge if exactly two triangles share the edge's end positions, in opposite
/// directions, and if their planes differ by at most `degrees`. The normal at a position is the
/// mean of the normals of the patch's triangles there, weighted by angle (G. Thürmer and C. A.
/// Wüthrich, "Computing Vertex Normals from Polygonal Facets", 1998). Vertices that need several
/// normals are split.
void addSmoothNormals(Primitive& primitive, double degrees,
                      const std::function<void(std::uint64_t bytes)>& allow);

// Defined in mesh_textures.cpp.

/// A reference to a texture: its file, and its mapping (U, V from the lower left).
struct MeshMap {
    std::string file{};   ///< "" if there is no texture
    std::string where{};  ///< place of the reference, for messages
    /// Folder to which `file` is relative. The folder is relative to the scene's folder.
    std::string from{};
    glm::vec2 scale{1}, offset{0};
    bool clamp = false;
    float strength = 1;
    std::vector<std::string> lost{};  ///< names of options that are not supported

    explicit operator bool() const { return !file.empty(); }
};

/// The textures of a scene. Each file is decoded once.
class MeshTextures {
  public:
    explicit MeshTextures(MeshFile& file) : file_(file) {}

    /// Returns a reference to the texture. If the texture is not available, warns and returns an
    /// empty reference.
    TextureRef texture(const MeshMap& map);
    /// Returns a texture combined from channels of others: channel i is channel `of[i].channel` of
    /// the texture `of[i].map`, at the nearest pixel, or 255 if `map` is null.
    struct Source {
        const MeshMap* map = nullptr;
        int channel = 0;
    };
    TextureRef combined(const std::array<Source, 4>& of);

  private:
    int image(const MeshMap& map);

    MeshFile& file_;
    /// Index in Scene::images for each file; −1 if the file is not available.
    std::map<std::string, int> images_;
};

// Defined in obj_materials.cpp.

/// Returns a name in an OBJ or MTL: the text up to a comment (" # "). The name may contain blanks.
std::string_view objName(std::string_view text);

/// The materials in the .mtl files of an OBJ, in the order of the files. A material's textures are
/// read when the material is first used.
class ObjMaterials {
  public:
    explicit ObjMaterials(MeshFile& file);
    ~ObjMaterials();

    /// Reads the files in an `mtllib` statement; `where` is its line.
    void load(std::string_view names, const std::string& where);
    /// Returns a material's index in the scene. For an unknown name, warns and returns the index of
    /// the neutral material.
    int use(const std::string& material, const std::string& where);
    /// Records that faces with this material (an index from use()) lack texture coordinates.
    void useWithoutTexcoords(int material);
    /// Adds the materials to the scene.
    void finish();

  private:
    struct Mtl;
    /// A problem that several materials have.
    struct Fault {
        std::size_t count = 0;
        std::string first{};  ///< name of the first material that has the problem

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
    std::set<std::string> libraries_;  ///< names of the .mtl files read so far
    std::vector<Mtl> materials_;
    std::map<std::string, int, std::less<>> numbers_;
    Fault contradictory_, invisible_, tinted_, unplaced_;
};

}  // namespace peeler
