// SPDX-License-Identifier: Apache-2.0
#include "formats/rays/ray_list.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include <peeler/error.h>
#include "core/base/portable_math.h"
#include "core/lens/picture_rays.h"
#include "core/scene/camera_choice.h"
#include "formats/arrays/array_reader.h"
#include "formats/file/content_hash.h"
#include "formats/file/mapped_file.h"

namespace peeler {
namespace {

constexpr const char* kRaysHint =
    "numpy.save(path, rays) with an array (n, 6): origin and direction";
constexpr std::uint64_t kMostRays = std::uint64_t{1} << 28;  // of a bundle

using Shape = std::vector<std::uint64_t>;

/// The arrays of a file.
class RayArrays {
  public:
    explicit RayArrays(const std::filesystem::path& path)
        : where_(path.string()),
          file_(path),
          hash_(hexText(contentHash(std::as_bytes(file_.bytes()), 0))),
          rays_(npyArray(file_.bytes(), where_)) {
        if (rays_) return;
        const auto bytes = file_.bytes();
        if (bytes.size() < 4 || bytes[0] != 'P' || bytes[1] != 'K')
            throw Error(ErrorKind::kInput, "this is neither a .npy of numbers nor a .npz", where_,
                        kRaysHint);
        archive_.emplace(bytes, where_);
        rays_ = find("rays");
    }

    const std::string& where() const { return where_; }
    const std::string& hash() const { return hash_; }
    /// The only array of a .npy, or the array `rays`.
    const std::optional<NumberArray>& rays() const { return rays_; }
    std::optional<NumberArray> find(const char* name) {
        const NpzArchive::Member* const member = archive_ ? archive_->find(name) : nullptr;
        if (!member) return {};
        auto array = npyArray(archive_->contents(*member, storage_.emplace_back()),
                              archive_->placeOf(*member));
        if (!array)
            throw Error(ErrorKind::kInput, "expected an array of numbers",
                        archive_->placeOf(*member));
        return array;
    }
    [[noreturn]] void refuse(const std::string& what) const {
        throw Error(ErrorKind::kInput, what, where_, kRaysHint);
    }

  private:
    std::string where_;
    MappedFile file_;
    std::string hash_;
    std::optional<NpzArchive> archive_;
    std::vector<std::vector<std::uint8_t>> storage_;
    std::optional<NumberArray> rays_;
};

/// Rays by index, with directions of any length.
class RaySource {
  public:
    virtual ~RaySource() = default;
    virtual Ray ray(std::uint64_t index) const = 0;
};

glm::dvec3 vectorAt(const NumberArray& array, std::uint64_t first) {
    return {array.at(first), array.at(first + 1), array.at(first + 2)};
}

class RowsOfSix final : public RaySource {
  public:
    explicit RowsOfSix(NumberArray rays) : rays_(std::move(rays)) {}
    Ray ray(std::uint64_t index) const override {
        return {vectorAt(rays_, 6 * index), vectorAt(rays_, 6 * index + 3)};
    }

  private:
    NumberArray rays_;
};

class OriginsAndDirections final : public RaySource {
  public:
    OriginsAndDirections(NumberArray origins, NumberArray directions)
        : origins_(std::move(origins)), directions_(std::move(directions)) {}
    Ray ray(std::uint64_t index) const override {
        return {vectorAt(origins_, 3 * index), vectorAt(directions_, 3 * index)};
    }

