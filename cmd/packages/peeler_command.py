# SPDX-License-Identifier: Apache-2.0
"""The command `peeler` of the wheel. It is no part of the package `peeler`, whose import takes longer than most
commands."""

import os
import sys


def main():
    program = os.path.join(os.path.dirname(os.path.abspath(__file__)), "peeler", "program", "bin", "peeler")
    os.execv(program, ["peeler", *sys.argv[1:]])
