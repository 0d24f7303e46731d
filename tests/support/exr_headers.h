// SPDX-License-Identifier: Apache-2.0
// Functions that change headers of OpenEXR files.
#pragma once

#include <OpenEXR/ImfHeader.h>

#include <string>

namespace peeler::test {

/// Returns the header without this attribute. (OpenEXR 3.1's Header::erase() leaks the attribute.)
inline Imf::Header without(const Imf::Header& header, const std::string& name) {
    Imf::Header rest;
    for (auto i = header.begin(); i != header.end(); ++i)
        if (name != i.name()) rest.insert(i.name(), i.attribute());
    return rest;
}

}  // namespace peeler::test
