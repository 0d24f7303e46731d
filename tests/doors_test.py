# SPDX-License-Identifier: Apache-2.0
"""Tests that the product has a single place for each of these tasks: writing and parsing JSON, finding and opening
files, escaping strings, and opening GL contexts.

Searches all sources of the product for other code that could throw, wait for a pipe, or print the text of a file.
"""

import pathlib
import re
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[1]
LIBRARIES = ("core", "formats", "cmd")
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)

# Forbidden code: a name, the pattern, the replacement, and the exempt files with their reasons.
DOORS = (
    (
        "text of JSON",
        re.compile(r"(?:\.|->)dump\s*\("),
        "dumpJson() of formats/file/json_text.h, which never throws",
        {"formats/file/json_text.cpp": "it is that place"},
    ),
    (
        "JSON put into a stream, which throws likewise",
        re.compile(r"<<\s*(?:json|Json|nlohmann::\w+)\s*[({;]"),
        "dumpJson() of formats/file/json_text.h",
        {},
    ),
    (
        "JSON parsed",
        re.compile(r"\b(?:[Jj]son|ordered_json|Value)::(?:parse|accept|sax_parse|from_\w+)\s*\("),
        "parseJson() of formats/file/json_text.h, which limits depth and messages",
        {
            "formats/file/json_text.cpp": "it is that place",
            "cmd/cli/job_line.cpp": "it refuses keys that are there twice, after checkJsonDepth()",
        },
    ),
    (
        "a file opened by a stream",
        re.compile(r"\b(?:std::)?(?:i|f)fstream\b|\bstd::fstream\b|\bfilebuf\b"),
        "RegularFile or readRegularText() of formats/file/regular_file.h, which wait for nothing",
        {
            "cmd/machine/resources.cpp": "/proc/self/status",
            "cmd/machine/limits.cpp": "/proc and cgroups",
            "core/gl/program.cpp": "shaders that a developer changes",
        },
    ),
    (
        "a file opened by C",
        re.compile(r"\b(?:std::)?f(?:re)?open(?:64)?\s*\(|\bpopen\s*\("),
        "RegularFile of formats/file/regular_file.h",
        {
            "core/base/process_memory.cpp": "/proc/self/statm",
            "formats/modules/helper_main.cpp": "/proc/self/statm",
        },
    ),
    (
        "a file opened to be read by the system's call",
        re.compile(
            r"\bopen(?:File|at)?(?:64)?\s*\([^;{]*?\bO_RD(?:ONLY|WR)\b[^;{]*?\)|\bopen(?:File|at)?\s*\([^;{]*?\bkHow\b"
        ),
        "RegularFile of formats/file/regular_file.h",
        {
            "formats/file/regular_file.cpp": "it is that place",
            "formats/file/regular_file.h": "/dev/null",
            "formats/file/temporary_files.cpp": "folders, and files that it makes",
            "formats/file/atomic_file.cpp": "folders, and files that it makes (O_EXCL)",
            "cmd/batch/batch_report.cpp": "the report, which is appended to; it does not wait",
            "cmd/machine/child_process.cpp": "/dev/null",
            "cmd/packages/launcher.cpp": "a program of its own: the dynamic linker's files",
            "cmd/worker/job_process.cpp": "/dev/null",
        },
    ),
    (
        "a file opened by a library",
        re.compile(r"\bexr_start_read\s*\(|\bImf::\w*InputFile\b|->open\s*\(\s*path\b|ImageInput::open\s*\("),
        "a stream of that library on RegularFile",
        {
            "formats/exr/exr_input.cpp": "with read_fn of RegularFile",
            "formats/exr/exr_chunks.cpp": "the file that was just written",
            "formats/exr/exr_contradictions.cpp": "with a stream of RegularFile",
            "formats/exr/exr_classes.cpp": "with a stream of RegularFile",
            "formats/modules/image_library.cpp": "with a proxy of RegularFile",
        },
    ),
    (
        "a file asked for whether it is there, without a word of what cannot be told",
        re.compile(r"\b(?:fs|filesystem)::exists\s*\(|\bF_OK\b"),
        "fileExists(), isTaken() or isSeen() of formats/file/regular_file.h",
        {"formats/file/atomic_file.cpp": "it looks at what the status says itself"},
    ),
    (
        "a folder listed, or taken for empty where it cannot be",
        re.compile(r"(?<!recursive_)\bdirectory_iterator\b"),
        "namesIn() of formats/file/regular_file.h",
        {
            "formats/file/regular_file.cpp": "it is that place",
            "formats/file/temporary_files.cpp": "what killed processes left: what cannot be listed stays",
        },
    ),
    (
        "printing past the console",
        re.compile(r"\bstd::(?:cout|cerr|clog|printf|puts|perror)\b|\bf?printf\s*\(\s*(?:stdout|stderr)|\bstd::fputs\s*\([^;]*\bstd(?:out|err)\b"),
        "Console (cmd/cli/console.h), which escapes and cuts",
        {
            "cmd/main.cpp": "it makes the console",
            "cmd/packages/launcher.cpp": "a program of its own, before the console",
            "core/gl/context.cpp": "GL's own messages, for developers",
            "core/shading/write_constants.cpp": "a program of the build",
            "formats/image/write_font.cpp": "a program of the build",
            "cmd/manual/write_manual.cpp": "a program of the build",
        },
    ),
    (
        "a context of GL, or a scene uploaded to one",
        re.compile(r"\b(?:createContext|findGpuContext|make_unique<(?:peeler::)?GlRenderer>)\s*\("),
        "GlSession of core/capture/gl_session.h, which keeps both",
        {
            "core/capture/gl_session.cpp": "it is that place",
            "core/gl/context.h": "what that place calls",
            "core/gl/context.cpp": "likewise",
        },
    ),
)


