# SPDX-License-Identifier: Apache-2.0
"""Expands an Open Job Description template as a render manager does: into steps, tasks and command lines.

Supports the part of "Template Schemas [Version: 2023-09]" (OpenJobDescription/openjd-specifications, wiki) that
examples/openjd uses, and rejects the rest. Square brackets give section numbers of that document.
"""

import os
import re

import yaml

# The allowed names of each kind of object; names with * are required.
OBJECTS = {
    # the template itself [1.1]
    "template": "specificationVersion* extensions name* description parameterDefinitions steps*",
    "STRING": "name* type* description default allowedValues minLength maxLength",  # [2.1]
    "PATH": "name* type* description default objectType dataFlow",  # [2.2]
    "INT": "name* type* description default minValue maxValue",  # [2.3]
    "step": "name* description dependencies hostRequirements parameterSpace script*",  # [3]
    "space": "taskParameterDefinitions*",  # [3.4]
    "CHUNK[INT]": "name* type* range* chunks*",  # [3.4.1.5]
    "chunks": "defaultTaskCount* targetRuntimeSeconds rangeConstraint*",  # [3.4.1.5]
    "script": "actions* embeddedFiles",  # [3.5]
    "action": "command* args timeout cancelation",  # [5]
    "NOTIFY_THEN_TERMINATE": "mode* notifyPeriodInSeconds",  # [5.3.2]
    "file": "name* type* filename runnable data*",  # [6.1]
}


class Invalid(Exception):
    pass


def require(condition, what):
    if not condition:
        raise Invalid(what)


def check(kind, value):
    names = OBJECTS[kind].split()
    allowed = {name.rstrip("*") for name in names}
    needed = {name[:-1] for name in names if name.endswith("*")}
    require(isinstance(value, dict), f"{kind} is no object")
    require(not value.keys() - allowed, f"{kind}: unknown {value.keys() - allowed}")
    require(not needed - value.keys(), f"{kind}: no {needed - value.keys()}")
    if "name" in value and kind not in ("template", "step"):
        require(
            re.fullmatch(r"[A-Za-z_]\w{0,63}", value["name"]), f"no identifier: {value['name']}"
        )  # [7.1]
    return value


def resolve(text, values):
    """Replaces the format strings in a text by their values [7.3]."""

    def value(match):
        require(match[1] in values, f"{match[0]} is not known here")
        return str(values[match[1]])

    return re.sub(r"\{\{\s*([\w.]+)\s*\}\}", value, str(text))


def integers(expression):
    """Returns the values of an <IntRangeExpr> [3.4.1.1.1], in increasing order."""
    values, ranges = [], []
    for element in expression.split(","):
        match = re.fullmatch(r"\s*(-?\d+)(?:\s*-\s*(-?\d+)(?::(-?\d+))?)?\s*", element)
        require(match, f"no range: {element}")
        first, last, step = int(match[1]), int(match[2] or match[1]), int(match[3] or 1)
        require(step != 0, f"a step of nothing: {element}")
        values += [first, *range(first, last + (1 if step > 0 else -1), step)[1:]]
        ranges.append(
            (min(first, last), max(first, last)) if step < 0 else (first, max(first, last))
        )
    ranges.sort()
    overlap = any(one[1] >= other[0] for one, other in zip(ranges, ranges[1:]))
    require(not overlap, f"ranges overlap: {expression}")
    return sorted(values)


def range_expression(values):
    """Returns an <IntRangeExpr> for increasing integers; pairs are written as in the conformance tests."""
    parts, at = [], 0
    while at < len(values):
        end = at + 1
        step = values[end] - values[at] if end < len(values) else 1
        while end < len(values) and values[end] - values[end - 1] == step:
            end += 1
        if end - at < 3:
            parts.append(str(values[at]))
            at += 1
        else:
            parts.append(f"{values[at]}-{values[end - 1]}" + (f":{step}" if step != 1 else ""))
            at = end
    return ",".join(parts)


