# SPDX-License-Identifier: Apache-2.0
"""Tests that all files, sections, links, pictures and options exist to which documents and comments refer."""

import os
import pathlib
import re
import sys
import unittest

from peeler_command import SOURCE, main, peeler

NOT_OURS = {".git", "build", ".cache", "__pycache__"}
COMMENTED = {
    *(".h", ".cpp", ".glsl", ".frag", ".vert", ".comp", ".cmake", ".py", ".sh", ".html"),
    *(".yaml", ".sbatch", ".txt"),
}
# A citation such as "core/README.md, "Order"": a path from the repository's root, with an optional heading of that
# file.
CITED = re.compile(r'(?<![\w./*-])([\w-][\w./-]*\.md)\b(?:, "([^"]+)")?')
LINK = re.compile(r"\]\(([^)\s]+)\)")
LONGEST_README = 130
# The markers of an unfinished merge.
CONFLICT = re.compile(r"^(?:<{7}|>{7}) ", re.M)
# Options of other programs, which our documents may mention.
FOREIGN = {"--prefix", "--version", "--help", "--cpus-per-task"}


def files():
    for folder, folders, names in os.walk(SOURCE):
        folders[:] = [name for name in folders if name not in NOT_OURS and "build-" not in name]
        for name in names:
            yield pathlib.Path(folder, name)


def documents():
    return sorted(path for path in files() if path.suffix == ".md")


def without_blocks(text):
    return re.sub(r"^```.*?^```$", "", text, flags=re.M | re.S)


def headings(text):
    """Returns the headings as comments cite them, without markup."""
    found = re.findall(r"^#+ +(.*?) *$", without_blocks(text), re.M)
    return [heading.replace("`", "") for heading in found]


def anchor(heading):
    """Returns the anchor that GitHub gives to a heading."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def running_text(text):
    """Returns the text without line breaks and comment signs, so that a citation may span two lines."""
    return re.sub(r"\s*\n\s*(?://+<?|#|\*)?\s*", " ", text)


def dead_citations(text, root):
    """Yields the cited documents and sections that do not exist."""
    for name, section in CITED.findall(running_text(text)):
        if not (root / name).is_file():
            yield f"there is no {name}"
        elif section and section not in headings((root / name).read_text(encoding="utf-8")):
            yield f'{name} has no section "{section}"'


def dead_links(text, path):
    """Yields the relative links of a document whose targets do not exist."""
    for target in LINK.findall(without_blocks(text)):
        if re.match(r"[a-z]+:", target):
            continue
        name, _, place = target.partition("#")
        linked = (path.parent / name) if name else path
        if not linked.exists():
            yield f"there is no {target}"
        elif place and place not in map(anchor, headings(linked.read_text(encoding="utf-8"))):
            yield f"no heading of {name or path.name} is called {place}"


def conflicts(text):
    return bool(CONFLICT.search(text))


class Documents(unittest.TestCase):
    def test_comments_cite_what_is_there(self):
        dead, cited = [], 0
        for path in files():
            if path.suffix not in COMMENTED and path.name != "Dockerfile":
                continue
            if path == pathlib.Path(__file__):
                continue
            text = path.read_text(encoding="utf-8", errors="replace")
            cited += len(CITED.findall(running_text(text)))
            dead += [f"{path.relative_to(SOURCE)}: {what}" for what in dead_citations(text, SOURCE)]
        self.assertEqual(dead, [])
        self.assertGreater(cited, 5)

    def test_links_lead_somewhere(self):
        dead = []
        for path in documents():
            text = path.read_text(encoding="utf-8")
            dead += [f"{path.relative_to(SOURCE)}: {what}" for what in dead_links(text, path)]
        self.assertEqual(dead, [])

    def test_every_picture_is_shown(self):
        shown = "".join(path.read_text(encoding="utf-8") for path in documents())
        pictures = sorted(path.name for path in (SOURCE / "examples" / "images").iterdir())
        self.assertEqual([name for name in pictures if f"images/{name})" not in shown], [])

    def test_no_merge_is_left_half_done(self):
        kinds = {*COMMENTED, ".md", ".json"}
        texts = (path for path in files() if path.suffix in kinds)
        left = [path.relative_to(SOURCE) for path in texts if conflicts(path.read_text(errors="replace"))]
        self.assertEqual(left, [])

    def verbs(self):
        found = re.findall(r"^  ([a-z]+) +[A-Z]", peeler("--help").stdout, re.M)
        self.assertGreater(len(found), 10)
        return found

    def test_every_verb_is_told_of(self):
        readme = (SOURCE / "README.md").read_text(encoding="utf-8")
        document = (SOURCE / "cmd" / "README.md").read_text(encoding="utf-8")
        section = document.partition("## Verbs\n")[2].partition("\n## ")[0]
        self.assertEqual([verb for verb in self.verbs() if f"`{verb}`" not in section], [])
        self.assertEqual([verb for verb in self.verbs() if f"peeler {verb}" not in readme], [])

    def test_options_are_the_programs(self):
        known = set(FOREIGN)
        for verb in self.verbs():
            known.update(re.findall(r"--[a-z][a-z-]*", peeler(verb, "--help", "all").stdout))
        guides = [*(SOURCE / "examples" / "guide").glob("*.md"), SOURCE / "README.md"]
        rooms = [SOURCE / name / "README.md" for name in ("core", "formats", "cmd")]
        for path in [*guides, *rooms]:
            text = without_blocks(path.read_text(encoding="utf-8"))
            told = " ".join(re.findall(r"`[^`]*`", text))
            options = set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", told))
            self.assertEqual(sorted(options - known), [], path)

    def test_readme_is_short(self):
        lines = (SOURCE / "README.md").read_text(encoding="utf-8").splitlines()
        self.assertLessEqual(len(lines), LONGEST_README)


class Finding(unittest.TestCase):
    """Proves that these checks can fail."""

    def test_citations(self):
        text = '// core/README.md (core/README.md,\n/// "Order"; core/README.md, "Chaos") and lost.md.'
        self.assertEqual(
            list(dead_citations(text, SOURCE)),
            ['core/README.md has no section "Chaos"', "there is no lost.md"],
        )

    def test_links(self):
        path = SOURCE / "README.md"
        text = "[a](core) [b](core/README.md#order) [c](lost.md) [d](core/README.md#chaos)"
        self.assertEqual(
            list(dead_links(text, path)),
            ["there is no lost.md", "no heading of core/README.md is called chaos"],
        )

    def test_conflicts(self):
        self.assertTrue(conflicts("one\n" + "<" * 7 + " HEAD\ntwo"))
        self.assertFalse(conflicts("a table\n=======\n"))


if __name__ == "__main__":
    sys.exit(main())
