// SPDX-License-Identifier: Apache-2.0
// A folder of masks: as BOP has them, in COCO's JSON, and pictures of the objects' numbers.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <peeler/view.h>
#include "core/image/object_masks.h"

namespace peeler {

/// What a folder has; several go together.
struct MaskFormats {
    bool bop = false, coco = false, ids = false;
};

/// An object; the first one of a list is number 1.
struct MaskedObject {
    std::string name;
    /// Indices of the scene's file, where it is one of these.
    std::optional<int> node{}, instance{}, material{};
};

/// What the objects of a folder are, and what makes its masks.
struct MaskFolderOptions {
    std::filesystem::path folder;
    MaskFormats formats{};
    std::string by;        ///< what objects are: "node", …; stands in objects.json
    std::string software;  ///< stands in every PNG unless empty
};

/// What one view shows.
struct MaskedView {
    std::size_t number = 0;
    const View& view;  ///< of the picture, whatever the canvas was
    std::string hash;  ///< of all that decides what its files hold
    // Of each object, the first one of a list is number 1.
    std::span<const ObjectMasks> masks;
    std::span<const glm::dmat4> to_world;  ///< metres
    const ObjectLayers& layers;            ///< for pictures of ids
};

/// The files of one folder (formats/README.md, "Masks"). Those of a view are written when it is
/// made, and its record `views/NNNNNN.json` after them: what is in that is what the files hold.
/// While they are written there is no record, but `views/NNNNNN.begun`, by which the next run knows
/// what a killed one may have left. The JSON files of all views are made of the records. Every file
/// appears whole or not at all.
class MaskFolder {
  public:
    /// Throws Error (kUsage) for pictures of ids of more than 65535 objects.
    MaskFolder(MaskFolderOptions options, std::vector<MaskedObject> objects);

    /// Throws Error (kUsage) if BOP cannot have these views: orthographic ones, different sizes.
    void checkViews(std::span<const View> views) const;
    /// Whether a file of that name may be one of the folder's.
    bool owns(const std::filesystem::path& file) const;
    /// The record of a view.
    std::filesystem::path record(std::size_t view) const;
    /// The files of all views.
    std::vector<std::filesystem::path> sharedFiles() const;

    /// The bytes of a view's files, if all of them are there and were made by what has this hash.
    std::optional<std::uint64_t> bytesOf(std::size_t view, const std::string& hash) const;

    /// Writes the files of a view, in place of those that it had; what all views share is removed
    /// before, since it is no longer of what is there. Returns the bytes written. Throws Error
    /// (kOutput).
    std::uint64_t write(const MaskedView& view) const;

    /// Writes the files that all views share, of their records, which must be there; all of them,
    /// or none. Throws Error (kInput) for a damaged record, (kOutput).
    void writeShared(std::size_t views) const;

  private:
    struct Record;
    std::filesystem::path begun(std::size_t view) const;
    static Record readRecord(const std::filesystem::path& file);
    std::vector<std::filesystem::path> files(std::size_t view, std::size_t begin_mask,
                                             std::size_t masks, std::size_t begin_layer,
                                             std::size_t layers) const;

    MaskFolderOptions options_;
    std::vector<MaskedObject> objects_;
};

}  // namespace peeler
