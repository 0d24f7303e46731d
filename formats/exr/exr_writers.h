// SPDX-License-Identifier: Apache-2.0
// OpenEXR writers of layered depth images (one part per layer), of composites alone, and of deep
// images (one deep sample per fragment).
#pragma once

#include <OpenEXR/ImfCompression.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <peeler/deep_merge.h>
#include <peeler/output_options.h>
#include <peeler/sink.h>
#include "core/image/deep_thinning.h"
#include "formats/exr/deep_certificate.h"
#include "formats/exr/exr_band_writer.h"
#include "formats/exr/exr_chunks.h"
#include "formats/exr/exr_layout.h"

namespace peeler {

/// The base of ExrLdiWriter and ExrCompositeWriter: a sink that streams bands into parts.
class ExrPartsSink : public Sink {
  public:
    ~ExrPartsSink() override;
    void write(LayeredImage&& band) override;
    void finish() override;
    SinkMemory memory(const Plan& plan) const override;
    StageTimes times() const override { return times_; }

  protected:
    ExrPartsSink(std::string path, OutputOptions options);
    virtual std::vector<ExrPart> partsOf(const Plan& plan) const = 0;

    std::string path_;
    OutputOptions options_;
    std::unique_ptr<ExrBandWriter> writer_;  ///< exists from begin() to finish()

  private:
    StageTimes times_;
};

/// A writer of layered depth images. The part `composite` has R,G,B,A as `Plan::color_type`
/// (compositeOver() of the stored colours, without a background) and Z of the first fragment. The
/// parts `layer_000`, `layer_001`, … follow, front to back, each cropped to its layer's data
/// window: R,G,B,A, Z and the extra channels of the bands. A picture without any fragment has only
/// the part `composite`, even if the options leave it out, since a file must have a part.
///
/// `peeler:layout` names the layout. The layout "per-file" requires a composite, because the
/// composite's file is the head of the set. The same plan, provenance and pixels produce the same
/// bytes, whatever the sizes of the bands.
class ExrLdiWriter : public ExrPartsSink {
  public:
    /// Throws Error (kUsage) if the compression is unknown.
    explicit ExrLdiWriter(std::string path, OutputOptions options = {});

    /// Throws Error (kOutput) if the file cannot be created.
    void begin(const Plan& plan) override;
    /// Throws Error (kInternal) if the bands' fragments do not match the plan.
    void finish() override;

  private:
    std::vector<ExrPart> partsOf(const Plan& plan) const override;

    std::uint64_t fragments_planned_ = 0;
};

/// A writer of single-part composites: R,G,B,A as `Plan::color_type`, Z (float, +inf where empty)
/// and the other channels of the first fragment. dataWindow is the crop. The attributes are those
/// of a layered file except `peeler:layer`. Compression: ZIP.
class ExrCompositeWriter : public ExrPartsSink {
  public:
    explicit ExrCompositeWriter(std::string path, OutputOptions options = {});

    /// Throws Error (kOutput) if the file cannot be created.
    void begin(const Plan& plan) override;

  private:
    std::vector<ExrPart> partsOf(const Plan& plan) const override;
};

/// A writer of deep images in deep scan lines. A part `color` has R,G,B,A as captured, Z (float)
/// and, if captured, AR, AG, AB and ZBack. A second part has the other channels, if any, and Z
/// again; it is called `ids` if it has integers, else `aovs`. It keeps normals and ids away from
/// readers that composite every channel of a part (OpenImageIO's flatten). Samples are points,
/// without ZBack, from front to back. dataWindow is the bounding box of all fragments, or the crop
/// if the picture is empty.
///
/// `deepImageState` is MESSY if the input file has ZBack, else TIDY if no two samples of any pixel
/// have the same Z, else SORTED. If samples were merged, `peeler:deepMerge` names the method, and
/// `peeler:fragmentsStored`, `peeler:layers` and `peeler:complete` describe the merged samples;
/// `peeler:fragmentsStored` may then begin with zeros. If they were thinned
/// (DeepMergeSettings::error), `peeler:deepCertificate` has the bound, the largest error and the
/// hash of the original. The same plan, provenance and pixels produce the same bytes, whatever the
/// sizes of the bands.
class ExrDeepWriter : public Sink {
  public:
    /// Throws Error (kUsage) if deep images cannot have this compression.
    explicit ExrDeepWriter(std::string path, OutputOptions options = {});
    ~ExrDeepWriter() override;

    /// Throws Error (kOutput) if the file cannot be created.
    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    /// Throws Error (kInternal) if the bands' fragments do not match the plan.
    void finish() override;
    SinkMemory memory(const Plan& plan) const override;
    StageTimes times() const override { return times_; }

  private:
    struct Part {
        const char* name;
        std::vector<ExrChannel> channels;  ///< sorted by name
    };

    void open(const LayeredImage& first_band);
    void check(const LayeredImage& band) const;
    const LayeredImage& merged(const LayeredImage& band, int y0, int y1);
    std::string certificate() const;
    int rowsInFlight(const LayeredImage& band, int y) const;
    void writeRows(const LayeredImage& image, int y0, int y1);
    void noteSamples(const LayeredImage& image, int y0, int y1);
    void encode(const LayeredImage& image, int y0, std::size_t chunks);
    void boundBuffers();
    void describeSamples();

    std::string path_;
    OutputOptions options_;
    Imf::Compression compression_;
    Plan plan_;
    Window window_;
    std::vector<Part> parts_;
    std::unique_ptr<AtomicFile> file_;
    /// Created with the first band, which defines the channels.
    std::unique_ptr<ExrOutput> exr_;
    LayeredImage like_;  ///< the arrays of every band, without pixels
    LayeredImage merged_;
    DeepSourceHash source_hash_;
    DeepThinning thinning_;
    int next_row_ = 0;
    std::uint64_t fragments_seen_ = 0, fragments_written_ = 0;
    std::uint32_t most_samples_ = 0;  ///< maximum number of samples in one pixel
    bool coincident_ = false;         ///< whether two samples of any pixel have the same Z
    std::vector<ExrDeepChunk> packed_;
    ExrPackerPool packers_{kDefaultZipLevel, compression_};
    StageTimes times_;
};

}  // namespace peeler
