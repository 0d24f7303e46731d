// SPDX-License-Identifier: Apache-2.0
// Streams bands of any height into the chunks of every part of an OpenEXR file.
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

/// What one part of a file shows.
struct ExrPart {
    static constexpr int kComposite = -1;
    std::string name;
    Window window;
    /// The layers that it shows: indices into the list of fragments of every pixel, or kComposite.
    std::vector<int> layers = {kComposite};
    bool prefixed = false;  ///< a layer's channels are layer_000.R, …
    std::size_t file = 0;   ///< which of the writer's files it is in
    /// Fragments of the layer, if its header is to say them for a reader that opens this file
    /// alone; 0 = it is not.
    std::uint64_t fragments = 0;
    bool nearest_channels = false;  ///< the composite has the other channels of the first fragment
};

/// Where a channel of a part comes from.
struct ExrChannel {
    enum Source : int { kCompositeColor = -4, kCompositeZ = -3, kZ = -2, kColor = -1 };
    std::string name;
    PixelType type = PixelType::kHalf;
    int source = kColor;  ///< a Source, or the index among the extra arrays
    std::size_t component = 0, components = 1;
    int layer = ExrPart::kComposite;  ///< one of ExrPart::layers: whose fragments
};

/// Streams bands into the parts of one file or several. Of the options it takes the background
/// behind the composite; whether the composite has the coverage of ids (cryptomatte), which needs
/// the channels id.*; whether bands are a composite already, one entry a pixel, whose channels stay
/// (composited); compression; and the layout as it stands in `peeler:layout`, "" = none. The bytes
/// of the file do not depend on how the picture is cut into bands or on the number of threads.
/// Between bands it keeps the rows that unfinished chunks still need, at most 15. A pixel without
/// the layer is 0 in every channel but Z, which is +inf.
class ExrBandWriter {
  public:
    /// Creates the hidden files. Throws Error (kOutput).
    ExrBandWriter(const std::vector<std::string>& paths, std::vector<ExrPart> parts, Plan plan,
                  OutputOptions options);
    ~ExrBandWriter();

    /// Writes the chunks that the band completes. Throws Error (kOutput); (kInternal) if the band
    /// is not the next one, or is malformed.
    void write(const LayeredImage& band);
    /// Finishes the files; several get their final names only when all of them are whole. Throws
    /// Error (kOutput); (kInternal) if rows are missing.
    void finish();

    /// The rows that it would keep, and what chunks take while they are packed and wait to be
    /// written.
    static SinkMemory memory(std::span<const ExrPart> parts, const Plan& plan,
                             const OutputOptions& options);
    const StageTimes& times() const { return times_; }
    std::uint64_t fragmentsSeen() const { return fragments_seen_; }        ///< in all bands
    std::uint64_t fragmentsWritten() const { return fragments_written_; }  ///< into parts of layers

  private:
    struct Job {
        std::size_t part;
        int chunk;
        int y0, y1;  ///< rows, half open
    };

    void open(const LayeredImage& first_band);
    void findChannels(const LayeredImage& first_band);
    Imf::Header header(std::size_t part) const;
    int rowsPerChunk() const { return exrRowsPerChunk(compression_); }
    bool nearestChannels() const;
    void check(const LayeredImage& band) const;
    void composite(const LayeredImage& image, CompositeImage& out) const;
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
    /// A container for each file, from the first band on, which says what channels there are.
    std::vector<std::unique_ptr<ExrOutput>> exr_;
    std::vector<std::size_t> place_;                 ///< of each part in its file
    std::vector<std::vector<ExrChannel>> channels_;  ///< of each part
    bool composite_ = false;                         ///< a part shows the composite
    std::vector<int> chunks_, next_chunk_;           ///< of each part
    int next_row_ = 0;
    LayeredImage carried_;
    CompositeImage carried_composite_, band_composite_;
    std::vector<ByteBuffer> packed_;  ///< of the chunks in flight
    ExrPackerPool packers_{kDefaultZipLevel, compression_};
    std::uint64_t fragments_seen_ = 0, fragments_written_ = 0;
    StageTimes times_;
};

}  // namespace peeler
