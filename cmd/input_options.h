// SPDX-License-Identifier: Apache-2.0
// What a scene file may make us read.
#pragma once

namespace CLI {
class App;
}

namespace peeler::cmd {

/// Declares --allow-outside.
void addInputOptions(CLI::App& app, bool& allow_outside);

}  // namespace peeler::cmd
