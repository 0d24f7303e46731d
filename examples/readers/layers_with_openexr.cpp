// SPDX-License-Identifier: Apache-2.0
// Unprojects every layer to world space with OpenEXR 3 and a JSON header (nlohmann-json3-dev).
//   g++ -std=c++17 -O2 layers_with_openexr.cpp -o layers $(pkg-config --cflags --libs OpenEXR)
//   ./layers out.exr          # the numbers of `peeler info out.exr`
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfStringAttribute.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

int main(int count, char** arguments) {
    if (count != 2) return std::puts("usage: layers FILE.exr"), 2;
    Imf::MultiPartInputFile file(arguments[1]);
    const Imf::Header& first = file.header(0);
    const auto text = first.typedAttribute<Imf::StringAttribute>("peeler:cameraJson").value();
    const auto camera = nlohmann::json::parse(text);
    const double width = camera["width"], height = camera["height"];
    const double half_width = camera["halfWidth"], half_height = camera["halfHeight"];
    const std::vector<std::vector<double>> m = camera["cameraToWorld"];  // list of matrix rows
    const bool perspective = camera["projection"] == "perspective";
    double points = 0, sum[3] = {};
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int part = 0; part < file.parts(); ++part) {
        if (file.header(part).name().rfind("layer_", 0) != 0) continue;
        const Imath::Box2i box = file.header(part).dataWindow();
        std::vector<float> depth((box.size().x + 1) * std::size_t(box.size().y + 1));
        Imf::FrameBuffer buffer;
        buffer.insert("Z", Imf::Slice::Make(Imf::FLOAT, depth.data(), box));
        Imf::InputPart input(file, part);
        input.setFrameBuffer(buffer);
        input.readPixels(box.min.y, box.max.y);
        const float* pixel = depth.data();
        for (int y = box.min.y; y <= box.max.y; ++y) {
            for (int x = box.min.x; x <= box.max.x; ++x, ++pixel) {
                if (!(*pixel < INFINITY)) continue;  // no fragment of this layer
                const double z = *pixel, scale = perspective ? z : 1;
                const double right = half_width * (2 * (x + 0.5) / width - 1) * scale;
                const double up = half_height * (1 - 2 * (y + 0.5) / height) * scale;
                for (int c = 0; c < 3; ++c) {
                    const double p = m[c][0] * right + m[c][1] * up - m[c][2] * z + m[c][3];
                    low[c] = std::min(low[c], p), high[c] = std::max(high[c], p), sum[c] += p;
                }
                ++points;
            }
        }
    }
    if (points == 0) return std::puts("points: 0"), 0;
    const double tiny = 1e-9 * std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
    const auto print = [&](const double* p, double n, const char* text) {
        const auto v = [&](int c) { return std::abs(p[c] / n) <= tiny ? 0 : p[c] / n; };
        std::printf("(%.6g, %.6g, %.6g)%s", v(0), v(1), v(2),
                    text);  // rounding errors around 0 become 0
    };
    std::printf("points: %.0f\nbounds: ", points);
    print(low, 1, " to "), print(high, 1, "\nmean: "), print(sum, points, "\n");
}
