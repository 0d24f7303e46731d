// SPDX-License-Identifier: Apache-2.0
// A context that its owner has made, and lends.
#pragma once

#include <string>

#include "core/gl/context.h"
#include "core/gl/functions.h"

namespace peeler::gl {

/// Belongs to its owner, who may also make it current on another thread. Only its objects are
/// peeler's.
class AdoptedContext final : public Context {
  public:
    /// The context that is current on this thread, with functions that `function_of` gives by name.
    /// Throws Error (kUsage) if there is none, (kDevice) if it cannot do what is needed.
    explicit AdoptedContext(void* (*function_of)(const char* name));
    ~AdoptedContext() override;

    /// Whether it is current on this thread.
    bool current() const;
    /// Throws Error (kUsage) if another context is current on this thread, or none.
    void requireCurrent() const;
    /// Has objects of this context, whose lives end from now on, stay in it: names are deleted in
    /// the current context, which may be another one.
    void abandonObjects();

  private:
    GLuint mark_ = 0;    ///< a vertex array: contexts do not share them
    std::string label_;  ///< its label, which no other context has
};

}  // namespace peeler::gl
