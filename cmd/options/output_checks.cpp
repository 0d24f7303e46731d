// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/output_checks.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include <peeler/error.h>
#include "cmd/cli/errors.h"
#include "cmd/options/output_options.h"
#include "cmd/options/sequence_options.h"
#include "formats/exr/exr_files.h"
#include "formats/file/atomic_file.h"
#include "formats/file/file_name.h"
#include "formats/file/regular_file.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

/// Whether both paths refer to the same file. If a file does not exist yet, resolves the links in
/// both paths and compares the results.
bool sameFile(const fs::path& a, const fs::path& b) {
    std::error_code failure;
    if (fs::equivalent(a, b, failure)) return true;
    return withLinksFollowed(a).lexically_normal() == withLinksFollowed(b).lexically_normal();
}

}  // namespace

void checkFolderIsThere(const fs::path& folder, const fs::path& file) {
    if (fileExists(folder.empty() ? "." : folder, ErrorKind::kOutput)) return;
    throw Error(ErrorKind::kOutput, "cannot write: the folder does not exist", file.string(),
                "make the folder first, or leave --no-mkdir out");
}

namespace {

/// Performs the checks of checkTarget() for the files written beside the output.
void checkFilesBeside(const OutputRequest& output, const std::vector<fs::path>& inputs) {
    const std::vector<std::string> beside = filesBeside(output.path.string(), output.options);
    if (!beside.empty() && isStandardOutput(output.path.string()))
        refuse("several files cannot go to standard output", "--as " + output.options.as,
               "name a file");
    for (const std::string& file : beside) {
        const auto is_file = [&](const fs::path& input) { return sameFile(input, file); };
        if (std::ranges::any_of(inputs, is_file)) {
            throw Error(ErrorKind::kUsage,
                        "a file written next to the output would replace an input", file,
                        "choose another name for the output");
        }
        if (output.no_clobber) checkNotThere(file);
    }
}

/// Throws Error (kUsage) if one of the per-layer files would replace an input. Under --no-clobber,
/// throws Error (kOutput) if one of the per-layer files exists.
void checkLayerFiles(const OutputRequest& output, const std::vector<fs::path>& inputs) {
    if (!output.hasFilePerLayer()) return;
    if (isStandardOutput(output.path.string()))
        refuse("several files cannot go to standard output", "--layout per-file", "name a file");
    for (const fs::path& input : inputs) {
        for (const std::string& file : exrFilesOf(input.string())) {
            if (isExrLayerFile(file, output.path.string())) {
                refuse("a layer's file could replace the input " + file, "--layout per-file",
                       "choose another name for the output");
            }
        }
    }
    if (!output.no_clobber) return;
    const fs::path folder =
        output.path.has_parent_path() ? output.path.parent_path() : fs::path(".");
    for (const std::string& name : namesIn(folder))
        if (isExrLayerFile((folder / name).string(), output.path.string()))
            checkNotThere(folder / name);
}

}  // namespace

void checkNotThere(const fs::path& file) {
    if (isStandardOutput(file.string())) return;
    if (!isTaken(file)) return;
    throw Error(ErrorKind::kOutput, "the file already exists", file.string(),
                "remove it, choose another name, or leave --no-clobber out");
}

void checkFolder(const fs::path& file) {
    std::error_code failure;
    fs::path folder = fs::absolute(withLinksFollowed(file), failure).parent_path();
    if (isStandardOutput(file.string()) || fileExists(folder, ErrorKind::kOutput)) {
        const AtomicFile probe(file.string());
        return;
    }
    while (!fileExists(folder, ErrorKind::kOutput) && folder.has_relative_path())
        folder = folder.parent_path();
    if (access(folder.c_str(), W_OK | X_OK) == 0 && fs::is_directory(folder, failure)) return;
    const int cause = fs::is_directory(folder, failure) ? errno : ENOTDIR;
    throw Error(ErrorKind::kOutput,
                "cannot make the folder: " + std::generic_category().message(cause), file.string(),
                "choose another folder, or check the permissions of " + folder.string());
}

void checkTarget(const OutputRequest& output, const std::vector<fs::path>& inputs) {
    for (const fs::path& input : inputs) {
        for (const std::string& file : exrFilesOf(input.string())) {
            if (!sameFile(output.path, file)) continue;
            throw Error(ErrorKind::kUsage,
                        file == input.string() ? "the output is the input"
                                               : "the output is one of the input's files",
                        output.path.string(), "choose another name for the output");
        }
    }
    if (output.no_clobber) checkNotThere(output.path);
    if (output.no_mkdir)
        checkFolderIsThere(withLinksFollowed(output.path).parent_path(), output.path);
    checkLayerFiles(output, inputs);
    checkFilesBeside(output, inputs);
}

void checkTargets(OutputRequest output, std::span<const fs::path> files,
                  const SequenceOptions& options, const std::vector<fs::path>& inputs) {
    if (options.skip_existing || options.keep_going || options.dry_run) output.no_clobber = false;
    for (const fs::path& file : files) {
        output.path = file;
        checkTarget(output, inputs);
    }
    if (!files.empty() && !options.keep_going) checkFolder(files.front());
}

std::vector<fs::path> checkSeries(const OutputRequest& output, std::span<const int> numbers,
                                  const std::vector<fs::path>& inputs) {
    if (!hasFrameToken(output.path.string())) {
        checkTarget(output, inputs);
        return {output.path};
    }
    std::vector<fs::path> files;
    OutputRequest file = output;
    for (const int number : numbers) {
        file.path = framePath(output.path.string(), number);
        checkTarget(file, inputs);
        files.push_back(file.path);
    }
    return files;
}

void checkOutput(const OutputRequest& output, const std::vector<fs::path>& inputs) {
    checkFormat(output);
    checkTarget(output, inputs);
    checkFolder(output.path);
}

void checkExtraFile(const fs::path& file, const std::vector<fs::path>& others,
                    const std::string& what, const std::string& option) {
    for (const fs::path& other : others) {
        if (!sameFile(file, other) && !isExrLayerFile(file.string(), other.string())) continue;
        throw Error(ErrorKind::kUsage, what + " would replace the input or the output",
                    option + " " + file.string(), "choose another name for it");
    }
    checkFolder(file);
}

void checkReport(const ReportOptions& options, const std::vector<fs::path>& others) {
    const auto on_stdout = [](const fs::path& file) { return isStandardOutput(file.string()); };
    if (options.json && std::ranges::any_of(others, on_stdout))
        refuse("standard output cannot take both the picture and the result", "--json",
               "write the result to a file: --report FILE");
    if (options.file) checkExtraFile(*options.file, others, "the report", "--report");
}

void checkSceneFiles(const Scene& scene, const std::vector<fs::path>& outputs) {
    const std::set<fs::path> files(scene.files.begin(), scene.files.end());
    for (const fs::path& output : outputs) {
        std::error_code failure;
        if (!files.contains(fs::weakly_canonical(fs::absolute(output, failure), failure))) continue;
        throw Error(ErrorKind::kUsage, "this would replace a file of the scene", output.string(),
                    "choose another name");
    }
}

}  // namespace peeler::cmd
