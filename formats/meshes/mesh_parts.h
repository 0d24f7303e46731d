// SPDX-License-Identifier: Apache-2.0
// What the readers of PLY, STL, OBJ and arrays are made of: the file, corners that are one vertex,
// polygons, normals, materials and textures. What is wrong with a file is an Error (kInput) that
// names the place in it.
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

// ply_scene.cpp, stl_scene.cpp, obj_scene.cpp, array_scene.cpp: rows of the table.

Scene readPlyScene(const std::filesystem::path& path, const SceneReadOptions& options);
Scene readStlScene(const std::filesystem::path& path, const SceneReadOptions& options);
bool isStl(std::string_view begin, std::uint64_t size);
Scene readObjScene(const std::filesystem::path& path, const SceneReadOptions& options);
bool isObj(std::string_view begin, std::uint64_t size);
Scene readArrayScene(const std::filesystem::path& path, const SceneReadOptions& options);
bool isArrayScene(std::string_view begin, std::uint64_t size);

/// The text without the byte order mark that it may begin with (UTF-8).
std::string_view withoutByteOrderMark(std::string_view text);

// mesh_file.cpp.

/// A file that is read, and the scene that becomes of it.
class MeshFile {
  public:
    /// Reads all bytes of the file.
    MeshFile(const std::filesystem::path& path, const SceneReadOptions& options);
    MeshFile(const MeshFile&) = delete;
    MeshFile& operator=(const MeshFile&) = delete;

    std::span<const std::uint8_t> bytes() const { return bytes_; }
    std::string_view text() const;
    const std::string& name() const { return name_; }  ///< the path
    std::string stem() const;                          ///< for what has no name
    const SceneReadOptions& options() const { return options_; }
    Scene& scene() { return scene_; }

    /// Called before something is allocated that a file can make large: throws Error (kMemory) if
    /// so many bytes are not within the budget.
    void allow(std::uint64_t bytes) { memory_.allow(bytes, name_); }
    /// The same of vertices and indices as the scene has them, which max_geometry_bytes limits.
    void allowGeometry(std::uint64_t bytes);

    /// Where a place in the file is: "part.obj:12", "part.stl, byte 84".
    std::string atLine(std::size_t place) const;
    std::string atByte(std::size_t place) const;
    /// Adds a sentence to the scene's warnings, as ReadWarnings does.
    void warn(const Text& sentence, const Text& where = {}) { warnings_.warn(sentence, where); }

    /// Reads another file of its folder, named in a line (`where`) of it or of such a file, whose
    /// folder is `from`, and lets its bytes enter the scene's hash.
    std::vector<std::uint8_t> readBeside(const std::string& file, const std::string& from,
                                         const std::string& where);
    /// The folder, from the scene's, of a file that it names.
    std::string folderOf(const std::string& file) const;
    /// Warns of what cannot be had (a texture, materials).
    void missing(const std::string& what, const Error& problem, const std::string& where);

    /// Gives a mesh that shows something to a new node.
    int addNode(const std::string& node_name, Mesh mesh);
    /// The plain grey material, made when it is asked for first.
    int neutralMaterial();
    /// The white one of what has colours of its own, likewise.
    int colorMaterial();
    /// Ends the scene: normals, the default material, the roots. Hands it over.
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

/// Neither metal nor mirror, seen from both sides; of `color`, linear.
Material plainMaterial(const std::string& name, const glm::vec4& color);

/// A number of a file as a 32-bit float. Not a number, infinite or too large: nothing.
std::optional<float> coordinate(double value);

/// How numbers of colours are stored: the most that their type can say, 1 for floating point.
struct ColorTypes {
    double rgb = 1, alpha = 1;
};
/// Makes colours as files have them, sRGB with straight alpha, linear. 1 is 255 in bytes. In other
/// types it is the least of 1 (floating point alone), 255 and 65,535 that holds all the numbers, if
/// they are whole. Returns false where numbers are beyond what can be a colour, and were clamped.
/// Colours of negative alpha stay.
bool makeLinear(std::vector<glm::vec4>& colors, const ColorTypes& types);

// corner_index.cpp.

/// Numbers what is there by three words, equal ones alike, in the order in which they come. Which
/// numbers come out depends on nothing else, and how long it takes not on what a file chooses.
class CornerIndex {
  public:
    using Key = std::array<std::uint32_t, 3>;

