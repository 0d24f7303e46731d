// SPDX-License-Identifier: Apache-2.0
// Writes layered depth images, a part of an OpenEXR file for each layer; their composite alone; and
// deep images, every fragment of a pixel a sample of a deep scan line.
#pragma once

#include <OpenEXR/ImfCompression.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <peeler/deep_merge.h>
#include <peeler/output_options.h>
#include <peeler/sink.h>
#include "formats/exr/exr_band_writer.h"
#include "formats/exr/exr_chunks.h"
#include "formats/exr/exr_layout.h"

namespace peeler {

/// What ExrLdiWriter and ExrCompositeWriter share: parts that bands are streamed into.
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
    std::unique_ptr<ExrBandWriter> writer_;  ///< from begin() to finish()

  private:
    StageTimes times_;
};

/// Writes part `composite` (R,G,B,A as `Plan::color_type`, Z of the first fragment; compositeOver()
/// of the stored colours on nothing) and parts `layer_000`, `layer_001`, … front to back, each
/// cropped to its layer's data window: R,G,B,A, Z and the extra channels of the bands. A picture
/// without any fragment has the part `composite` alone, whatever the options say: a file must have
/// a part. `peeler:layout` names the layout; in the layout "per-file" the composite's file is
/// needed, since it is the one that names the set. The same plan, provenance and pixels make the
/// same bytes, however cut into bands.
class ExrLdiWriter : public ExrPartsSink {
  public:
    /// Throws Error (kUsage) if there is no such compression.
    explicit ExrLdiWriter(std::string path, OutputOptions options = {});

    /// Throws Error (kOutput) if the file cannot be created.
    void begin(const Plan& plan) override;
    /// Throws Error (kInternal) if the bands had other fragments than the plan says.
    void finish() override;

  private:
    std::vector<ExrPart> partsOf(const Plan& plan) const override;

    std::uint64_t fragments_planned_ = 0;
};

/// Writes a single-part file: R,G,B,A as `Plan::color_type`, Z (float, +inf where nothing is) and
/// the other channels of the first fragment; dataWindow = crop, with the attributes of a layered
/// file but `peeler:layer`. Compressed ZIP.
class ExrCompositeWriter : public ExrPartsSink {
  public:
    explicit ExrCompositeWriter(std::string path, OutputOptions options = {});

    /// Throws Error (kOutput) if the file cannot be created.
    void begin(const Plan& plan) override;

  private:
    std::vector<ExrPart> partsOf(const Plan& plan) const override;
};

/// Writes part `color` (R,G,B,A as they are captured, Z float; AR, AG, AB and ZBack, if there are
/// any) and, if there are other channels, a second part of these and Z again, both deep scan lines:
/// a reader that composites every channel of a part (OpenImageIO's flatten) meets neither normals
/// nor ids. The second part is called `ids` if it has integers, else `aovs`.
/// Point samples, without ZBack, in list order: front to back. dataWindow is the bounding box of
/// all fragments, the crop if there is none.
///
/// `deepImageState` is TIDY if no two samples of any pixel have the same Z, else SORTED; MESSY for
/// what came from a file with ZBack. If samples were merged, `peeler:deepMerge` says how, and
/// `peeler:fragmentsStored`, `peeler:layers` and `peeler:complete` speak of what is left; the first
/// of them may begin with zeros. The same plan, provenance and pixels make the same bytes, however
/// cut into bands.
class ExrDeepWriter : public Sink {
  public:
    /// Throws Error (kUsage) if deep images cannot have such a compression.
    explicit ExrDeepWriter(std::string path, OutputOptions options = {});
    ~ExrDeepWriter() override;

    /// Throws Error (kOutput) if the file cannot be created.
    void begin(const Plan& plan) override;
    void write(LayeredImage&& band) override;
    /// Throws Error (kInternal) if the bands had other fragments than the plan says.
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
    std::unique_ptr<ExrOutput> exr_;  ///< from the first band on: it says which channels there are
    LayeredImage like_;               ///< without pixels: the arrays of every band
    LayeredImage merged_;
    int next_row_ = 0;
    std::uint64_t fragments_seen_ = 0, fragments_written_ = 0;
    std::uint32_t most_samples_ = 0;  ///< in one pixel
    bool coincident_ = false;         ///< two samples of a pixel have the same Z
    std::vector<ExrDeepChunk> packed_;
    ExrPackerPool packers_{kDefaultZipLevel, compression_};
    StageTimes times_;
};

}  // namespace peeler
