// SPDX-License-Identifier: Apache-2.0
// Renders every layer of a scene into memory, to the program's own sink, and to a file:
//     layers SCENE [COUNTS.pgm [LAYERS.exr]]
#include <peeler/error.h>
#include <peeler/files.h>
#include <peeler/renderer.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

/// A sink that makes a PGM image of the number of layers in every pixel. Bands arrive from top to
/// bottom.
class CountPicture final : public peeler::Sink {
  public:
    explicit CountPicture(std::string path) : path_(std::move(path)) {}

    void begin(const peeler::Plan& plan) override {
        width_ = plan.view.crop.width();
        height_ = plan.view.crop.height();
        most_ = std::max<std::size_t>(1, plan.layers.size());
    }
    void write(peeler::LayeredImage&& band) override {
        for (std::size_t pixel = 0; pixel + 1 < band.offsets.size(); ++pixel)
            counts_.push_back(static_cast<char>(255 * band.count(pixel) / most_));
    }
    void finish() override {
        std::ofstream file(path_, std::ios::binary);
        file << "P5 " << width_ << " " << height_ << " 255\n";
        file.write(counts_.data(), static_cast<std::streamsize>(counts_.size()));
    }

  private:
    std::string path_;
    int width_ = 0, height_ = 0;
    std::size_t most_ = 1;
    std::vector<char> counts_;
};

int main(int count, char** arguments) try {
    if (count < 2) return 2;
    const peeler::Shown shown{peeler::readScene(arguments[1])};
    peeler::CameraChoice camera;
    camera.size = {320, 180};
    const peeler::View view = peeler::viewOf(shown, camera);

    peeler::Renderer renderer;
    const peeler::LayeredImage image = renderer.layers(shown, view);
    std::printf("%s: %zu fragments of %zu pixels, rendered by %s\n", arguments[1],
                image.fragments(), image.offsets.size() - 1, renderer.device().c_str());
    if (count > 2) {
        CountPicture picture(arguments[2]);
        renderer.capture(shown, view, {}, picture);
    }
    if (count > 3) renderer.capture(shown, view, {}, *peeler::openFile(arguments[3]));
    return 0;
} catch (const peeler::Error& error) {
    std::fprintf(stderr, "%s (%s) %s\n", error.what(), error.where().c_str(), error.hint().c_str());
    return static_cast<int>(error.kind());
}
