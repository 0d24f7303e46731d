// SPDX-License-Identifier: Apache-2.0
// OpenEXR band writer: streams bands of any height into the chunks of every part.
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
    /// Its layers: indices into the fragment list of every pixel, or kComposite.
    std::vector<int> layers = {kComposite};
    bool prefixed = false;  ///< a layer's channels are layer_000.R, …
    std::size_t file = 0;   ///< the index of its file in the writer
    /// The layer's fragment count, for the header of a file that a reader may open alone; 0 = not
    /// stored.
    std::uint64_t fragments = 0;
    bool nearest_channels = false;  ///< the composite has the first fragment's other channels
};

/// The source of a part's channel.
struct ExrChannel {
    enum Source : int { kCompositeColor = -4, kCompositeZ = -3, kZ = -2, kColor = -1 };
    std::string name;
    PixelType type = PixelType::kHalf;
    int source = kColor;  ///< a Source, or the index among the extra arrays
    std::size_t component = 0, components = 1;
    int layer = ExrPart::kComposite;  ///< one of ExrPart::layers
};

/// A writer that streams bands into the parts of one file or several. It uses these options: the
/// background behind the composite; whether the composite has Cryptomatte coverage (cryptomatte),
/// which needs the channels id.*; whether bands are already composites, one entry per pixel, whose
/// channels are kept (composited); compression; and the layout as stored in `peeler:layout`, "" =
/// none. The file's bytes do not depend on how the picture is cut into bands or on the number of
/// threads. Between bands it keeps the rows needed by unfinished chunks, at most 15. A pixel
/// without the layer is 0 in every channel but Z, which is +inf.
class ExrBandWriter {
  public:
    /// Creates the hidden files. Throws Error (kOutput).
    ExrBandWriter(const std::vector<std::string>& paths, std::vector<ExrPart> parts, Plan plan,
                  OutputOptions options);
    ~ExrBandWriter();

    /// Writes the chunks completed by the band. Throws Error (kOutput); (kInternal) if the band is
    /// not the next one, or is malformed.
    void write(const LayeredImage& band);
    /// Finishes the files; several get their final names only when all are complete. Throws Error
    /// (kOutput); (kInternal) if rows are missing.
    void finish();

    /// Returns the memory for the rows it keeps, and for chunks being packed or waiting to be
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
    /// One container per file, from the first band on, when the channels are known.
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
