// SPDX-License-Identifier: Apache-2.0
// Borrowed GL state: saved before peeler works in another owner's context, and restored afterwards.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/gl/functions.h"

namespace peeler::gl {

/// The values of one row of the state table. Exact as doubles, because the only 64-bit integers are
/// buffer offsets and sizes, which never exceed 2^53.
using StateValues = std::vector<double>;

/// A row of the state table (OpenGL 4.5 core, 23, "State Tables").
struct StateRow {
    const char* name;
    GLenum parameter;
    /// Read and write all values. An indexed parameter has the values of every index that peeler
    /// uses.
    StateValues (*read)(const Functions& gl, GLenum parameter);
    void (*write)(const Functions& gl, GLenum parameter, const StateValues& values);
    /// The values that peeler needs at the start: GL's initial values, repeated for all indices.
    /// Empty if every pass sets the values that it needs.
    StateValues needed;
    const char* extension = nullptr;  ///< required extension; null = core
};

/// Returns the table of all state that affects peeler's pictures or that peeler changes, in the
/// order of restoring.
///
/// All other state has no row: values of disabled features (stencil functions, the logic operation,
/// polygon offsets, sample masks, the restart index), blend and clear colours, image units, atomic
/// counters, patch parameters, renderbuffers, parameters of compressed pixels. Extension state
/// without a row must have its initial values.
///
/// GL offers no way to restore some state: a program or a pipeline that was deleted while in use; a
/// buffer or a texture that another context deleted while it was bound here; pending errors
/// (takeErrors()). A debug callback also receives the messages of peeler's calls.
std::span<const StateRow> borrowedStateRows();

/// Returns and clears the pending errors of a context, oldest first.
std::vector<GLenum> takeErrors(const Functions& gl);

/// Throws Error (kUsage) if the context has an operation in progress that would affect peeler's
/// work or count it: a query that counts drawing or measures time, conditional rendering, or
/// transform feedback that is not paused. The caller must clear pending errors first. Pipeline
/// statistics queries (an extension) are allowed, although they also count peeler's work.
void requireNothingBegun(const Functions& gl);

/// A scope: sets every row of the table to the values that peeler needs, and restores the previous
/// values on destruction. The context must be current at construction and destruction. Clears GL
/// errors raised while restoring.
class BorrowedState {
  public:
    explicit BorrowedState(const Functions& gl);
    ~BorrowedState();
    BorrowedState(const BorrowedState&) = delete;
    BorrowedState& operator=(const BorrowedState&) = delete;

  private:
    struct Kept {
        const StateRow* row;
        StateValues values;
    };

    const Functions& gl_;
    std::vector<Kept> kept_;
};

}  // namespace peeler::gl
