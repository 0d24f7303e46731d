// SPDX-License-Identifier: Apache-2.0
// OpenEXR band writer: streams bands of any height into the chunks of all parts.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <peeler/composite.h>
#include <peeler/output_options.h>
#include <peeler/sink.h>
#include "formats/exr/cryptomatte.h"
#include "formats/exr/exr_chunks.h"
#include "formats/file/atomic_file.h"

namespace peeler {

/// The content of one part of a file.
struct ExrPart {
    static constexpr int kComposite = -1;
    std::string name;
    Window window;
    /// The layers in this part: indices into the fragment list of every pixel, or kComposite.
    std::vector<int> layers = {kComposite};
    bool prefixed = false;  ///< whether channels of layers have names like layer_000.R
    std::size_t file = 0;   ///< index, in the writer, of the file that holds the part
    /// The layer's fragment count for the header if the part has a file of its own; otherwise 0.
    std::uint64_t fragments = 0;
    /// Whether the composite also stores the nearest fragment's channels other than colour and Z.
    bool nearest_channels = false;
};

/// A channel of a part, and the source of its values.
struct ExrChannel {
    enum Source : int { kCompositeColor = -4, kCompositeZ = -3, kZ = -2, kColor = -1 };
    std::string name;
    PixelType type = PixelType::kHalf;
    int source = kColor;  ///< a value of Source, or the index of an extra array
    std::size_t component = 0, components = 1;
    int layer = ExrPart::kComposite;  ///< a value in ExrPart::layers
};

/// A writer that streams bands into the parts of one or several files. Uses the options
/// `background` (behind the composite), `cryptomatte` (adds Cryptomatte coverage to the composite;
/// needs the channels id.*), `composited` (bands are composites already, with one entry per pixel,
/// and keep their channels), `compression` and `layout` (stored in `peeler:layout` unless empty).
///
/// The files' bytes do not depend on the division of the picture into bands, nor on the number of
/// threads. Between bands, the writer keeps the rows that unfinished chunks need, at most 15. Where
/// a pixel lacks a layer, Z is +inf and every other channel is 0.
class ExrBandWriter {
  public:
    /// Creates the hidden files. Throws Error (kOutput).
    ExrBandWriter(const std::vector<std::string>& paths, std::vector<ExrPart> parts, Plan plan,
                  OutputOptions options);
    ~ExrBandWriter();

    /// Writes the chunks that the band completes. Throws Error (kOutput) if writing fails, Error
    /// (kInternal) if the band does not follow the previous band or is malformed.
    void write(const LayeredImage& band);
    /// Finishes the files. Publishes no file before all are complete. Throws Error (kOutput) if
    /// writing fails, Error (kInternal) if rows are missing.
    void finish();

    /// Returns the memory for the kept rows, and for chunks that are being packed or wait to be
    /// written.
    static SinkMemory memory(std::span<const ExrPart> parts, const Plan& plan,
                             const OutputOptions& options);
    const StageTimes& times() const { return times_; }
    std::uint64_t fragmentsSeen() const { return fragments_seen_; }
    std::uint64_t fragmentsWritten() const { return fragments_written_; }

  private:
    struct Job {
        std::size_t part;
        int chunk;
        int y0, y1;  ///< range [y0, y1) of rows
    };

    void open(const LayeredImage& first_band);
    void findChannels(const LayeredImage& first_band);
    Imf::Header header(std::size_t part) const;
    int rowsPerChunk() const { return exrRowsPerChunk(compression_); }
    bool nearestChannels() const;
    void check(const LayeredImage& band) const;
    void composite(const LayeredImage& image, int y, CompositeImage& out) const;
    std::vector<Job> finishedChunks(int end_row);
    void run(std::span<const Job> jobs, const LayeredImage& band);
    void boundBuffers();
    void encode(std::span<const Job> jobs, const LayeredImage& band);
    std::size_t rawBytes(const Job& job) const;
    std::uint64_t gather(const Job& job, const LayeredImage& band, ExrChunkPacker& packer) const;
    void carry(const LayeredImage& band);

    Plan plan_;
    OutputOptions options_;
    Imf::Compression compression_;
    std::vector<ExrPart> parts_;
    std::vector<CryptomatteLayer> cryptomatte_;
    std::vector<std::unique_ptr<AtomicFile>> files_;
    /// One container per file. The containers are created with the first band, which defines the
    /// channels.
    std::vector<std::unique_ptr<ExrOutput>> exr_;
    std::vector<std::size_t> place_;                 ///< index of each part within its file
    std::vector<std::vector<ExrChannel>> channels_;  ///< channels of each part
    /// For each part: the number of chunks, and the next chunk to write.
    std::vector<int> chunks_, next_chunk_;
    int next_row_ = 0;
    LayeredImage carried_;
    std::vector<ByteBuffer> packed_;  ///< packed chunks that are not yet written
    ExrPackerPool packers_{kDefaultZipLevel, compression_};
    std::uint64_t fragments_seen_ = 0, fragments_written_ = 0;
    StageTimes times_;
};

}  // namespace peeler
