# SPDX-License-Identifier: Apache-2.0
"""The package's exception."""


class Error(Exception):
    """Raised by everything in peeler.

    kind: 'usage' (an invalid request), 'input' (a file is unreadable or invalid), 'output' (a file cannot be written),
        'device' (no usable GL device, or it was lost), 'incomplete', 'memory', 'internal' (a bug in peeler, or its
        process ended)
    what: the problem, a sentence without a full stop
    where: a path, a keyword, a place in a glTF file ('/meshes/0/primitives/1'), or ''
    hint: a remedy, or ''
    """

    def __init__(self, kind, what, where="", hint=""):
        super().__init__(kind, what, where, hint)
        self.kind, self.what, self.where, self.hint = kind, what, where, hint

    def __str__(self):
        text = f"{self.what}: {self.where}" if self.where else self.what
        return f"{text}\n{self.hint}" if self.hint else text


Error.__module__ = "peeler"
