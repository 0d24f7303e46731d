// SPDX-License-Identifier: Apache-2.0
#include "core/capture/method.h"

namespace peeler {

// Each function is defined in the file of the same name.
std::unique_ptr<LayerMethod> makeABuffer();
std::unique_ptr<LayerMethod> makeFrontToBack();
std::unique_ptr<CompositeMethod> makeFrontToBackComposite();
std::unique_ptr<LayerMethod> makeTwoPass();
std::unique_ptr<CompositeMethod> makeTwoPassComposite();
std::unique_ptr<LayerMethod> makeBackToFront();
std::unique_ptr<CompositeMethod> makeBackToFrontComposite();
std::unique_ptr<LayerMethod> makeDual();
std::unique_ptr<CompositeMethod> makeDualComposite();
std::unique_ptr<CompositeMethod> makeDualMaxComposite();
std::unique_ptr<CompositeMethod> makeWeightedAverage();
std::unique_ptr<CompositeMethod> makeWeightedSum();
std::unique_ptr<CompositeMethod> makeWeightedBlended();
std::unique_ptr<CompositeMethod> makeMomentBased();
std::unique_ptr<CompositeMethod> makeUnsorted();

namespace {
constexpr MethodInfo kMethods[] = {
    {"a-buffer", "counted A-buffer: all fragments in one geometry pass, then sorted", makeABuffer,
     nullptr},
    {"front-to-back", "depth peeling (Everitt 2001): one geometry pass per layer, nearest first",
     makeFrontToBack, makeFrontToBackComposite},
    {"two-pass", "two geometry passes per layer: its depth, then the colours at that depth",
     makeTwoPass, makeTwoPassComposite},
    {"back-to-front", "depth peeling from the farthest layer to the nearest", makeBackToFront,
     makeBackToFrontComposite},
    {"dual", "dual depth peeling (Bavoil & Myers 2008): front and back at once", makeDual,
     makeDualComposite},
    {"dual-max", "dual with MAX blending of every target, as published", makeDual,
     makeDualMaxComposite},
    {"weighted-average",
     "order-independent: every fragment has the pixel's average colour and "
     "opacity (Bavoil & Myers 2008)",
     nullptr, makeWeightedAverage},
    {"weighted-sum", "order-independent: opacities and colours are added (Meshkin 2007)", nullptr,
     makeWeightedSum},
    {"weighted-blended",
     "order-independent: mean colour by opacity and distance, exact opacity (McGuire & Bavoil "
     "2013)",
     nullptr, makeWeightedBlended},
    {"moment-based",
     "order-independent: colours weighted by four moments of absorbance (Muenstermann et al. "
     "2018)",
     nullptr, makeMomentBased},
    {"unsorted", "plain blending in draw order, for comparison", nullptr, makeUnsorted},
};
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
