# SPDX-License-Identifier: Apache-2.0
"""Translation of keywords to command-line options, and of command-line texts to keywords.

verbs.json describes the options of all verbs, as `peeler VERB --help` does; the build writes it.
"""

import functools
import json
import keyword as words
import os
import re
from collections.abc import Mapping

from ._error import Error

# Options that this module sets itself.
OWN = {"help", "json", "quiet", "verbose", "progress"}

RENDER_GROUPS = {"Camera", "Picture", "Layers", "Clipping", "Light", "Channels"}
RAYS_GROUPS = {"Rays", "Camera", "Picture"}
TIME = {"animation", "time"}
SCENE = (
    "scene", "include", "exclude", "allow_outside", "ignore_extension", "smooth_normals", "unit", "up", "variant",
    "transmission", "environment", "environment_rotation", "normalize", "strict",
)  # fmt: skip
MACHINE = ("device", "backend", "memory", "require_gpu", "threads")
# Options for writing pictures, for all verbs.
SAVE = (
    "as_", "layout", "compression", "no_composite", "deep_merge", "deep_z_tolerance", "deep_alpha_tolerance",
    "deep_error", "deep_keep", "dense", "fill", "dense_type", "compress", "cryptomatte", "background", "exposure", "tone_map", "no_clobber", "no_mkdir",
)  # fmt: skip
BAKE_GROUPS = {"Baking"}
VIEWS = ("around", "distance", "seed", "size", "fov", "near", "far", "animation")
# Calibrated cameras as arrays, in addition to --intrinsics and --pose.
CALIBRATED = ("K", "world_to_camera", "gltf", "pixel_center")


@functools.lru_cache(maxsize=None)
def description():
    with open(os.path.join(os.path.dirname(__file__), "verbs.json"), encoding="utf-8") as file:
        return json.load(file)


def keyword_of(option):
    """Returns the keyword for an option: ortho_height for --ortho-height, as_ for --as."""
    name = option.lstrip("-").replace("-", "_")
    return name + "_" if words.iskeyword(name) else name


@functools.lru_cache(maxsize=None)
def table(verb):
    """Returns the options of a verb as {keyword: (name with dashes, description)}."""
    return {
        keyword_of(name): (name, option)
        for option in description()["verbs"][verb]["options"]
        for name in option["names"]
        if name.startswith("--") and keyword_of(name) not in OWN
    }


def _grouped(verb, groups, more=(), but=()):
    return {k: o for k, o in table(verb).items() if (o[1]["group"] in groups or k in more) and k not in but}


@functools.lru_cache(maxsize=None)
def keywords(call):
    """Returns the keywords of a function or method: {keyword: (name, description)}. "hits" is Renderer.rays()."""
    if call == "Scene":
        return {k: table("info" if k == "up" else "render")[k] for k in SCENE}
    if call == "Renderer":
        return {k: table("render")[k] for k in MACHINE}
    if call == "views":
        return {k: table("render")[k] for k in VIEWS}
    if call == "save":
        return {k: table("render")[k] for k in SAVE}
    if call == "read":
        return {k: table("convert")[k] for k in ("part", "view", "strict")}
    if call in ("layers", "composite"):
        but = set(SCENE) - {"up", "strict"} | {"manifest"}
        if call == "composite":
            but |= {"channels", "cryptomatte"}
        return _grouped("render", RENDER_GROUPS, TIME | {"strict"}, but)
    if call == "hits":
        return _grouped("rays", RAYS_GROUPS, TIME | {"columns", "engine"}, {"no_refine"})
    if call == "ray_maps":
        return {**keywords("hits"), **_grouped("rays", (), {"map", "attenuation", "part"})}
    if call == "voxels":
        return _grouped("rays", {"Rays"}, TIME | {"engine"}, {"no_refine"})
    if call == "parity":
        return keywords("hits")
    if call == "bake_scene":
        return _grouped("bake", BAKE_GROUPS, TIME)
    return table(call)


@functools.lru_cache(maxsize=None)
def _all_options():
    return {name for verb in description()["verbs"].values() for option in verb["options"] for name in option["names"]}


# An option on its own, but not a part of a path such as "out--size.exr".
_OPTION = re.compile(r"(?<![\w./-])--[a-z][a-z-]*(?![\w/-]|\.\w)")


