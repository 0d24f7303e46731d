// SPDX-License-Identifier: Apache-2.0
// The JSON of masks: a view's record, and the files of all views built from the records.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "formats/masks/mask_folder.h"

namespace peeler {

/// Returns a view's record: its BOP and COCO data. `listed` are the objects in BOP's list, in the
/// order of their masks.
nlohmann::json viewJson(const MaskedView& view, const MaskFormats& formats,
                        std::span<const std::size_t> listed);

/// A file shared by all views, as text in pieces: begin(), add() for each view in order, end().
class SharedJson {
  public:
    /// The file is chosen by its name.
    explicit SharedJson(std::string name) : name_(std::move(name)) {}

    std::string begin(const std::string& by, std::span<const MaskedObject> objects) const;
    /// Throws nlohmann::json::exception if the record lacks required members.
    std::string add(std::size_t view, const nlohmann::json& record);
    std::string end();

  private:
    std::string name_;
    bool first_ = true;              ///< nothing has been added yet
    std::uint64_t annotations_ = 0;  ///< number of COCO annotations so far
    std::string held_;               ///< COCO's image list, which follows the annotations
};

}  // namespace peeler
