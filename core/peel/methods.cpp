// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "core/peel/method.h"

namespace peeler {

// Each is defined in the file of its name.
std::unique_ptr<PeelMethod> makeABuffer();
std::unique_ptr<PeelMethod> makeFrontToBack();
std::unique_ptr<PeelMethod> makeTwoPass();
std::unique_ptr<PeelMethod> makeBackToFront();
std::unique_ptr<PeelMethod> makeDual();

namespace {
constexpr std::array<MethodInfo, 5> kMethods = {{
    {"a-buffer", "counted A-buffer: all fragments in one geometry pass, then sorted", makeABuffer},
    {"front-to-back", "depth peeling (Everitt 2001): one geometry pass a layer, nearest first",
     makeFrontToBack},
    {"two-pass", "the next layer's depth first, then the colour where it is equal", makeTwoPass},
    {"back-to-front", "depth peeling from the farthest layer to the nearest", makeBackToFront},
    {"dual", "dual depth peeling (Bavoil & Myers 2008): front and back at once", makeDual},
}};
}  // namespace

std::span<const MethodInfo> peelMethods() {
    return kMethods;
}

const MethodInfo* findPeelMethod(std::string_view name) {
    for (const auto& method : kMethods)
        if (method.name == name) return &method;
    return nullptr;
}

}  // namespace peeler