def sources():
    return sorted(
        path for library in LIBRARIES for path in (SOURCE / library).rglob("*") if path.suffix in (".h", ".cpp")
    )


def without_comments(code):
    """Returns the code without comments, but with the same line numbers."""
    return COMMENT.sub(lambda comment: "\n" * comment[0].count("\n"), code)


def found_in(code, pattern):
    """Returns the line numbers of the matches."""
    code = without_comments(code)
    return [code.count("\n", 0, match.start()) + 1 for match in pattern.finditer(code)]


class Doors(unittest.TestCase):
    def test_there_is_no_other_way(self):
        errors = []
        texts = {path.relative_to(SOURCE).as_posix(): path.read_text(encoding="utf-8") for path in sources()}
        self.assertGreater(len(texts), 300)
        for what, pattern, instead, allowed in DOORS:
            for name, code in texts.items():
                lines = found_in(code, pattern)
                if name in allowed and not lines:
                    errors.append(f"{name}: has no {what} any more: take it out of the table")
                if name not in allowed:
                    errors += [f"{name}:{line}: {what}; use {instead}" for line in lines]
            errors += [f"{name}: there is no such file" for name in allowed if name not in texts]
        if errors:
            self.fail("\n" + "\n".join(errors))


class PlantedDoors(unittest.TestCase):
    """Proves that the checks can fail."""

    def test_each_is_found(self):
        planted = (
            "x = json.dump();",
            "out << json({1});",
            "nlohmann::json::parse(text)",
            "std::ifstream file(path);",
            'std::fopen(path, "r")',
            "const int file = ::open(path.c_str(),\n O_RDONLY | O_CLOEXEC);",
            "exr_start_read(&context, path, &options)",
            "if (std::filesystem::exists(path, failure)) return;",
            "for (const auto& entry : fs::directory_iterator(folder, failure))",
            'std::cerr << "text";',
            "context = gl::createContext(request);",
        )
        self.assertEqual(len(planted), len(DOORS))
        for code, (what, pattern, _, _) in zip(planted, DOORS):
            self.assertEqual(found_in("\n" + code, pattern), [2], what)
            self.assertEqual(found_in("// " + code.replace("\n", " "), pattern), [], what)

    def test_what_is_no_door(self):
        for code in ("void open();", "open(band);", "targets.dumped()", "sink.open(image, file)", "std::ofstream f;", "this->exists(asked)"):
            for what, pattern, _, _ in DOORS:
                self.assertEqual(found_in(code, pattern), [], what)


if __name__ == "__main__":
    unittest.main()
