// SPDX-License-Identifier: Apache-2.0
// What extract makes of the fragments of a picture, besides its layers as they are.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/image/sink.h"
#include "formats/arrays/npz_writer.h"
#include "formats/arrays/ply_writer.h"
#include "formats/exr/exr_plane_writer.h"
#include "formats/writers.h"

namespace peeler::cmd {

/// The number of fragments of every pixel. EXR: a channel `count` (uint); PNG, JPEG, TIFF: black
/// (0) to yellow (as many as the plan has layers).
class CountMap : public Sink {
  public:
    CountMap(std::string path, OutputOptions output);

    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    StageTimes times() const override;

    std::uint32_t largest() const { return largest_; }

  private:
    std::string path_;
    OutputOptions output_;
    std::unique_ptr<ExrPlaneWriter> plane_;  ///< one of the two
    std::unique_ptr<Sink> picture_;
    float ramp_end_ = 1;
    std::uint32_t largest_ = 0;
    std::vector<std::uint32_t> counts_;
    LayeredImage colors_;
};

struct PointCloudOptions {
    bool double_positions = false;
    std::string comment;
};

/// Every fragment as a point in world space: x y z, nx ny nz from the channels N, else Ng, if there
/// are any, red green blue alpha, and one uint for every uint channel, a '.' in its name replaced
/// by '_'.
class PointCloud : public Sink {
  public:
    PointCloud(std::string path, PointCloudOptions options);

    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;

  private:
    void open(const LayeredImage& band);

    std::string path_;
    PointCloudOptions options_;
    View view_;
    std::vector<std::string> normal_, numbers_;  ///< names of channels
    std::optional<PlyWriter> writer_;            ///< from the first band on
    std::vector<std::byte> points_;
};

/// Every fragment in arrays for numpy; the help of the verb lists them. The plan's
/// `fragments_stored` must be the number of fragments that will come. A camera that is not known is
/// NaN.
class FragmentArrays : public Sink {
  public:
    FragmentArrays(std::string path, bool camera_known)
        : path_(std::move(path)), camera_known_(camera_known) {}

    void begin(const Plan& plan) override { plan_ = plan; }
    void write(LayeredImage&& band) override;
    void finish() override;

  private:
    void open(const LayeredImage& band);
    void writeCamera();

    std::string path_;
    bool camera_known_;
    Plan plan_;
    std::vector<std::string> channels_;  ///< of `extra`, as in the file
    std::optional<NpzWriter> writer_;    ///< from the first band on
    std::int64_t fragments_ = 0;         ///< so far
    std::vector<std::int64_t> splits_;
    std::vector<std::byte> values_;
};

}  // namespace peeler::cmd
