// SPDX-License-Identifier: Apache-2.0
// Conversion of a View and a Provenance to OpenEXR attributes, and of JSON to a camera.
#include "formats/exr/exr_header.h"

#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfRationalAttribute.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include <peeler/error.h>
#include "core/base/printable.h"
#include "core/scene/view.h"
#include "formats/exr/deep_certificate.h"
#include "formats/exr/exr_attributes.h"
#include "formats/file/json_text.h"
#include "formats/file/lens_json.h"

namespace peeler {
namespace {

/// GLM stores matrices for column vectors column by column, and Imath stores matrices for row
/// vectors row by row, so the order of the numbers is the same.
Imath::M44f rowVectorMatrix(const glm::dmat4& m) {
    Imath::M44f out;
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 4; ++row)
            out[column][row] = static_cast<float>(m[column][row]);
    }
    return out;
}

glm::dmat4 worldToCamera(const View& view) {
    // OpenGL's camera space is right-handed, OpenEXR's left-handed: negate z.
    glm::dmat4 flip(1);
    flip[2][2] = -1;
    return flip * glm::inverse(view.camera_to_world);
}

/// Returns the matrix from (left-handed) camera space to NDC, for column vectors.
glm::dmat4 cameraToNdc(const Projection& projection) {
    const double near = projection.near, far = projection.far;
    const bool bounded = std::isfinite(far) && far > near;
    glm::dmat4 m(0);
    if (projection.perspective) {
        // x/w = (x / (z·half_width) + 1) / 2; y/w is the same with −y; w = z.
        const double scale = bounded ? far / (far - near) : 1;
        m[0][0] = 0.5 / projection.half_width;
        m[1][1] = -0.5 / projection.half_height;
        m[2] = {0.5, 0.5, scale, 1};
        m[3] = {0, 0, -scale * near, 0};
    } else {
        const double scale = bounded ? 1 / (far - near) : 1;
        m[0][0] = 0.5 / projection.half_width;
        m[1][1] = -0.5 / projection.half_height;
        m[2][2] = scale;
        m[3] = {0.5, 0.5, -scale * near, 1};
    }
    return m;
}

double degrees(double tangent_of_half) {
    return 2 * std::atan(tangent_of_half) * 180 / std::numbers::pi;
}

float pixelAspectRatio(const View& view) {
    if (!view.known || view.rays) return 1;
    const double ratio =
        (view.projection.half_width / view.width) / (view.projection.half_height / view.height);
    // Rounding may make the ratio of square pixels slightly different from 1.
    constexpr double kRounding = 1e-6;
    return std::abs(ratio - 1) < kRounding ? 1.0F : static_cast<float>(ratio);
}

void addCamera(Imf::Header& header, const View& view) {
    const Projection& projection = view.projection;
    const glm::dmat4 world_to_camera = worldToCamera(view);
    Imf::addWorldToCamera(header, rowVectorMatrix(world_to_camera));
    if (!view.rays)
        Imf::addWorldToNDC(header, rowVectorMatrix(cameraToNdc(projection) * world_to_camera));

    const auto add = [&](const char* name, double value) {
        header.insert(name, Imf::FloatAttribute(static_cast<float>(value)));
    };
    add("near", projection.near);
    add("far", projection.far);
    if (view.rays) return;
    if (projection.perspective) {
        add("fieldOfViewHorizontal", degrees(projection.half_width));
        add("fieldOfViewVertical", degrees(projection.half_height));
    } else {
        add("orthographicWidth", 2 * projection.half_width);
        add("orthographicHeight", 2 * projection.half_height);
    }
}

void addProvenance(Imf::Header& header, std::span<const PictureAttribute> attributes) {
    struct Adder {
        Imf::Header& header;
        const char* name;
        void operator()(const std::string& text) const {
            header.insert(name, Imf::StringAttribute(text));
        }
        void operator()(int number) const { header.insert(name, Imf::IntAttribute(number)); }
        void operator()(double number) const { header.insert(name, Imf::DoubleAttribute(number)); }
        void operator()(const Imf::Rational& number) const {
            header.insert(name, Imf::RationalAttribute(number));
        }
    };
    for (const PictureAttribute& attribute : attributes)
        std::visit(Adder{header, attribute.name.c_str()}, attribute.value);
}

