// SPDX-License-Identifier: Apache-2.0
// The JSON of masks: the record of each view, and the shared files, which are built from the
// records.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "formats/masks/mask_folder.h"

namespace peeler {

/// Returns a view's record with its BOP and COCO data. `listed` has the indices in `objects` of the
/// objects in BOP's lists, in the order of their masks.
nlohmann::json viewJson(const MaskedView& view, const MaskFormats& formats,
                        std::span<const MaskedObject> objects, std::span<const std::size_t> listed);

/// A builder of a file shared by all views. The file is the concatenation of begin(), add() for
/// each view in order, and end().
class SharedJson {
  public:
    /// `name` is the file's name and chooses the content.
    explicit SharedJson(std::string name) : name_(std::move(name)) {}

    std::string begin(const std::string& by, std::span<const MaskedObject> objects) const;
    /// Throws nlohmann::json::exception if the record lacks required members.
    std::string add(std::size_t view, const nlohmann::json& record);
    std::string end();

  private:
    std::string name_;
    bool first_ = true;
    std::uint64_t annotations_ = 0;  ///< number of COCO annotations so far
    std::string held_;  ///< COCO's image list, which end() writes after the annotations
};

}  // namespace peeler
