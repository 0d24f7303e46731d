// SPDX-License-Identifier: Apache-2.0
#include "core/image/fragment_copies.h"

#include <cstring>

namespace peeler {
namespace {

void copyArray(const FragmentArray& from, std::size_t source, FragmentArray& to, std::size_t target,
               std::size_t count) {
    std::memcpy(to.data.data() + target * to.stride(), from.data.data() + source * from.stride(),
                count * from.stride());
}

void resizeArray(const FragmentArray& like, std::size_t fragments, FragmentArray& array) {
    array.channels = like.channels;
    array.type = like.type;
    array.data.resize(fragments * like.stride());
}

}  // namespace

void resizeFragments(const LayeredImage& like, std::size_t fragments, LayeredImage& out) {
    out.z.resize(fragments);
    resizeArray(like.color, fragments, out.color);
    out.extra.resize(like.extra.size());
    for (std::size_t i = 0; i < like.extra.size(); ++i)
        resizeArray(like.extra[i], fragments, out.extra[i]);
}

void copyFragments(const LayeredImage& image, std::size_t source, LayeredImage& out,
                   std::size_t target, std::size_t count) {
    if (count == 0) return;
    std::memcpy(&out.z[target], &image.z[source], count * sizeof(float));
    copyArray(image.color, source, out.color, target, count);
    for (std::size_t i = 0; i < image.extra.size(); ++i)
        copyArray(image.extra[i], source, out.extra[i], target, count);
}

}  // namespace peeler