/// Adds the date from SOURCE_DATE_EPOCH (reproducible-builds.org/specs/source-date-epoch), if set.
/// With the current date, the files of repeated runs would differ.
void addDate(Imf::Header& header) {
    const char* variable = std::getenv("SOURCE_DATE_EPOCH");
    if (!variable || !*variable) return;
    char* end = nullptr;
    const auto seconds = static_cast<std::time_t>(std::strtoll(variable, &end, 10));
    std::tm utc{};
    std::array<char, 32> date{};
    if (*end != '\0' || !gmtime_r(&seconds, &utc) ||
        std::strftime(date.data(), date.size(), "%Y:%m:%d %H:%M:%S", &utc) == 0) {
        throw Error(ErrorKind::kUsage, "SOURCE_DATE_EPOCH is not a number of seconds", variable,
                    "unset it, or give seconds since 1970");
    }
    Imf::addCapDate(header, date.data());
    Imf::addUtcOffset(header, 0);
}

/// Returns a coordinate or a size, in pixels. Throws Error (kInput) above kMostCoordinate, so that
/// the sum of two fits into an int.
int pixelsIn(const nlohmann::json& value) {
    const auto pixels = value.get<double>();
    if (!(std::abs(pixels) <= kMostCoordinate))
        throw Error(ErrorKind::kInput, "the camera's picture has an implausible size",
                    "peeler:cameraJson");
    return static_cast<int>(pixels);
}

/// Returns the rays of a camera's lens. Throws Error (kInput) if the lens does not fit the picture.
std::shared_ptr<const PictureRays> lensRaysIn(const nlohmann::json& lens, const Size& size) {
    const LensCamera camera = lensOfJson(lens, "peeler:cameraJson");
    try {
        return lensPicture(camera, size);
    } catch (const Error& error) {
        throw Error(ErrorKind::kInput, error.whatText(), "peeler:cameraJson");
    }
}

/// Whether the header can describe the camera. It cannot describe moving cameras and lists of rays.
bool hasCamera(const View& view) {
    return view.known && (!view.rays || lensCameraOf(view));
}

std::string projectionName(const View& view) {
    if (view.rays) return std::string(view.rays->kind());
    return view.projection.perspective ? "perspective" : "orthographic";
}

}  // namespace

std::string PictureAttribute::text() const {
    struct Text {
        std::string operator()(const std::string& text) const { return text; }
        std::string operator()(int number) const { return std::to_string(number); }
        std::string operator()(double number) const { return numberText(number); }
        std::string operator()(const Imf::Rational& number) const {
            return std::to_string(number.n) + "/" + std::to_string(number.d);
        }
    };
    return std::visit(Text(), value);
}

std::vector<PictureAttribute> pictureAttributes(const Plan& plan, const Provenance& provenance,
                                                bool layers_known) {
    std::vector<PictureAttribute> attributes;
    const auto text = [&](const char* name, const std::string& value) {
        if (!value.empty()) attributes.push_back({name, value});
    };
    const auto number = [&](const char* name, int value) { attributes.push_back({name, value}); };
    text("software", "peeler " + provenance.version);
    text("peeler:version", provenance.version);
    text("peeler:method", provenance.method);
    text("peeler:surfaces", provenance.surfaces);
    text("peeler:scene", provenance.scene);
    text("peeler:sceneHash", provenance.scene_hash);
    text("peeler:settingsHash", provenance.settings_hash);
    text("peeler:settings", provenance.settings);
    text("peeler:outputHash", provenance.output_hash);
    text("peeler:renderer", provenance.renderer);
    text("peeler:deepMerge", provenance.deep_merge);
    text(kDeepCertificate, provenance.deep_certificate);
    text("peeler:tile", provenance.tile);
    text("peeler:elements", provenance.elements);
    if (plan.view.known) text("peeler:camera", plan.view.camera_name);
    if (plan.view.known || plan.view.rays) {
        text("peeler:depth", plan.view.rays ? "distance" : "camera z");
        text("peeler:projection", projectionName(plan.view));
    }
    if (const LensCamera* camera = lensCameraOf(plan.view)) text("peeler:lens", camera->lens.model);
    if (hasCamera(plan.view)) text("peeler:cameraJson", cameraJson(plan.view));
    if (layers_known) {
        text("peeler:fragmentsCounted", std::to_string(plan.fragments_counted));
        text("peeler:fragmentsStored", std::to_string(plan.fragments_stored));
        number("peeler:layers", static_cast<int>(plan.layers.size()));
        number("peeler:complete", plan.complete() ? 1 : 0);
    }
    if (plan.fragments_blended != 0)
        text("peeler:fragmentsBlended", std::to_string(plan.fragments_blended));
    if (plan.samples > 1) number("peeler:samples", plan.samples);
    number("peeler:frame", provenance.frame);
    if (provenance.view) number("peeler:view", *provenance.view);
    attributes.push_back({"peeler:time", provenance.time});
    if (provenance.frames_per_second > 0)
        attributes.push_back({"framesPerSecond", Imf::Rational(provenance.frames_per_second)});
    return attributes;
}

