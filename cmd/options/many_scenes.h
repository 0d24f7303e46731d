// SPDX-License-Identifier: Apache-2.0
// Runs over several scenes: files, folders, globs.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "cmd/cli/report.h"
#include "cmd/session/reporter.h"

namespace peeler::cmd {

/// Whether `names` is a single file.
bool isOneScene(std::span<const std::filesystem::path> names);

/// Returns the scenes of a list of files, folders and globs. For a folder, lists all files in and
/// below the folder that isSceneName() accepts. Sorts the matches of a folder or glob by name.
/// Throws Error (kInput) if a folder or glob has no scene.
std::vector<std::filesystem::path> listScenes(std::span<const std::filesystem::path> names);

/// Returns an output's name with {stem} (the scene's name without extension) and {folder} (the name
/// of the scene's folder) replaced. In a sample's name, underscores replace characters that would
/// end the key or look like a number pattern.
std::filesystem::path namedAfter(const std::filesystem::path& scene,
                                 const std::filesystem::path& output, bool is_sample = false);

/// A check that no two scenes write the same file.
class SceneOutputs {
  public:
    /// Throws Error (kUsage) if another scene writes the file. The message names `option`.
    void take(const std::filesystem::path& file, const std::filesystem::path& scene,
              const std::string& option);

  private:
    std::map<std::filesystem::path, std::filesystem::path> scene_of_;
};

/// Calls `make` for each scene. `make` returns an exit code and sets the scene's result. Stops at a
/// failure unless `keep_going`. Returns the greatest exit code, and sets `results` to {"scenes":
/// [one result per scene]} with a list "failed" if any scene failed.
int makeEachScene(std::span<const std::filesystem::path> scenes, bool keep_going,
                  Reporter& reporter, Json& results,
                  const std::function<int(std::size_t index, Json& result)>& make);

/// Reports the number of failed scenes in `results`, if there are any.
void reportFailedScenes(const Json& results, std::size_t scenes, Reporter& reporter);

}  // namespace peeler::cmd