    /// `allow` is told of bytes before they are taken.
    explicit CornerIndex(std::function<void(std::uint64_t bytes)> allow);

    /// Makes room for so many at once, which is quicker than by and by.
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
    /// By number.
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

/// Cuts polygons into triangles (G. H. Meisters, "Polygons Have Ears", 1975), the same ones every
/// time: n − 2 of n corners, whatever the polygon, and none of one or two. A polygon whose corners
/// all turn the same way is a fan around its first corner; of others ears are cut off, as they are
/// seen along the axis that its normal is nearest to. Corners on a straight line, repeated corners
/// and bridges to holes stay; what crosses itself has the right number of triangles, if not the
/// right ones.
class PolygonCutter {
  public:
    using Triangle = std::array<std::uint32_t, 3>;

    /// The corners of the triangles by their places in `corners`, until the next call. Throws Error
    /// (kInput) without `where` when all polygons together take more than 2^29 steps.
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
    std::uint32_t left_ = 0;  ///< corners that have not been cut off
    std::vector<Triangle> triangles_;
    std::uint64_t spent_ = 0;
};

// smooth_normals.cpp.

/// Gives a primitive of indexed triangles normals that are smooth within patches: across an edge
/// that two triangles have between the same positions, in opposite directions, and that turns by
/// `degrees` at most. A normal is the mean of those of its patch's triangles at the position, by
/// their angles there (G. Thürmer and C. A. Wüthrich, "Computing Vertex Normals from Polygonal
/// Facets", 1998). Vertices with several normals become several.
void addSmoothNormals(Primitive& primitive, double degrees,
                      const std::function<void(std::uint64_t bytes)>& allow);

// mesh_textures.cpp.

/// How a texture is used: which file, and where in its picture (U, V from the lower left).
struct MeshMap {
    std::string file{};   ///< "" = none
    std::string where{};  ///< the line that names it
    std::string from{};   ///< the folder from which the name leads, from the scene's
    glm::vec2 scale{1}, offset{0};
    bool clamp = false;
    float strength = 1;
    std::vector<std::string> lost{};  ///< options that are not carried out

    explicit operator bool() const { return !file.empty(); }
};

/// The pictures of a scene, each decoded once.
class MeshTextures {
  public:
    explicit MeshTextures(MeshFile& file) : file_(file) {}

    /// The picture as a texture; none, with a warning, if it cannot be had.
    TextureRef texture(const MeshMap& map);
    /// A picture with channels of others: channel i is channel `of[i].channel` of the texture
    /// `of[i].map`, as it is at the nearest pixel, or 255 without one.
    struct Source {
        const MeshMap* map = nullptr;
        int channel = 0;
    };
    TextureRef combined(const std::array<Source, 4>& of);

  private:
    int image(const MeshMap& map);

    MeshFile& file_;
    std::map<std::string, int> images_;  ///< by file; −1 = it cannot be had
};

// obj_materials.cpp.

/// A name in an OBJ or MTL, which may have blanks in it: what stands before a comment (" # ").
std::string_view objName(std::string_view text);

/// The materials of the .mtl files that an OBJ names, in the files' order. A texture is read when
/// its material is used first.
class ObjMaterials {
  public:
    explicit ObjMaterials(MeshFile& file);
    ~ObjMaterials();

    /// Reads what `mtllib` names; `where` is its line.
    void load(std::string_view names, const std::string& where);
    /// The index of the material in the scene; the neutral one, with a warning, of an unknown name.
    int use(const std::string& material, const std::string& where);
    /// Faces of the material (what use() returned) have no texture coordinates.
    void useWithoutTexcoords(int material);
    /// Puts the materials into the scene.
    void finish();

  private:
    struct Mtl;
    /// What is wrong with several materials.
    struct Fault {
        std::size_t count = 0;
        std::string first{};  ///< the name of a material

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
    std::set<std::string> libraries_;  ///< that have been read
    std::vector<Mtl> materials_;
    std::map<std::string, int, std::less<>> numbers_;
    Fault contradictory_, invisible_, tinted_, unplaced_;
};

}  // namespace peeler