def chunked(values, size):
    """Splits the values into the fewest chunks of at most `size` values, as evenly as possible."""
    require(size >= 1, "chunks of nothing")
    count = -(-len(values) // size)
    sizes = [len(values) // count + (i < len(values) % count) for i in range(count)]
    return [values[sum(sizes[:i]) : sum(sizes[: i + 1])] for i in range(count)]


class Job:
    def __init__(self, file, values, folder):
        """`values` are the parameters of a job that is submitted from `folder`."""
        with open(file, encoding="utf-8") as text:
            self.template = check("template", yaml.safe_load(text))
        require(self.template["specificationVersion"] == "jobtemplate-2023-09", "another version")
        self.values = {}
        for definition in self.template.get("parameterDefinitions", []):
            check(definition["type"], definition)
            name = definition["name"]
            require(name in values or "default" in definition, f"no value for {name}")
            value = values.pop(name, None)
            if definition["type"] == "PATH":  # [7.4]: relative to the folder from which the job is submitted
                value = (
                    os.path.join(folder, value)
                    if value is not None
                    else os.path.join(os.path.dirname(file), definition["default"])
                )
            elif value is None:
                value = definition["default"]
            self.values[f"Param.{name}"] = self.values[f"RawParam.{name}"] = value
        require(not values, f"unknown parameters: {values}")
        self.name = resolve(self.template["name"], self.values)
        self.steps = [check("step", step) for step in self.template["steps"]]
        for index, step in enumerate(self.steps):  # [3.2]
            earlier = [other["name"] for other in self.steps[:index]]
            for dependency in step.get("dependencies", []):
                require(
                    dependency["dependsOn"] in earlier,
                    f"in this order {step['name']} cannot be run",
                )

    def tasks(self, step):
        """Returns [{name of a task parameter: its value}], one element per run of the step's action."""
        if "parameterSpace" not in step:
            return [{}]
        definitions = check("space", step["parameterSpace"])["taskParameterDefinitions"]
        require(
            len(definitions) == 1 and definitions[0]["type"] == "CHUNK[INT]", "only chunks here"
        )
        require(
            "TASK_CHUNKING" in self.template.get("extensions", []), "TASK_CHUNKING is not asked for"
        )
        definition = check("CHUNK[INT]", definitions[0])
        chunks = check("chunks", definition["chunks"])
        require(chunks["rangeConstraint"] == "NONCONTIGUOUS", "only NONCONTIGUOUS here")
        values = integers(resolve(definition["range"], self.values))
        size = int(resolve(chunks["defaultTaskCount"], self.values))
        return [{definition["name"]: range_expression(chunk)} for chunk in chunked(values, size)]

    def command(self, step, task, session):
        """Returns the command line of a task that runs in the folder `session`, and writes the embedded files there."""
        script = check("script", step["script"])
        values = {**self.values, "Session.WorkingDirectory": session}
        for name, value in task.items():
            values[f"Task.Param.{name}"] = values[f"Task.RawParam.{name}"] = value
        files = [check("file", file) for file in script.get("embeddedFiles", [])]
        for file in files:
            require(file["type"] == "TEXT", "a file of another type")
            values[f"Task.File.{file['name']}"] = os.path.join(
                session, file.get("filename", file["name"])
            )
        for file in files:  # [6.1]
            path = values[f"Task.File.{file['name']}"]
            with open(path, "w", encoding="utf-8") as out:
                out.write(resolve(file["data"], values))
            os.chmod(path, 0o500 if file.get("runnable") else 0o400)
        require(set(script["actions"]) == {"onRun"}, "a step has one action, onRun")  # [3.5.1]
        action = check("action", script["actions"]["onRun"])
        if "cancelation" in action:
            check(action["cancelation"]["mode"], action["cancelation"])
        return [resolve(word, values) for word in (action["command"], *action.get("args", []))]
