// SPDX-License-Identifier: Apache-2.0
// The threads of the libraries behind the formats.
#pragma once

namespace peeler {

/// At most so many threads (from 1) in OpenImageIO and in OpenEXR where OpenImageIO reads or writes
/// with it, the caller's among them. Our own EXR files are packed and unpacked by parallelFor, and
/// OpenVDB is told how many when it is called. Call before the first file.
void setLibraryThreads(int threads);

}  // namespace peeler
