// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "core/peel/method.h"

namespace peeler {

// Each is defined in the file of its name.
std::unique_ptr<PeelMethod> makeABuffer();
std::unique_ptr<PeelMethod> makeFrontToBack();

namespace {
constexpr std::array<MethodInfo, 2> kMethods = {{
    {"a-buffer", "counted A-buffer: all fragments in one geometry pass, then sorted", makeABuffer},
    {"front-to-back", "depth peeling (Everitt 2001): one geometry pass a layer, nearest first",
     makeFrontToBack},
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
