// SPDX-License-Identifier: Apache-2.0
// Fuzz target for Draco data. Decodes in this process, like peeler_decode: links
// formats/modules/draco_decoder.cpp with another name for its main function, and replaces the
// functions of helper_main.cpp.
//
// The input has the number of requested attributes, the id, type and components of each attribute,
// and the data.
#include <array>

#include "formats/gltf/gltf_decoders.h"
#include "formats/modules/helper_main.h"
#include "fuzz/fuzz_target.h"

int dracoDecoderMain(int count, char** arguments);

namespace peeler {
namespace {

HelperWork draco_work = nullptr;
struct WorkIsKnown {};

HelperWork dracoWork() {
    try {
        dracoDecoderMain(0, nullptr);
    } catch (const WorkIsKnown&) {
    }
    return draco_work;
}

}  // namespace

void limitMemory(std::uint64_t) {}
void limitSeconds(int) {}

void helperMain(int, char**, HelperWork work) {
    draco_work = work;
    throw WorkIsKnown();
}

namespace fuzz {
namespace {

void takeDraco(Input input) {
    constexpr std::array kTypes = {5120, 5121, 5122, 5123, 5125, 5126};
    Taker taker(input);
    std::vector<DracoAttribute> attributes(taker.below(4));
    for (DracoAttribute& attribute : attributes) {
        attribute.unique_id = taker.take<std::uint8_t>();
        attribute.component_type = kTypes[taker.below(kTypes.size())];
        attribute.components = static_cast<int>(taker.below(5));
    }
    SharedFile request, result;
    request.putOne(DracoLimits{1 << 16, 1 << 16});
    request.put(attributes);
    request.put(taker.rest());
    request.seek(0);
    static const HelperWork work = dracoWork();
    try {
        work(request, result);
    } catch (const std::bad_alloc&) {
        // In peeler_decode, helper_main.cpp would report an error here.
    }
}

}  // namespace
}  // namespace fuzz
}  // namespace peeler

PEELER_FUZZ_TARGET(draco, peeler::fuzz::takeDraco)
