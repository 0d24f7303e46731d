// SPDX-License-Identifier: Apache-2.0
// write_font TTF FILE: a build-time program that rasterises a monospaced font.
//
// Writes a Font as a memory image, which font.cpp embeds.
#include <ft2build.h>
#include FT_FREETYPE_H

#include <cstdio>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>

#include "core/base/memory_image.h"
#include "formats/image/font.h"

namespace peeler {
namespace {

void check(FT_Error error, const std::string& what) {
    if (error != 0) throw std::runtime_error(what + ": FreeType error " + std::to_string(error));
}

/// Rasterises the printable ASCII characters at ten dots per em, so that capitals are about seven
/// dots high.
template <int S>
void rasterise(FT_Face face, Glyphs<S>& glyphs) {
    check(FT_Set_Pixel_Sizes(face, 0, 10 * S), "cannot set the size");
    constexpr int kBaseline = S * (kGlyphTop + kTextHeight);
    for (std::size_t i = 0; i < glyphs.size(); ++i) {
        const auto character = static_cast<FT_ULong>(kFirstGlyph) + i;
        check(FT_Load_Char(face, character, FT_LOAD_RENDER), "cannot render a character");
        const FT_GlyphSlot slot = face->glyph;
        const FT_Bitmap& bitmap = slot->bitmap;
        for (int row = 0; row < static_cast<int>(bitmap.rows); ++row) {
            for (int column = 0; column < static_cast<int>(bitmap.width); ++column) {
                const int x = slot->bitmap_left + column, y = kBaseline - slot->bitmap_top + row;
                if (x < 0 || y < 0 || x >= S * kTextAdvance || y >= S * kGlyphRows) continue;
                glyphs[i][static_cast<std::size_t>(y)][static_cast<std::size_t>(x)] =
                    bitmap.buffer[row * bitmap.pitch + column];
            }
        }
    }
}

std::unique_ptr<Font> rasterised(const std::string& path) {
    FT_Library library = nullptr;
    check(FT_Init_FreeType(&library), "cannot start");
    FT_Face face = nullptr;
    check(FT_New_Face(library, path.c_str(), 0, &face), path);
    auto font = std::make_unique<Font>();
    rasterise<1>(face, font->one);
    rasterise<2>(face, font->two);
    rasterise<3>(face, font->three);
    rasterise<4>(face, font->four);
    FT_Done_FreeType(library);  // frees the face, too
    return font;
}

}  // namespace
}  // namespace peeler

int main(int count, char** arguments) {
    if (count != 3) {
        std::fputs("usage: write_font TTF FILE\n", stderr);
        return 2;
    }
    try {
        peeler::writeMemoryImage(*peeler::rasterised(arguments[1]), arguments[2]);
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "write_font: %s\n", error.what());
        return 1;
    }
}