  private:
    NumberArray origins_, directions_;
};

/// The beams of a LiDAR sensor, at whose poses the columns of a picture are measured.
class Beams final : public RaySource {
  public:
    /// `angles`: (n, 2), azimuth and elevation of each ray. Without `poses`, the sensor is at rest.
    Beams(const NumberArray& angles, const std::optional<NumberArray>& poses)
        : columns_(angles.shape[0]), poses_(posesOf(poses)) {
        for (std::uint64_t i = 0; i < columns_; ++i) {
            azimuths_.push_back(turnOf(angles.at(2 * i)));
            elevations_.push_back(turnOf(angles.at(2 * i + 1)));
        }
    }
    /// All pairs of an elevation, from the top row on, and an azimuth.
    Beams(const NumberArray& elevations, const NumberArray& azimuths,
          const std::optional<NumberArray>& poses)
        : columns_(azimuths.count()), grid_(true), poses_(posesOf(poses)) {
        for (std::uint64_t i = 0; i < columns_; ++i)
            azimuths_.push_back(turnOf(azimuths.at(i)));
        for (std::uint64_t i = 0; i < elevations.count(); ++i)
            elevations_.push_back(turnOf(elevations.at(i)));
    }
    Ray ray(std::uint64_t index) const override {
        const std::uint64_t column = index % columns_;
        const SinCos a = azimuths_[column], e = elevations_[grid_ ? index / columns_ : column];
        const glm::dmat4& pose = poses_[poses_.size() == 1 ? 0 : column];
        return {glm::dvec3(pose[3]),
                glm::dmat3(pose) * glm::dvec3(e.cos * a.cos, e.cos * a.sin, e.sin)};
    }

  private:
    static SinCos turnOf(double degrees) {
        constexpr double kMost = 1e6;
        if (!(std::abs(degrees) <= kMost)) return {std::nan(""), std::nan("")};
        return portableSinCos(degrees * (std::numbers::pi / 180));
    }
    static std::vector<glm::dmat4> posesOf(const std::optional<NumberArray>& poses) {
        if (!poses) return {glm::dmat4(0, 0, -1, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1)};
        std::vector<glm::dmat4> all(poses->count() / 16);
        for (std::uint64_t i = 0; i < poses->count(); ++i)
            all[i / 16][static_cast<int>(i % 4)][static_cast<int>(i / 4 % 4)] = poses->at(i);
        return all;
    }

    std::uint64_t columns_;
    bool grid_ = false;
    std::vector<SinCos> azimuths_{}, elevations_{};
    std::vector<glm::dmat4> poses_;
};

/// The rays of a bundle: a part of a file's rays, row by row.
class RayList final : public PictureRays {
  public:
    RayList(std::shared_ptr<RayArrays> arrays, std::shared_ptr<const RaySource> source,
            std::uint64_t first, const Size& size)
        : arrays_(std::move(arrays)), source_(std::move(source)), first_(first), size_(size) {}

    Ray at(const glm::dvec2& pixel) const override {
        return rayAt(static_cast<int>(pixel.x), static_cast<int>(pixel.y));
    }
    void fill(const Window& window, const glm::dvec2&, std::span<Ray> rays) const override {
        std::size_t i = 0;
        for (int y = window.y0; y < window.y1; ++y)
            for (int x = window.x0; x < window.x1; ++x)
                rays[i++] = rayAt(x, y);
    }
    /// The rays of a list (n) are unrelated; those of a picture (h, w) differ as its pixels do.
    RayDifferentials differentials(const glm::dvec2& pixel) const override {
        if (size_.width == 1) return {};
        const glm::ivec2 at(pixel);
        const auto along = [&](int axis, int size) {
            glm::ivec2 before = at, after = at;
            before[axis] = std::max(at[axis] - 1, 0);
            after[axis] = std::min(at[axis] + 1, size - 1);
            const Ray a = rayAt(before.x, before.y), b = rayAt(after.x, after.y);
            const double pixels = after[axis] - before[axis];
            if (pixels == 0 || a.direction == glm::dvec3(0) || b.direction == glm::dvec3(0))
                return Ray();
            return Ray{(b.origin - a.origin) / pixels, (b.direction - a.direction) / pixels};
        };
        return {along(0, size_.width), along(1, size_.height)};
    }
    bool oneEye() const override { return false; }
    std::string text() const override {
        return "list " + arrays_->hash() + " " + std::to_string(first_);
    }

  private:
    Ray rayAt(int x, int y) const {
        Ray ray = source_->ray(
            first_ + static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(size_.width) +
            static_cast<std::uint64_t>(x));
        // Scales first, so that the square neither overflows nor vanishes.
        const glm::dvec3 size = glm::abs(ray.direction);
        const double most = std::max({size.x, size.y, size.z});
        const glm::dvec3 scaled = ray.direction / most;
        ray.direction = scaled / std::sqrt(glm::dot(scaled, scaled));
        const double all =
            glm::dot(ray.origin, glm::dvec3(0)) + glm::dot(ray.direction, glm::dvec3(0));
        return all == 0 ? ray : Ray();  // NaN if a number is not finite
    }

