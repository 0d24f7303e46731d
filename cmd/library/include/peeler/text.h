// SPDX-License-Identifier: Apache-2.0
// Text of errors and warnings with marked parameter names, which the command line and Python
// replace by the names of their options and arguments.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// A field, argument or function of the API that messages refer to.
enum class Parameter : std::uint8_t {
    kAllowOutside,
    kAnimations,
    kAs,
    kAttenuation,
    kBackend,
    kBounds,
    kCamera,
    kChannels,
    kComposite,
    kCompression,
    kConvention,
    kCrop,
    kDeepError,
    kDeepKeep,
    kDeepMerge,
    kDense,
    kDevice,
    kEnvironment,
    kExclude,
    kEye,
    kFar,
    kFov,
    kIgnoredExtensions,
    kInclude,
    kIntrinsics,
    kLayout,
    kListDevices,
    kMaps,
    kMaxFragments,
    kMaxLayers,
    kMemory,
    kMethod,
    kMetresPerUnit,
    kNear,
    kNoComposite,
    kNormalize,
    kOcclusionRatio,
    kOrthoHeight,
    kPart,
    kParts,
    kPath,
    kPointSize,
    kPose,
    kRange,
    kReadExrInfo,
    kRenderer,
    kRequireGpu,
    kResolution,
    kShadePer,
    kShadowSize,
    kShadows,
    kSize,
    kSmoothNormals,
    kSpacing,
    kSplatBlending,
    kStrict,
    kTail,
    kTarget,
    kToneMap,
    kUp,
    kUvSet,
    kView,
    kCount,
};

/// Returns the parameter's name in the C++ API: "max_layers".
std::string_view nameOf(Parameter parameter);

/// The text of a message: words with parameters between them. As a string, each parameter is its
/// C++ name in backquotes: "choose a smaller `size`". spelled() replaces the parameters by other
/// names (options, Python arguments), but does not touch words that merely look like a parameter,
/// such as a file's name.
class Text {
  public:
    Text() = default;
    // NOLINTBEGIN(google-explicit-constructor): so that + joins strings and parameters
    Text(std::string words) : text_(std::move(words)) {}
    Text(std::string_view words) : text_(words) {}
    Text(const char* words) : text_(words) {}
    Text(Parameter parameter);
    // NOLINTEND(google-explicit-constructor)

    const std::string& str() const { return text_; }
    bool empty() const { return text_.empty(); }

    Text& operator+=(const Text& other);
    /// Returns the text without the last character if the last character is `last`.
    Text withoutEnd(char last) const;

    /// Calls `words(part)` and `named(parameter)` for the pieces of the message, in order.
    void visit(const std::function<void(std::string_view)>& words,
               const std::function<void(Parameter)>& named) const;
    /// Returns the message with `spelling(parameter)` for each parameter.
    std::string spelled(const std::function<std::string(Parameter)>& spelling) const;

  private:
    struct Named {
        std::size_t begin;  ///< position of the opening backquote in text_, bytes
        Parameter parameter;
    };

    std::string text_;
    std::vector<Named> named_;  ///< in the order of their positions
};

inline Text operator+(Text first, const Text& second) {
    return std::move(first += second);
}

inline Text operator+(Text first, Parameter second) {
    return std::move(first += second);
}

inline Text operator+(Parameter first, const Text& second) {
    return Text(first) + second;
}

inline bool operator==(const Text& a, const Text& b) {
    return a.str() == b.str();
}

inline std::ostream& operator<<(std::ostream& stream, const Text& text) {
    return stream << text.str();
}

}  // namespace peeler::inline v0

#pragma GCC visibility pop
