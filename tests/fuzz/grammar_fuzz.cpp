// SPDX-License-Identifier: Apache-2.0
// Fuzz target for values on the command line (cameras, frames, numbers, and names with placeholders
// for numbers) and for the JSON of cameras in files. The input has the kind of value, then the
// text.
#include <iterator>
#include <sstream>

#include "cmd/cli/arguments.h"
#include "cmd/cli/parse.h"
#include "cmd/options/camera_options.h"
#include "cmd/options/frames.h"
#include "formats/exr/exr_files.h"
#include "formats/file/file_name.h"
#include "fuzz/fuzz_scene.h"
#include "fuzz/fuzz_target.h"

namespace peeler::fuzz {
namespace {

/// Parses the words as camera options, and builds the view that they describe.
void takeCameraWords(const std::string& text) {
    cmd::ArgumentParser parser;
    cmd::VerbOptions verb = parser.addVerb("render", {});
    cmd::CameraOptions options;
    cmd::addCameraOptions(verb, options);
    std::vector<std::string> words{"render"};
    std::istringstream stream(text);
    for (std::string word; stream >> word;)
        words.push_back(word);
    if (parser.parse(words) != cmd::Asked::kVerb) return;
    checkCamera(options);
    static const Scene scene = tinyScene();
    static const PosedScene posed(scene);
    const View view = cmd::makeView(posed, SceneExtent(posed), options);
    cameraJson(view);
    if (view.projection.perspective) intrinsicsOf(view);
}

/// Expects the camera to stay the same when it is written and read again.
void takeCameraJson(const std::string& text) {
    const std::string again = cameraJson(viewFromJson(text));
    if (cameraJson(viewFromJson(again)) != again)
        throw std::logic_error("another camera after " + again);
}

void takeFrames(const std::string& text) {
    const std::vector<int> frames = cmd::parseFrames(text);
    if (frames.empty()) throw std::logic_error("no frames in " + text);
}

void takeFileName(const std::string& text) {
    hasFrameToken(text);
    framePath(text, -2147483647);
    hasViewToken(text);
    viewPath(text, 2147483647);
    framesThere(scratchFolder() / text);
}

void takeShard(const std::string& text) {
    const std::size_t slash = text.find(' ');
    const cmd::Shard shard = cmd::parseShard(text.substr(0, slash));
    const auto [first, end] = shard.of(1000);
    if (first > end || end > 1000) throw std::logic_error("a shard of others in " + text);
    cmd::chunkName(slash == std::string::npos ? "" : text.substr(slash), shard);
}

using TextTarget = void (*)(const std::string&);
constexpr TextTarget kGrammars[] = {
    takeCameraWords,
    takeFrames,
    takeCameraJson,
    takeFileName,
    takeShard,
    [](const std::string& text) { cmd::parseNumber(text); },
    [](const std::string& text) { cmd::parsePositiveOrInfinite(text); },
    [](const std::string& text) { cmd::parseInteger(text, -7, 1'000'000); },
    [](const std::string& text) { cmd::parseNumbers<2>(text, "a,b"); },
    [](const std::string& text) { cmd::parseNumbers<4>(text, "a,b,c,d"); },
    [](const std::string& text) { cmd::parseNumbers<6>(text, "a,b,c,d,e,f"); },
    [](const std::string& text) { cmd::parseDirection(text); },
    [](const std::string& text) { cmd::parseFov(text); },
    [](const std::string& text) { cmd::parseSize(text); },
    [](const std::string& text) { cmd::parseCrop(text); },
    [](const std::string& text) { cmd::parseBytes(text); },
    [](const std::string& text) { cmd::parseColor(text); },
    [](const std::string& text) { cmd::parseLayers(text); },
};

void takeGrammar(Input input) {
    Taker taker(input);
    const TextTarget grammar = kGrammars[taker.below(std::size(kGrammars))];
    grammar(textOf(taker.rest()));
}

}  // namespace
}  // namespace peeler::fuzz

PEELER_FUZZ_TARGET(grammar, peeler::fuzz::takeGrammar)
