# SPDX-License-Identifier: Apache-2.0
"""Writes the stub of the package: write_stub.py PACKAGE

stub.pyi is written by hand. The keywords for options come from the package's verbs.json.
"""

import importlib.util
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
MARK = re.compile(r"^( *)\*\*(\w+): Options,\n", re.MULTILINE)

# Types by the value's name in the command line's help.
NUMBER, INTEGER, TEXT = "float", "int", "str"
VALUES = {
    "N": INTEGER, "A": NUMBER, "R": NUMBER, "D": NUMBER, "H": NUMBER, "K": "int | str", "PIXELS": INTEGER, "X": NUMBER, "DB": NUMBER, "MM": NUMBER,
    "MU": NUMBER, "DEGREES": NUMBER, "SECONDS": NUMBER, "STOPS": NUMBER, "SET": INTEGER, "I/N": TEXT,
    "SIZE": "str | int", "BYTES": "str | int", "NAME": TEXT, "NAME|INDEX": "str | int", "NAME|INDEX|auto": "str | int",
    "NAME|INDEX|all": "str | int", "GLOB|ID": "str | int", "x|y|z": "Literal['x', 'y', 'z']", "NODE": "str | int",
    "METRES": NUMBER, "VALUE": "float | str", "WxH|W": "Sequence[int] | int", "WxH": "Sequence[int]",
    "COLOR": "str | Numbers", "MATRIX": "ArrayLike", "X,Y,Z|x|y|z": "Numbers | Literal['x', 'y', 'z']",
    "MATERIAL=MU": "Mapping[str, float] | str", "all": "Literal['all']", "DEVICE": "str | int",
}  # fmt: skip
BY_KEYWORD = {
    "resolution": INTEGER, "voxels": INTEGER, "device": "str | int", "fps": NUMBER, "canvas": NUMBER,
}  # fmt: skip


def value_type(keyword, option):
    """Returns the type of one value of an option."""
    if not option["value"]:
        return "bool"
    names = [repr(choice) for choice in option["choices"]]
    if names:
        if option.get("list") and option["value"].endswith("|all"):
            names.append("'all'")
        return f"Literal[{', '.join(names)}]" + (" | float" if "METRES" in option["value"] else "")
    if keyword in BY_KEYWORD:
        return BY_KEYWORD[keyword]
    if option.get("file"):
        return "Path"
    if option["value"] in VALUES:
        return VALUES[option["value"]]
    kinds = []
    for part in option["value"].split("|"):
        kind = VALUES.get(part, "Numbers" if "," in part else TEXT if part.isupper() else f"Literal[{part!r}]")
        if kind not in kinds:
            kinds.append(kind)
    return " | ".join(kinds)


def parameter(keyword, option):
    kind = value_type(keyword, option)
    if option.get("list") or (option.get("repeated") and not kind.startswith("Mapping")):
        kind = f"{kind} | Sequence[{kind}]"
    if option.get("required"):
        return f"{keyword}: {kind},"
    return f"{keyword}: {kind}{' | None' if kind != 'bool' else ''} = ...,"


def parameters(indent, options):
    return "".join(f"{indent}{parameter(keyword, option)}\n" for keyword, (_, option) in options.items())


def main(package):
    # Does not run the package's __init__.py, because that needs NumPy, which the build machine may
    # lack.
    spec = importlib.util.spec_from_file_location(
        "peeler", package / "__init__.py", submodule_search_locations=[str(package)]
    )
    sys.modules["peeler"] = importlib.util.module_from_spec(spec)
    from peeler import _options, _verbs

    text = (HERE / "stub.pyi").read_text(encoding="utf-8")
    text = MARK.sub(lambda found: parameters(found[1], _options.keywords(found[2])), text)
    for name in _verbs.NAMES:
        keywords = parameters("    ", _options.table(name))
        text += f"def {name}(\n    *files: Path,\n{keywords}    progress: Progress | None = ...,\n"
        text += ") -> dict[str, Any]: ...\n"
    (package / "__init__.pyi").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve())
