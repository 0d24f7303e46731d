// SPDX-License-Identifier: Apache-2.0
// A folder of masks: BOP, COCO JSON, and pictures of object ids.
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

/// The formats in a folder; they can be combined.
struct MaskFormats {
    bool bop = false, coco = false, ids = false;
};

/// An object; the first in a list has id 1.
struct MaskedObject {
    std::string name;
    /// Indices in the scene's file, where the object is one of these.
    std::optional<int> node{}, instance{}, material{};
};

/// Settings of a mask folder.
struct MaskFolderOptions {
    std::filesystem::path folder;
    MaskFormats formats{};
    std::string by;        ///< kind of objects: "node", …; stored in objects.json
    std::string software;  ///< stored in every PNG unless empty
};

/// The masks of one view.
struct MaskedView {
    std::size_t number = 0;
    const View& view;  ///< of the picture, not of the canvas
    std::string hash;  ///< of everything that determines its files
    // By object; the first has id 1.
    std::span<const ObjectMasks> masks;
    std::span<const glm::dmat4> to_world;  ///< metres
    const ObjectLayers& layers;            ///< for pictures of ids
};

/// The files of a mask folder (formats/README.md, "Masks"). A view's files come first, then its
/// record `views/NNNNNN.json`, so a record implies complete files. While they are written,
/// `views/NNNNNN.begun` replaces the record; it bounds the files that a killed run may leave
/// behind. The JSON files of all views are built from the records. Every file is written
/// atomically.
class MaskFolder {
  public:
    /// Throws Error (kUsage) if there are pictures of ids and more than 65535 objects.
    MaskFolder(MaskFolderOptions options, std::vector<MaskedObject> objects);

    /// Throws Error (kUsage) if BOP cannot represent these views: orthographic ones, different
    /// sizes.
    void checkViews(std::span<const View> views) const;
    /// Whether a file of that name may belong to the folder.
    bool owns(const std::filesystem::path& file) const;
    /// Returns the path of a view's record.
    std::filesystem::path record(std::size_t view) const;
    /// Returns the paths of the files shared by all views.
    std::vector<std::filesystem::path> sharedFiles() const;

    /// Returns the total bytes of a view's files if all exist and were made with this hash.
    std::optional<std::uint64_t> bytesOf(std::size_t view, const std::string& hash) const;

    /// Writes a view's files, replacing earlier ones. Removes the shared files first, since they
    /// become outdated. Returns the bytes written. Throws Error (kOutput) if writing fails.
    std::uint64_t write(const MaskedView& view) const;

    /// Writes all shared files, or none, from the views' records, which must exist. Throws Error
    /// (kInput) if a record is damaged, and Error (kOutput) if writing fails.
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
