// SPDX-License-Identifier: Apache-2.0
// A borrowed GL context, and the layers in its buffers.
#pragma once

#include <peeler/gl_layers.h>
#include <peeler/layered_image.h>
#include <peeler/renderer.h>

namespace peeler::test {

/// Returns a GL function of testBackend()'s library. Tests use this as RendererOptions::adopt.
void* functionOf(const char* name);

/// Returns options that borrow the current context.
RendererOptions borrowing();

/// Reads a band from the buffers of the current context. Fails the current test if the count of a
/// pixel is not the difference of its offsets.
LayeredImage readBack(const GlLayers& layers);

}  // namespace peeler::test