    std::shared_ptr<RayArrays> arrays_;  ///< whose bytes the source uses
    std::shared_ptr<const RaySource> source_;
    std::uint64_t first_;
    Size size_;
};

/// The rays of a file, and the shape of their picture.
struct ReadRays {
    std::shared_ptr<const RaySource> source;
    Shape shape;  ///< (n) or (h, w)
};

/// Returns the shape without the last axis, which must have this length.
std::optional<Shape> shapeOf(const NumberArray& array, std::uint64_t length) {
    const Shape& shape = array.shape;
    if ((shape.size() != 2 && shape.size() != 3) || shape.back() != length) return {};
    return Shape(shape.begin(), shape.end() - 1);
}

ReadRays readBeams(RayArrays& arrays) {
    const auto angles = arrays.find("angles"), azimuths = arrays.find("azimuths"),
               elevations = arrays.find("elevations"), poses = arrays.find("poses");
    if (angles ? angles->shape.size() != 2 || angles->shape[1] != 2
               : !azimuths || !elevations || azimuths->shape.size() != 1 ||
                     elevations->shape.size() != 1)
        arrays.refuse(
            "there are no arrays `rays`, `origins` and `directions`, `angles` (n, 2), or "
            "`azimuths` (w) and `elevations` (h)");
    const std::uint64_t columns = angles ? angles->shape[0] : azimuths->count();
    if (poses && poses->shape != Shape{4, 4} && poses->shape != Shape{columns, 4, 4})
        arrays.refuse("`poses` has the shape " + shapeText(poses->shape) + ", not (4, 4) or " +
                      shapeText({columns, 4, 4}));
    if (angles) return {std::make_shared<Beams>(*angles, poses), {columns}};
    return {std::make_shared<Beams>(*elevations, *azimuths, poses), {elevations->count(), columns}};
}

ReadRays raysIn(RayArrays& arrays) {
    if (const auto& rays = arrays.rays()) {
        const auto shape = shapeOf(*rays, 6);
        if (!shape)
            arrays.refuse("the array of rays has the shape " + shapeText(rays->shape) +
                          ", not (n, 6) or (h, w, 6)");
        return {std::make_shared<RowsOfSix>(*rays), *shape};
    }
    const auto origins = arrays.find("origins"), directions = arrays.find("directions");
    if (!origins && !directions) return readBeams(arrays);
    const auto shape = origins && directions ? shapeOf(*origins, 3) : std::nullopt;
    if (!shape || directions->shape != origins->shape)
        arrays.refuse("`origins` and `directions` are not both (n, 3) or (h, w, 3)");
    return {std::make_shared<OriginsAndDirections>(*origins, *directions), *shape};
}

}  // namespace

std::vector<Bundle> readRays(const std::filesystem::path& path) {
    const auto arrays = std::make_shared<RayArrays>(path);
    const ReadRays read = raysIn(*arrays);
    std::uint64_t left = 1, width = 1;
    for (const std::uint64_t length : read.shape)
        left *= length;
    if (left == 0) arrays->refuse("the file has no rays");
    const bool picture = read.shape.size() == 2 && left <= kMostRays &&
                         read.shape[1] <= std::uint64_t{kMostPictureSide};
    if (picture) width = read.shape[1];
    std::vector<Bundle> bundles;
    for (std::uint64_t first = 0; left > 0;) {
        const std::uint64_t count = std::min(left, kMostRays);
        Bundle& bundle = bundles.emplace_back();
        bundle.name = "rays";
        if (first > 0) bundle.name += "_" + std::to_string(bundles.size() - 1);
        View& view = bundle.view;
        view.camera_name = bundle.name;
        view.projection.near = 0;
        view.width = static_cast<int>(width);
        view.height = static_cast<int>(count / width);
        view.crop = {0, 0, view.width, view.height};
        view.known = false;
        view.rays =
            std::make_shared<RayList>(arrays, read.source, first, Size{view.width, view.height});
        first += count;
        left -= count;
    }
    return bundles;
}

}  // namespace peeler
