// SPDX-License-Identifier: Apache-2.0
// Flat OpenEXR images of numbers: one or several a pixel, in one part or several; midpoints and
// counts of fragments as such images.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <peeler/output_options.h>
#include <peeler/sink.h>
#include "formats/file/size_forecast.h"

namespace peeler {

/// A part of a file of numbers. Its dataWindow is the crop.
struct ExrPlanePart {
    std::string name;
    Plan plan;
    /// The plan tells the layers of the picture that the numbers come from, and not its view alone.
    bool layers_known = true;
};

struct ExrPlaneChannel {
    std::string name;
    PixelType type = PixelType::kFloat;  ///< or kUint
};

/// Streams rows into a file whose parts all have the same channels, with the attributes of a
/// layered file but `peeler:layer`.
class ExrPlaneWriter {
  public:
    /// Creates the hidden file. Display windows must be of one size. Throws Error (kOutput).
    ExrPlaneWriter(const std::string& path, std::span<const ExrPlanePart> parts,
                   const Provenance& provenance, std::vector<ExrPlaneChannel> channels);
    /// A file of one part with one channel.
    ExrPlaneWriter(const std::string& path, const Plan& plan, const Provenance& provenance,
                   const std::string& part, const std::string& channel, PixelType type);
    ~ExrPlaneWriter();

    /// The next rows of the part at hand, top to bottom, 4 bytes a number: those rows of the first
    /// channel, then of the second, and so on. A part that is full is followed by the next one.
    void append(std::span<const std::byte> planes);
    /// Throws Error (kInternal) if rows are missing.
    void finish();

    /// Bytes that it keeps of rows of so many pixels, each with so many channels, besides what
    /// append() gets.
    static std::uint64_t memory(int width, std::size_t channels);
    const StageTimes& times() const { return times_; }

  private:
    struct File;
    struct Part {
        std::size_t width, height;
    };
    std::size_t rowBytes() const;
    void writeChunks(bool last);
    void nextPart();

    std::unique_ptr<File> file_;
    std::vector<Part> parts_;
    std::vector<std::size_t> order_;  ///< of the channels in the file, as indices of ours
    std::size_t part_ = 0;            ///< the one at hand
    std::size_t rows_seen_ = 0;       ///< of that part
    std::vector<std::byte> rows_;     ///< of chunks that are not complete yet, as in the file
    int next_chunk_ = 0;
    StageTimes times_;
};

/// Writes a single-part file with one channel, Z (float): camera Z of the midpoint between the two
/// nearest surfaces as core/image/statistics.h has it, +inf where a pixel has no second surface: a
/// midpoint shadow map. dataWindow = crop, with the attributes of a layered file but
/// `peeler:layer`. What counts as a surface is the capture's choice (CaptureSettings::opaque_only).
class ExrMidpointWriter : public Sink {
  public:
    explicit ExrMidpointWriter(std::string path, OutputOptions options = {});

    /// Throws Error (kOutput) if the file cannot be created.
    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    /// Throws Error (kInternal) if rows are missing.
    void finish() override;
    SinkMemory memory(const Plan& plan) const override;
    StageTimes times() const override;

  private:
    std::string path_;
    OutputOptions options_;
    Projection projection_;
    std::unique_ptr<ExrPlaneWriter> plane_;
    std::vector<float> midpoints_;  ///< of a band
    StageTimes times_;
};

/// Writes the number of fragments of every pixel. EXR: a channel `count` (uint); PNG, JPEG, TIFF:
/// black (0) to yellow (as many as the plan has layers).
class CountMap : public Sink {
  public:
    CountMap(std::string path, OutputOptions options);

    /// How large its file will be.
    SizeForecast forecast(const Plan& plan) const;
    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    SinkMemory memory(const Plan& plan) const override;
    StageTimes times() const override;

    std::uint32_t largest() const { return largest_; }  ///< so far

  private:
    std::string path_;
    OutputOptions options_;
    std::unique_ptr<ExrPlaneWriter> plane_;  ///< else picture_
    std::unique_ptr<Sink> picture_;
    float ramp_end_ = 1;
    std::uint32_t largest_ = 0;
    std::vector<std::uint32_t> counts_;
    LayeredImage colors_;
};

}  // namespace peeler
