// SPDX-License-Identifier: Apache-2.0
// Preloaded library that stalls the threads of Mesa's rasteriser in lp_fence_signal(), between its
// last broadcast and the unlocking of the fence's mutex (cmd/mutex_destroy.cpp). The scheduler may
// stop a thread there, too.
//   PEELER_STALL_MICROSECONDS   duration (default: none)
//   PEELER_STALL_ONE_IN         stalls only every n-th time per thread (default: 1)
// Prints the number of stalls on stderr at the end.
#include <dlfcn.h>
#include <pthread.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace {

using Broadcast = int (*)(pthread_cond_t*);

unsigned numberOf(const char* variable, unsigned otherwise) {
    const char* const text = std::getenv(variable);
    return text ? static_cast<unsigned>(std::strtoul(text, nullptr, 10)) : otherwise;
}

const unsigned stall = numberOf("PEELER_STALL_MICROSECONDS", 0);
const unsigned one_in = numberOf("PEELER_STALL_ONE_IN", 1);

struct Count {
    std::atomic<unsigned> stalls{0};
    ~Count() {
        if (stall != 0) std::fprintf(stderr, "stalls: %u\n", stalls.load());
    }
};
Count count;

bool isRasterizer() {
    std::array<char, 16> name{};
    pthread_getname_np(pthread_self(), name.data(), name.size());
    return std::string_view(name.data()).starts_with("llvmpipe-");
}

/// Returns the C library's function. On x86-64, the library also has an older version of the
/// function, which must not be used.
Broadcast actualBroadcast() {
    void* const found = dlvsym(RTLD_NEXT, "pthread_cond_broadcast", "GLIBC_2.3.2");
    return reinterpret_cast<Broadcast>(found ? found : dlsym(RTLD_NEXT, "pthread_cond_broadcast"));
}

}  // namespace

extern "C" int pthread_cond_broadcast(pthread_cond_t* condition) noexcept {
    static const Broadcast broadcast = actualBroadcast();
    const int result = broadcast(condition);
    thread_local const bool stalls = stall != 0 && isRasterizer();
    thread_local unsigned turn = 0;
    if (stalls && ++turn % one_in == 0) {
        ++count.stalls;
        usleep(stall);
    }
    return result;
}
