// SPDX-License-Identifier: Apache-2.0
#include "formats/image_library.h"

#include <mutex>

#include "formats/module.h"

namespace peeler {
namespace {

std::mutex mutex;
const ImageLibrary* loaded = nullptr;
int wanted_threads = 0;  ///< 0 = nothing was said

}  // namespace

const ImageLibrary& imageLibrary() {
    const std::lock_guard lock(mutex);
    if (loaded) return *loaded;
    void* const function = moduleFunction(kImageModule, kImageModuleFunction);
    loaded = reinterpret_cast<ImageModuleFunction*>(function)();
    if (wanted_threads > 0) loaded->setThreads(wanted_threads);
    return *loaded;
}

void setImageLibraryThreads(int threads) {
    const std::lock_guard lock(mutex);
    wanted_threads = threads;
    if (loaded) loaded->setThreads(threads);
}

}  // namespace peeler
