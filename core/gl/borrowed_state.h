// SPDX-License-Identifier: Apache-2.0
// The state of a context that peeler borrows: what it sets while it works, and puts back
// afterwards.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/gl/functions.h"

namespace peeler::gl {

/// The values of a row, whatever their type in GL: a double holds each of them exactly.
using StateValues = std::vector<double>;

/// A row of the table of state (OpenGL 4.5 core, 23, "State Tables").
struct StateRow {
    const char* name;
    GLenum parameter;
    /// All values: of an indexed parameter those of every index that peeler uses.
    StateValues (*read)(const Functions& gl, GLenum parameter);
    void (*write)(const Functions& gl, GLenum parameter, const StateValues& values);
    /// GL's initial values, which peeler starts from as in a context of its own; repeated as often
    /// as there are values. Empty = every pass sets its own.
    StateValues needed;
    const char* extension = nullptr;  ///< the row is left out without it; null = core
};

/// All state that changes peeler's pictures, or that peeler changes, in the order in which it is
/// put back.
///
/// Other state does neither: values of what is switched off (stencil functions, the logic
/// operation, polygon offsets, sample masks, the restart index), blend and clear colours, image
/// units, atomic counters, patch parameters, renderbuffers, parameters of compressed pixels. State
/// of extensions has to be as it is initially where no row names it.
///
/// GL cannot put back: a program or a pipeline that was deleted while it was in use; a buffer or a
/// texture that another context deleted while it was bound here; errors that were pending
/// (takeErrors()). A debug callback gets the messages of peeler's calls, too.
std::span<const StateRow> borrowedStateRows();

/// Takes the errors that are pending in a context, oldest first.
std::vector<GLenum> takeErrors(const Functions& gl);

/// Throws Error (kUsage) for what the owner of a context has begun and peeler cannot work within:
/// queries that count what is drawn or measure time, conditional rendering, transform feedback that
/// is not paused. No error may be pending. (Statistics of the pipeline, which are an extension,
/// count on.)
void requireNothingBegun(const Functions& gl);

/// Sets every row of the table to what peeler needs, and puts back what was there at the end of its
/// life. The context has to be current at both. Errors of putting back are not left pending.
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
