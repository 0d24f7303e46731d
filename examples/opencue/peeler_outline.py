#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Submits frames to OpenCue: chunks of them for peeler, then a check of all OpenEXR files.

    python3 peeler_outline.py SCENE OUT.@@@@.####.exr FRAMES [--chunk N] [-- --views 8, more options of peeler render]
    python3 peeler_outline.py --verb flatten IN.####.exr OUT.####.png FRAMES [-- options of peeler flatten]

Needs PyOutline."""

import argparse
import os
import re
import shlex
import sys

import outline
import outline.cuerun
import outline.modules.shell


def shell_line(words):
    """Returns the words as a shell command: Cuebot replaces the #TOKENS#, and RQD passes the line to a shell."""
    return [shlex.quote(word) for word in words]


def job(arguments, options):
    out = os.path.abspath(arguments.out)
    folder, name = os.path.split(out)
    # A shell glob that matches every frame number, with the rest of the name quoted.
    everyone = "*".join(shlex.quote(part) for part in re.split(r"[#@]+|%0?\d*d", name) if part)

    # One process makes the frames of one chunk (5-9, or 5-13x2).
    render = outline.modules.shell.Shell(
        arguments.verb,
        command=shell_line(
            [
                arguments.peeler,
                arguments.verb,
                os.path.abspath(arguments.scene),
                "-o",
                out,
                "--frames=#FRAMESPEC#",
                "--skip-existing",
                "--progress=plain",
                *options,
            ]
        ),
        range=arguments.frames,
        chunk=arguments.chunk,
        memory=arguments.memory,
        threadable=True,
    )
    result = outline.Outline(f"peeler_{os.path.splitext(os.path.basename(arguments.scene))[0]}")
    result.add_layer(render)
    if not out.endswith(".exr"):
        return result
    verify = outline.modules.shell.Shell(
        "verify",
        command=shell_line([arguments.peeler, "verify"]) + [f"{shlex.quote(folder)}/{everyone}"],
        range="1",
    )
    result.add_layer(verify)
    verify.depend_all(render)
    return result


def main():
    parser = argparse.ArgumentParser(epilog="What follows -- goes to the verb.")
    parser.add_argument("--verb", default="render", help="flatten, convert, merge, view, extract or sheet for files")
    parser.add_argument("scene")
    parser.add_argument("out", metavar="OUT.####.exr")
    parser.add_argument("frames")
    parser.add_argument("--chunk", type=int, default=10)
    parser.add_argument("--memory", default="4g", help="that OpenCue reserves at first")
    parser.add_argument("--peeler", default="peeler", help="the program on the hosts")
    words = sys.argv[1:]
    end = words.index("--") if "--" in words else len(words)
    # pycuerun is not used, because only Cuebot knows #FRAMESPEC#.
    outline.cuerun.launch(job(parser.parse_args(words[:end]), words[end + 1 :]), use_pycuerun=False)


if __name__ == "__main__":
    main()