def in_keywords(text, names=()):
    """Returns a command-line text with keywords instead of options: "ortho_height" for "--ortho-height".

    names: {keyword: the caller's name for it}
    """
    text = re.sub(r"see peeler ([a-z]*) ?--help", "see help(peeler)", text)
    text = re.sub(r"\bpeeler (devices|info|check|verify|convert|merge|flatten)\b", r"peeler.\1()", text)
    names = dict(names)
    return _OPTION.sub(lambda found: names.get(keyword_of(found[0]), keyword_of(found[0])) if found[0] in _all_options()
                       else found[0], text)


def path_of(path):
    """Returns a path of any type (str, bytes, PathLike) as text."""
    text = os.fsdecode(path)
    if not text:
        raise Error("usage", "the name is empty", "path")
    try:
        text.encode()
    except UnicodeEncodeError:
        raise Error("usage", "the name is not UTF-8", ascii(text), "rename the file") from None
    return text


def _plain(value):
    """Converts an array to a list or number."""
    return value.tolist() if hasattr(value, "tolist") else value


def _is_text(value):
    return isinstance(value, (str, bytes, os.PathLike))


def _is_number(value):
    if isinstance(value, bool):
        return False
    return hasattr(value, "__index__") or (hasattr(value, "__float__") and not hasattr(value, "__len__"))


def _scalar(keyword, value):
    if isinstance(value, str):
        return value
    if _is_text(value):
        return path_of(value)
    if not _is_number(value):
        kind = type(value).__name__
        raise Error("usage", f"expected a number, a string or a sequence of them, not {kind}", keyword)
    if hasattr(value, "__index__"):
        return str(value.__index__())
    return repr(float(value))  # the shortest digits that read back as the number


def _scalars(keyword, value):
    """Returns all numbers and texts in nested sequences, as texts."""
    value = _plain(value)
    if _is_text(value) or not hasattr(value, "__iter__"):
        return [_scalar(keyword, value)]
    return [text for item in value for text in _scalars(keyword, item)]


def _texts(keyword, option, value):
    """Returns the texts of a value. The option is repeated for each text."""
    value = _plain(value)
    if isinstance(value, Mapping):  # attenuation={"steel": 0.5}
        return [f"{_scalar(keyword, k)}={_scalar(keyword, _plain(v))}" for k, v in value.items()]
    if option.get("repeated") and not _is_text(value) and hasattr(value, "__iter__"):
        value = list(value)
        if not all(_is_number(_plain(item)) for item in value):  # several vectors, or names
            return [",".join(_scalars(keyword, item)) for item in value]
    return [("x" if option["value"].startswith("WxH") else ",").join(_scalars(keyword, value))]


def refuse_unknown(call, name, known):
    import difflib

    nearest = difflib.get_close_matches(name, known, 1)
    hint = f"; did you mean '{nearest[0]}'?" if nearest else ""
    raise TypeError(f"{call}() got an unexpected keyword argument '{name}'{hint}")


def check(call, given, more=()):
    """Raises TypeError for an unknown keyword, with the nearest name."""
    known = keywords(call)
    for name in given:
        if name not in known and name not in more:
            refuse_unknown("rays" if call == "hits" else call, name, [*known, *more])


def arguments(verb, given, place=lambda path: path):
    """Returns the arguments of a verb for keywords: "--size=640x480", …

    True and False are flags and their opposites, None is left out, sequences are joined by commas ("x" for a size),
    and numbers keep all their digits. place(path) returns the worker's name of a file.
    """
    known, texts = table(verb), []
    for keyword, value in given.items():
        if value is None:
            continue
        name, option = known[keyword]
        if option["value"]:
            if isinstance(value, bool):
                raise Error("usage", "expected a value, not True or False", keyword)
            literals = option["value"].split("|")
            for text in _texts(keyword, option, value):
                if option.get("file") and text and text not in literals:
                    text = place(path_of(text))
                texts.append(f"{name}={text}")
            continue
        opposite = "--" + name[5:] if name.startswith("--no-") else "--no-" + name[2:]
        if value:
            texts.append(name)
        elif opposite in option["names"]:
            texts.append(opposite)
    return texts


def help_of(verb, call=None):
    """Returns the options of a verb as keywords, for help()."""
    lines = []
    seen = set()
    for keyword, (_, option) in keywords(call or verb).items():
        if id(option) in seen:
            continue
        seen.add(id(option))
        lines.append(f"    {keyword}: {option['value'] or 'bool'}\n        {in_keywords(option['help'])}")
        lines += [f"        - {choice}" for choice in option["choices"]]
    lines.append("    progress: callable\n        called with the share of the work that is done, 0 to 1")
    return "\n".join(lines) + "\n"
