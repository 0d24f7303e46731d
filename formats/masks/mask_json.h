// SPDX-License-Identifier: Apache-2.0
// The JSON of masks: what a view's record says, and the files of all views that are made of it.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "formats/masks/mask_folder.h"

namespace peeler {

/// The record of a view: what BOP and COCO say of it. `listed` are the objects that BOP lists, in
/// this order, which is that of their masks.
nlohmann::json viewJson(const MaskedView& view, const MaskFormats& formats,
                        std::span<const std::size_t> listed);

/// One of the files that all views share, in pieces: begin(), add() of each view in order, end().
class SharedJson {
  public:
    /// By the file's name.
    explicit SharedJson(std::string name) : name_(std::move(name)) {}

    std::string begin(const std::string& by, std::span<const MaskedObject> objects) const;
    /// Throws nlohmann::json::exception if the record lacks what the file needs.
    std::string add(std::size_t view, const nlohmann::json& record);
    std::string end();

  private:
    std::string name_;
    bool first_ = true;              ///< nothing has been added yet
    std::uint64_t annotations_ = 0;  ///< COCO's so far
    std::string held_;               ///< COCO's list of pictures, which follows the annotations
};

}  // namespace peeler
