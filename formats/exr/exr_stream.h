// SPDX-License-Identifier: Apache-2.0
// An OpenEXR input stream over a RegularFile.
#pragma once

#include <OpenEXR/ImfIO.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include <peeler/error.h>
#include "formats/file/regular_file.h"

namespace peeler {

class ExrStream final : public Imf::IStream {
  public:
    /// `file` must be open and outlive the stream. `path` names the file in messages.
    ExrStream(const RegularFile& file, const std::string& path)
        : IStream(path.c_str()), file_(file) {}

    bool read(char* data, int bytes) override {
        const auto wanted = static_cast<std::size_t>(bytes);
        if (file_.readSome(place_, {data, wanted}) < wanted)
            throw Error(ErrorKind::kInput, "the file ends too early", fileName());
        place_ += static_cast<std::uint64_t>(bytes);
        return place_ < file_.size();
    }
    std::uint64_t tellg() override { return place_; }
    void seekg(std::uint64_t place) override { place_ = place; }

  private:
    const RegularFile& file_;
    std::uint64_t place_ = 0;
};

}  // namespace peeler
