# SPDX-License-Identifier: Apache-2.0
"""Verbs of the command line as functions, from files to files."""

import inspect

from . import _options, _worker
from ._error import Error

# The verbs that return data. `batch` and `worker` run jobs instead.
NAMES = (
    "bake", "check", "compare", "convert", "devices", "extract", "flatten", "holdout", "info", "masks", "merge", "rays",
    "render", "sheet", "verify", "view",
)  # fmt: skip


def _run(name, files, keywords):
    progress = keywords.pop("progress", None)
    _options.check(name, keywords, ("progress",))
    arguments = _options.arguments(name, keywords, _worker.place)
    for argument in arguments:
        if argument.startswith("--output=-"):
            raise Error("usage", "standard output is not available here", "output", "name a file")
    return _worker.run(name, [*map(_worker.file_argument, files), *arguments], progress=progress)


def function(name):
    def verb(*files, **keywords):
        return _run(name, files, keywords)

    verb.__name__ = verb.__qualname__ = name
    verb.__module__ = "peeler"
    summary = _options.in_keywords(_options.description()["verbs"][name]["summary"])
    verb.__doc__ = (
        f"{summary}\n\nDoes the same as `peeler {name}`, with its options as keywords; returns its JSON as a dict.\n"
        f"Raises peeler.Error.\n\n{_options.help_of(name)}"
    )
    keyword_only = [
        inspect.Parameter(keyword, inspect.Parameter.KEYWORD_ONLY, default=None)
        for keyword in [*_options.table(name), "progress"]
    ]
    verb.__signature__ = inspect.Signature(
        [inspect.Parameter("files", inspect.Parameter.VAR_POSITIONAL), *keyword_only]
    )
    return verb
