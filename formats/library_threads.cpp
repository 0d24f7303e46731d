// SPDX-License-Identifier: Apache-2.0
#include "formats/library_threads.h"

#include <OpenImageIO/imageio.h>
#include <tbb/global_control.h>

#include <cstdlib>
#include <optional>
#include <string>

namespace peeler {

void setLibraryThreads(int threads) {
    // Its pool is made on the first use with as many as CUE_THREADS says, be that a number or not;
    // its own variable comes before that.
    setenv("OPENIMAGEIO_THREADS", std::to_string(threads).c_str(), 1);
    OIIO::attribute("threads", threads);
    // OpenEXR counts the threads that it adds; −1 is OpenImageIO's word for none.
    OIIO::attribute("exr_threads", threads > 1 ? threads : -1);
    static std::optional<tbb::global_control> openvdb;
    openvdb.emplace(tbb::global_control::max_allowed_parallelism,
                    static_cast<std::size_t>(threads));
}

}  // namespace peeler
