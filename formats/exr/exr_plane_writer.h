// SPDX-License-Identifier: Apache-2.0
// Writers of flat OpenEXR data images, with one or several values per pixel, in one or several
// parts. Midpoint shadow maps and fragment counts are such images.
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

/// A part of a data image. dataWindow is the crop of the plan.
struct ExrPlanePart {
    std::string name;
    Plan plan;
    /// Whether the plan has the source picture's layers and fragment counts, or only its view.
    bool layers_known = true;
};

struct ExrPlaneChannel {
    std::string name;
    PixelType type = PixelType::kFloat;  ///< kFloat or kUint
};

/// A writer that streams rows into a file. All parts have the same channels. The file has the
/// attributes of a layered file except `peeler:layer`.
class ExrPlaneWriter {
  public:
    /// Creates the hidden file. The display windows of all parts must have the same size. Throws
    /// Error (kOutput).
    ExrPlaneWriter(const std::string& path, std::span<const ExrPlanePart> parts,
                   const Provenance& provenance, std::vector<ExrPlaneChannel> channels);
    /// Creates a file of one part with one channel.
    ExrPlaneWriter(const std::string& path, const Plan& plan, const Provenance& provenance,
                   const std::string& part, const std::string& channel, PixelType type);
    ~ExrPlaneWriter();

    /// Appends the next rows of the current part, top to bottom, with 4 bytes per value: the rows
    /// of the first channel, then the rows of the second channel, and so on. When a part is
    /// complete, the next part begins.
    void append(std::span<const std::byte> planes);
    /// Finishes the file. Throws Error (kInternal) if rows are missing.
    void finish();

    /// Returns the bytes that the writer holds for rows of this width with this number of channels,
    /// without the argument of append().
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
    std::vector<std::size_t> order_;  ///< indices of append()'s channels in file order
    std::size_t part_ = 0;            ///< index of the current part
    std::size_t rows_seen_ = 0;       ///< number of rows received of the current part
    std::vector<std::byte> rows_;     ///< rows of incomplete chunks, in file order
    int next_chunk_ = 0;
    StageTimes times_;
};

/// A writer of midpoint shadow maps: a single-part file with one channel, Z (float). Z is the
/// camera Z of the midpoint between the two nearest surfaces (core/image/statistics.h), or +inf
/// where a pixel has no second surface. dataWindow is the crop. The attributes are those of a
/// layered file except `peeler:layer`. CaptureSettings::opaque_only restricts the surfaces to
/// opaque ones.
class ExrMidpointWriter : public Sink {
  public:
    explicit ExrMidpointWriter(std::string path, OutputOptions options = {});

    /// Throws Error (kOutput) if the file cannot be created.
    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    /// Finishes the file. Throws Error (kInternal) if rows are missing.
    void finish() override;
    SinkMemory memory(const Plan& plan) const override;
    StageTimes times() const override;

  private:
    std::string path_;
    OutputOptions options_;
    Projection projection_;
    std::unique_ptr<ExrPlaneWriter> plane_;
    std::vector<float> midpoints_;
    StageTimes times_;
};

/// A writer of the number of fragments per pixel. An EXR stores the number in a channel `count`
/// (uint). A PNG, JPEG or TIFF shows it as a colour from black (0) to yellow (the plan's number of
/// layers).
class CountMap : public Sink {
  public:
    CountMap(std::string path, OutputOptions options);

    SizeForecast forecast(const Plan& plan) const;
    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    void finish() override;
    SinkMemory memory(const Plan& plan) const override;
    StageTimes times() const override;

    std::uint32_t largest() const { return largest_; }

  private:
    std::string path_;
    OutputOptions options_;
    /// Null if the output is PNG, JPEG or TIFF, which picture_ writes.
    std::unique_ptr<ExrPlaneWriter> plane_;
    std::unique_ptr<Sink> picture_;
    float ramp_end_ = 1;
    std::uint32_t largest_ = 0;
    std::vector<std::uint32_t> counts_;
    LayeredImage colors_;
};

}  // namespace peeler
