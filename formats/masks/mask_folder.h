// SPDX-License-Identifier: Apache-2.0
// A folder of masks as BOP, as COCO JSON, and as pictures of object ids.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <peeler/view.h>
#include "core/image/object_masks.h"

namespace peeler {

class AtomicFile;

struct MaskFormats {
    bool bop = false, coco = false, ids = false;
    bool rgb = false;  ///< colour pictures of the views
};

/// An object with masks. All files identify the object by its number.
struct MaskedObject {
    std::string name;
    std::uint32_t number = 0;  ///< unique, at least 1
    /// Indices in the scene's file. Only the indices that identify the object have values.
    std::optional<int> node{}, instance{}, material{};
};

struct MaskFolderOptions {
    std::filesystem::path folder;
    MaskFormats formats{};
    std::string by;        ///< the kind of objects ("node", …), stored in objects.json
    std::string software;  ///< name of the program, stored in every PNG; "" stores nothing
};

/// The masks of one view.
struct MaskedView {
    std::size_t number = 0;
    const View& view;  ///< view of the picture, without the canvas around it
    std::string hash;  ///< hash of everything that determines the view's files
    // `masks` and `to_world` have one entry per object, in the order of the folder's objects.
    std::span<const ObjectMasks> masks;
    std::span<const glm::dmat4> to_world;  ///< object to world, in metres
    const ObjectLayers& layers;  ///< for pictures of ids; a number is an object's position, from 1
    /// Writes the view's picture to a path. Must be set if the formats include `rgb`.
    std::function<void(const std::filesystem::path& path)> write_rgb{};
};

/// A writer of a mask folder (formats/README.md, "Masks"). Each file is written atomically. A
/// view's record, `views/NNNNNN.json`, is written last, so its presence means that the view's files
/// are complete. Until then, `views/NNNNNN.begun` exists instead; it has the maximum numbers of
/// masks and layers that a killed run may leave behind. The JSON files of all views are built from
/// the records.
class MaskFolder {
  public:
    /// Throws Error (kUsage) if pictures of ids are requested and an object's number exceeds 65535.
    MaskFolder(MaskFolderOptions options, std::vector<MaskedObject> objects);

    /// Throws Error (kUsage) if BOP is requested, and views are orthographic, have a lens or
    /// differ in size.
    void checkViews(std::span<const View> views) const;
    /// Whether write() or writeShared() may write or remove this file.
    bool owns(const std::filesystem::path& file) const;
    /// Returns the path of a view's record.
    std::filesystem::path record(std::size_t view) const;
    /// Returns the paths of the files that all views share.
    std::vector<std::filesystem::path> sharedFiles() const;

    /// Returns the total size of a view's files, in bytes, or nothing if a file is missing or was
    /// made with another hash.
    std::optional<std::uint64_t> bytesOf(std::size_t view, const std::string& hash) const;

    /// Writes a view's files, replacing earlier ones. First removes the files shared by all views,
    /// because they are outdated now. Returns the number of bytes written. Throws Error (kOutput)
    /// if writing fails.
    std::uint64_t write(const MaskedView& view) const;

    /// Writes the files shared by all views, either all or none, from the views' records, which
    /// must exist. Throws Error (kInput) if a record is damaged, and Error (kOutput) if writing
    /// fails.
    void writeShared(std::size_t views) const;

  private:
    struct Record;
    std::filesystem::path begun(std::size_t view) const;
    static Record readRecord(const std::filesystem::path& file);
    std::vector<std::filesystem::path> files(std::size_t view, std::size_t begin_mask,
                                             std::size_t masks, std::size_t begin_layer,
                                             std::size_t layers) const;
    std::filesystem::path picture(std::size_t view) const;
    void writeIds(AtomicFile& file, const MaskedView& view, std::uint32_t layer) const;

    MaskFolderOptions options_;
    std::vector<MaskedObject> objects_;
};

}  // namespace peeler
