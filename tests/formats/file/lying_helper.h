// SPDX-License-Identifier: Apache-2.0
// A fake decoder that answers with arbitrary bytes, like a decoder under an attacker's control.
#pragma once

#include <cstring>
#include <fstream>

#include "formats/file/helper_process.h"
#include "support/test_support.h"

namespace peeler::test {

/// A result in the helper's format, built number by number.
class Answer {
  public:
    template <class T>
    Answer& add(const T& value) {
        const auto* const bytes = reinterpret_cast<const std::uint8_t*>(&value);
        bytes_.insert(bytes_.end(), bytes, bytes + sizeof value);
        return *this;
    }
    /// Adds an array: a size, which may be wrong, and bytes.
    Answer& addArray(std::uint64_t size, const Bytes& bytes) {
        add(size).bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
        return *this;
    }

    /// Returns the result of runHelper() for a program that answers with these bytes.
    SharedFile run() const {
        const ScratchDir scratch;
        const std::filesystem::path program = scratch / "decoder";
        std::ofstream script(program);
        script << "#!/bin/sh\nprintf '";
        for (const std::uint8_t byte : bytes_)
            script << '\\' << byte / 64 << byte / 8 % 8 << byte % 8;
        script << "'\n";
        script.close();
        std::filesystem::permissions(program, std::filesystem::perms::owner_all);
        const SharedFile request;
        return runHelper({program, 10, "a hint"}, request);
    }

  private:
    Bytes bytes_;
};

}  // namespace peeler::test
