// SPDX-License-Identifier: Apache-2.0
// A GL context that its owner lends to peeler.
#pragma once

#include <string>

#include "core/gl/context.h"
#include "core/gl/functions.h"

namespace peeler::gl {

/// A GL context of another owner, which the owner may also make current on another thread. Peeler
/// owns only the objects that it created in the context.
class AdoptedContext final : public Context {
  public:
    /// Adopts the context that is current on this thread. `function_of` returns the context's
    /// functions by name. Throws Error (kUsage) if no context is current, (kDevice) if the context
    /// lacks required features.
    explicit AdoptedContext(void* (*function_of)(const char* name));
    ~AdoptedContext() override;

    /// Whether this context is current on this thread.
    bool current() const;
    /// Throws Error (kUsage) if this context is not current on this thread.
    void requireCurrent() const;
    /// Makes the owners of this context's GL objects leak the objects instead of deleting them.
    /// Another context may be current, in which a deletion would hit objects with the same names.
    void abandonObjects();

  private:
    GLuint mark_ = 0;    ///< a vertex array, which contexts never share
    std::string label_;  ///< the label of mark_, unique among contexts
};

}  // namespace peeler::gl