Imf::Header exrHeader(const Plan& plan, const Provenance& provenance, const Window& data_window,
                      bool layers_known) {
    const View& view = plan.view;
    Imf::Header header(
        Imath::Box2i({0, 0}, {view.width - 1, view.height - 1}),
        Imath::Box2i({data_window.x0, data_window.y0}, {data_window.x1 - 1, data_window.y1 - 1}),
        pixelAspectRatio(view), Imath::V2f(0, 0),
        view.known && !view.rays ? static_cast<float>(2 * view.projection.half_width) : 1,
        Imf::INCREASING_Y, Imf::ZIP_COMPRESSION);
    header.setType(Imf::SCANLINEIMAGE);
    Imf::addChromaticities(header, Imf::Chromaticities());  // the default is Rec. 709, D65
    addCarried(header, provenance.carried);
    if (hasCamera(view)) addCamera(header, view);
    addProvenance(header, pictureAttributes(plan, provenance, layers_known));
    addDate(header);
    return header;
}

std::string cameraJson(const View& view) {
    const Projection& projection = view.projection;
    nlohmann::json matrix = nlohmann::json::array();
    for (int row = 0; row < 4; ++row) {
        const glm::dmat4& m = view.camera_to_world;
        matrix.push_back({m[0][row], m[1][row], m[2][row], m[3][row]});
    }
    nlohmann::json json = {
        {"name", view.camera_name},
        {"projection", projectionName(view)},
        {"near", projection.near},
        {"far", projection.far},  // infinity becomes null in the JSON text
        {"width", view.width},
        {"height", view.height},
        {"crop", {view.crop.x0, view.crop.y0, view.crop.width(), view.crop.height()}},
        {"cameraToWorld", matrix},
    };
    if (const LensCamera* camera = lensCameraOf(view)) {
        json["lens"] = lensJson(*camera);
    } else {
        json["halfWidth"] = projection.half_width;
        json["halfHeight"] = projection.half_height;
    }
    if (view.sample != glm::dvec2(0.5)) json["sample"] = {view.sample.x, view.sample.y};
    return dumpJson(json);
}

View viewFromJson(const std::string& text) {
    try {
        const nlohmann::json json = parseJson(text, "peeler:cameraJson");
        View view;
        view.camera_name = json.at("name").get<std::string>();
        Projection& projection = view.projection;
        const auto name = json.at("projection").get<std::string>();
        const bool has_lens = name == "lens";
        projection.perspective = name == "perspective" || has_lens;
        projection.near = json.at("near").get<double>();
        const auto& far = json.at("far");
        projection.far =
            far.is_null() ? std::numeric_limits<double>::infinity() : far.get<double>();
        if (!has_lens) {
            projection.half_width = json.at("halfWidth").get<double>();
            projection.half_height = json.at("halfHeight").get<double>();
        }
        view.width = pixelsIn(json.at("width"));
        view.height = pixelsIn(json.at("height"));
        const nlohmann::json& crop = json.at("crop");
        const int left = pixelsIn(crop.at(0)), top = pixelsIn(crop.at(1));
        view.crop = {left, top, left + pixelsIn(crop.at(2)), top + pixelsIn(crop.at(3))};
        if (json.contains("sample")) {
            const auto sample = json.at("sample").get<std::array<double, 2>>();
            view.sample = {sample[0], sample[1]};
        }
        const auto rows = json.at("cameraToWorld").get<std::array<std::array<double, 4>, 4>>();
        for (int row = 0; row < 4; ++row) {
            for (int column = 0; column < 4; ++column) {
                view.camera_to_world[column][row] =
                    rows[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
            }
        }
        if (has_lens) view.rays = lensRaysIn(json.at("lens"), {view.width, view.height});
        return view;
    } catch (const nlohmann::json::exception& e) {
        throw Error(ErrorKind::kInput, "the camera is not readable: " + printable(e.what()),
                    "peeler:cameraJson");
    }
}

}  // namespace peeler
