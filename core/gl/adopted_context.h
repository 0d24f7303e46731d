// SPDX-License-Identifier: Apache-2.0
// A context made and lent by its owner.
#pragma once

#include <string>

#include "core/gl/context.h"
#include "core/gl/functions.h"

namespace peeler::gl {

/// A GL context of another owner, who may also make it current on another thread. Only its objects
/// belong to peeler.
class AdoptedContext final : public Context {
  public:
    /// Adopts the context that is current on this thread, with the functions that `function_of`
    /// returns by name. Throws Error (kUsage) if there is none, (kDevice) if it lacks required
    /// features.
    explicit AdoptedContext(void* (*function_of)(const char* name));
    ~AdoptedContext() override;

    /// Whether it is current on this thread.
    bool current() const;
    /// Throws Error (kUsage) if this context is not current on this thread.
    void requireCurrent() const;
    /// Leaks all objects of this context that are destroyed from now on: names would be deleted in
    /// the current context, which may be another one.
    void abandonObjects();

  private:
    GLuint mark_ = 0;    ///< a vertex array: not shared between contexts
    std::string label_;  ///< its label, unique among contexts
};

}  // namespace peeler::gl
