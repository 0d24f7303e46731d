// SPDX-License-Identifier: Apache-2.0
#include "formats/file/library_threads.h"

#include <cstdlib>
#include <string>

#include "formats/image/image_library.h"

namespace peeler {

void setLibraryThreads(int threads) {
    // OpenImageIO's pool is made on the first use with as many as CUE_THREADS says, be that a
    // number or not; its own variable comes before that.
    setenv("OPENIMAGEIO_THREADS", std::to_string(threads).c_str(), 1);
    setImageLibraryThreads(threads);
}

}  // namespace peeler
