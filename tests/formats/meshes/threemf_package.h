// SPDX-License-Identifier: Apache-2.0
// Small 3MF packages, for tests.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace peeler::test {

inline std::uint32_t crc32Of(std::string_view bytes) {
    std::uint32_t crc = 0xFFFFFFFF;
    for (const char byte : bytes) {
        crc ^= static_cast<std::uint8_t>(byte);
        for (int bit = 0; bit < 8; ++bit)
            crc = crc >> 1U ^ (crc & 1U ? 0xEDB88320 : 0);
    }
    return ~crc;
}

/// Returns a ZIP archive of stored files (PKWARE APPNOTE 6.3); `flags` are those of every file.
inline std::string storedZip(const std::map<std::string, std::string>& files,
                             std::uint16_t flags = 0) {
    const auto number = [](std::uint64_t value, int bytes) {
        std::string text;
        for (int i = 0; i < bytes; ++i)
            text += static_cast<char>(value >> 8 * i);
        return text;
    };
    std::string archive, directory;
    for (const auto& [name, bytes] : files) {
        const std::string fields = number(20, 2) + number(flags, 2) + number(0, 2) +
                                   number(0x21 << 16, 4) + number(crc32Of(bytes), 4) +
                                   number(bytes.size(), 4) + number(bytes.size(), 4) +
                                   number(name.size(), 2) + number(0, 2);
        directory += number(0x02014B50, 4) + number(20, 2) + fields + number(0, 10) +
                     number(archive.size(), 4) + name;
        archive += number(0x04034B50, 4) + fields + name + bytes;
    }
    return archive + directory + number(0x06054B50, 4) + number(0, 4) + number(files.size(), 2) +
           number(files.size(), 2) + number(directory.size(), 4) + number(archive.size(), 4) +
           number(0, 2);
}

/// Returns a package with this model, and further files.
inline std::string threeMfOf(const std::string& model, std::map<std::string, std::string> more = {},
                             std::uint16_t flags = 0) {
    const std::string opc = "http://schemas.openxmlformats.org/package/2006/",
                      type = "ContentType=\"application/vnd.";
    more["[Content_Types].xml"] =
        "<Types xmlns=\"" + opc + "content-types\">" + "<Default Extension=\"rels\" " + type +
        "openxmlformats-package.relationships+xml\"/>" + "<Default Extension=\"model\" " + type +
        "ms-package.3dmanufacturing-3dmodel+xml\"/></Types>";
    more["_rels/.rels"] =
        "<Relationships xmlns=\"" + opc + "relationships\">" +
        "<Relationship Id=\"r0\" Target=\"/3D/3dmodel.model\" "
        "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>";
    more["3D/3dmodel.model"] = model;
    return storedZip(more, flags);
}

/// Returns a model; `more` are attributes.
inline std::string threeMfModel(const std::string& resources,
                                const std::string& build = "<item objectid=\"1\"/>",
                                const std::string& unit = "millimeter",
                                const std::string& more = "") {
    return "<model unit=\"" + unit + "\" " + more +
           " xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\""
           " xmlns:m=\"http://schemas.microsoft.com/3dmanufacturing/material/2015/02\""
           " xmlns:s=\"http://schemas.microsoft.com/3dmanufacturing/slice/2015/07\""
           " xmlns:b=\"http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02\">"
           "<resources>" +
           resources + "</resources><build>" + build + "</build></model>";
}

/// Returns the mesh of a box from the origin to (x, y, z), facing outwards. Its triangles have
/// `first` as attributes, the others `rest`.
inline std::string threeMfBox(int x, int y, int z, const std::string& first = "",
                              const std::string& rest = "") {
    constexpr std::array<std::array<int, 3>, 12> kTriangles = {{{0, 2, 1},
                                                                {1, 2, 3},
                                                                {4, 5, 6},
                                                                {5, 7, 6},
                                                                {0, 1, 4},
                                                                {1, 5, 4},
                                                                {2, 6, 3},
                                                                {3, 6, 7},
                                                                {0, 4, 2},
                                                                {2, 4, 6},
                                                                {1, 3, 5},
                                                                {3, 7, 5}}};
    std::string text = "<mesh><vertices>";
    for (int corner = 0; corner < 8; ++corner)
        text += "<vertex x=\"" + std::to_string(corner & 1 ? x : 0) + "\" y=\"" +
                std::to_string(corner & 2 ? y : 0) + "\" z=\"" +
                std::to_string(corner & 4 ? z : 0) + "\"/>";
    text += "</vertices><triangles>";
    for (const auto& triangle : kTriangles) {
        text += "<triangle v1=\"" + std::to_string(triangle[0]) + "\" v2=\"" +
                std::to_string(triangle[1]) + "\" v3=\"" + std::to_string(triangle[2]) + "\" " +
                (&triangle == &kTriangles[0] ? first : rest) + "/>";
    }
    return text + "</triangles></mesh>";
}

inline std::string threeMfObject(const std::string& content, int id = 1,
                                 const std::string& attributes = "") {
    return "<object id=\"" + std::to_string(id) + "\" " + attributes + ">" + content + "</object>";
}

}  // namespace peeler::test
