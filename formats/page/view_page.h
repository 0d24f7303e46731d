// SPDX-License-Identifier: Apache-2.0
// The page that shows layers in a browser, formats/page/view_page.html, embedded at build time.
#pragma once

#include <string_view>

namespace peeler {

/// With {{view}} where its JSON goes and {{fragments}} where its data goes.
std::string_view viewPage();

}  // namespace peeler
