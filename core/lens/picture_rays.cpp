// SPDX-License-Identifier: Apache-2.0
#include "core/lens/picture_rays.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <utility>

#include "core/base/portable_math.h"

namespace peeler {
namespace {

void append(double number, std::string& text) {
    std::array<char, 32> digits;
    const auto end = std::to_chars(digits.begin(), digits.end(), number).ptr;
    text.append(1, ' ').append(digits.begin(), end);
}

class LensPicture final : public PictureRays {
  public:
    LensPicture(const LensCamera& camera, const Size& size)
        : camera_(camera), rays_(camera.lens, camera.intrinsics, size) {}

    Ray at(const glm::dvec2& pixel) const override {
        const auto ray = rays_.ray(pixel);
        return {glm::dvec3(0), ray ? ray->direction : glm::dvec3(0)};
    }
    void fill(const Window& window, const glm::dvec2& sample, std::span<Ray> rays) const override {
        std::ranges::transform(rays_.directions(window, sample), rays.begin(),
                               [](const glm::dvec3& direction) {
                                   return Ray{glm::dvec3(0), direction};
                               });
    }
    RayDifferentials differentials(const glm::dvec2& pixel) const override {
        const auto ray = rays_.ray(pixel);
        if (!ray) return {};
        return {{glm::dvec3(0), ray->per_x}, {glm::dvec3(0), ray->per_y}};
    }
    const LensCamera* lens() const override { return &camera_; }
    std::string_view kind() const override { return "lens"; }
    std::string text() const override {
        const auto& [fx, fy, cx, cy] = camera_.intrinsics;
        std::string text = camera_.lens.model;
        for (const double number : camera_.lens.coefficients)
            append(number, text);
        text += ';';
        for (const double number : {fx, fy, cx, cy})
            append(number, text);
        return text;
    }

  private:
    LensCamera camera_;
    LensRays rays_;
};

class MappedPicture final : public PictureRays {
  public:
    MappedPicture(std::shared_ptr<const PictureRays> inner, const glm::dvec2& first,
                  const glm::dvec2& step)
        : inner_(std::move(inner)), first_(first), step_(step) {}

    Ray at(const glm::dvec2& pixel) const override { return inner_->at(first_ + step_ * pixel); }
    RayDifferentials differentials(const glm::dvec2& pixel) const override {
        const auto [per_x, per_y] = inner_->differentials(first_ + step_ * pixel);
        return {{step_.x * per_x.origin, step_.x * per_x.direction},
                {step_.y * per_y.origin, step_.y * per_y.direction}};
    }
    bool oneEye() const override { return inner_->oneEye(); }
    std::string text() const override {
        std::string text = inner_->text() + "; mapped";
        for (const double number : {first_.x, first_.y, step_.x, step_.y})
            append(number, text);
        return text;
    }

  private:
    std::shared_ptr<const PictureRays> inner_;
    glm::dvec2 first_, step_;
};

/// The rotation between two poses, as in animations of glTF (slerp), with portable functions.
glm::dquat between(const glm::dquat& a, glm::dquat b, double share) {
    double cosine = glm::dot(a, b);
    if (cosine < 0) {
        b = -b;
        cosine = -cosine;
    }
    const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    if (sine < 1e-9) return glm::normalize(a * (1 - share) + b * share);
    const double angle = portableAtan2(sine, cosine);
    return glm::normalize(
        (a * portableSinCos((1 - share) * angle).sin + b * portableSinCos(share * angle).sin) /
        sine);
}

class ShutterPicture final : public PictureRays {
  public:
    ShutterPicture(std::shared_ptr<const PictureRays> still, std::vector<glm::dmat4> poses,
                   int height)
        : still_(std::move(still)), poses_(std::move(poses)), height_(height) {
        for (const glm::dmat4& pose : poses_)
            turns_.push_back(glm::quat_cast(glm::dmat3(pose)));
    }

    Ray at(const glm::dvec2& pixel) const override {
        const Ray still = still_->at(pixel);
        const double along =
            std::clamp(pixel.y / height_, 0.0, 1.0) * static_cast<double>(poses_.size() - 1);
        const std::size_t first = std::min(static_cast<std::size_t>(along), poses_.size() - 2);
        const double share = along - static_cast<double>(first);
        const glm::dquat turn = between(turns_[first], turns_[first + 1], share);
        const glm::dvec3 a(poses_[first][3]), b(poses_[first + 1][3]);
        const glm::dvec3 direction = turn * still.direction;
        const double length = glm::length(direction);
        return {a + (b - a) * share + turn * still.origin,
                length > 0 ? direction / length : glm::dvec3(0)};
    }
    RayDifferentials differentials(const glm::dvec2& pixel) const override {
        const auto along = [&](const glm::dvec2& step) {
            const Ray before = at(pixel - step), after = at(pixel + step);
            if (before.direction == glm::dvec3(0) || after.direction == glm::dvec3(0)) return Ray();
            return Ray{after.origin - before.origin, after.direction - before.direction};
        };
        return {along({0.5, 0}), along({0, 0.5})};
    }
    bool oneEye() const override { return false; }
    std::string_view kind() const override { return "shutter"; }
    std::string text() const override {
        std::string text = still_->text() + "; shutter";
        for (const glm::dmat4& pose : poses_)
            for (int i = 0; i < 16; ++i)
                append(pose[i / 4][i % 4], text);
        return text;
    }

  private:
    std::shared_ptr<const PictureRays> still_;
    std::vector<glm::dmat4> poses_;
    std::vector<glm::dquat> turns_;
    int height_;
};

}  // namespace

void PictureRays::fill(const Window& window, const glm::dvec2& sample, std::span<Ray> rays) const {
    std::size_t i = 0;
    for (int y = window.y0; y < window.y1; ++y)
        for (int x = window.x0; x < window.x1; ++x)
            rays[i++] = at(glm::dvec2(x, y) + sample);
}

RayDifferentials PictureRays::differentials(const glm::dvec2&) const {
    return {};
}

std::shared_ptr<const PictureRays> mappedPicture(std::shared_ptr<const PictureRays> inner,
                                                 const glm::dvec2& first, const glm::dvec2& step) {
    return std::make_shared<MappedPicture>(std::move(inner), first, step);
}

std::shared_ptr<const PictureRays> lensPicture(const LensCamera& camera, const Size& size) {
    return std::make_shared<LensPicture>(camera, size);
}

std::shared_ptr<const PictureRays> shutterPicture(std::shared_ptr<const PictureRays> still,
                                                  std::vector<glm::dmat4> poses, int height) {
    return std::make_shared<ShutterPicture>(std::move(still), std::move(poses), height);
}

}  // namespace peeler
