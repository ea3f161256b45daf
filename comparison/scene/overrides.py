"""Dotted keys of a scene: overrides, the name, title and command that follow, and errors of validation."""

from __future__ import annotations

import difflib
import hashlib
import json
import re
import shlex
from collections.abc import Mapping, Sequence
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError

from comparison.scene.schema import MATERIALS, NAME, PARTNERS, SceneKeys, Unit

LONGEST = 54
"""Characters of a name that says what is changed: beside it there is room for a verdict in 80 columns."""
_FORMULATION = "solver.exudyn.formulation"
_SHOWN = {"m": (1e3, "mm"), "Pa": (1e-9, "GPa")}  # unit of a key -> that of a title, and the factor to it
_BARE = re.compile(r"(?!(true|false|inf|nan)$)[A-Za-z_][A-Za-z0-9_./-]*")  # no TOML: --set takes it as text
_PLAIN = re.compile(r"[\w-]+")  # a step of a key that is not quoted
_RULES = {
    "rule": "{text}",
    "greater_than": "must be > {gt:g}",
    "greater_than_equal": "must be >= {ge:g}",
    "less_than": "must be < {lt:g}",
    "less_than_equal": "must be <= {le:g}",
    "finite_number": "must be finite",
    "float_type": "must be a number",
    "int_type": "must be an integer",
    "int_from_float": "must be an integer",
    "bool_type": "must be true or false",
    "int_parsing_size": "is too large",
    "string_type": "must be a string",
    "list_type": "must be a list",
    "dict_type": "must be a section with keys of its own",
    "model_type": "must be a section with keys of its own",
    "model_attributes_type": "must be a section with keys of its own",
    "literal_error": "must be {expected}",
    "too_short": "must hold {min_length} values, not {actual_length}",
    "too_long": "must hold {max_length} values, not {actual_length}",
    "string_too_short": "must not be empty",
    "string_too_long": "must have at most {max_length} characters",
    "string_pattern_mismatch": "must be letters, digits and . _ + = - only: it names files",
    "missing": "is missing",
    "extra_forbidden": "is not a known key",
    "not_installed": "is not a known key: no model of this name is installed",
}
"""Type of a pydantic error -> what is said of the value."""


def apply(files: Mapping[str, Any], overrides: Mapping[str, object]) -> dict[str, Any]:
    """Return the keys of a scene's files with dotted keys changed.

    Exudyn's step and tolerance in a file are meant for the file's formulation. They have another meaning in
    another formulation chosen here: a step for the five bodies makes the tree take a hundred times its steps.
    """
    exudyn, wanted = _at(files, "solver.exudyn"), overrides.get(_FORMULATION)
    if isinstance(exudyn, Mapping) and wanted not in (None, exudyn.get("formulation", "auto")):
        kept = {key: value for key, value in exudyn.items() if key not in ("step", "tolerance")}
        files = {**files, "solver": {**files["solver"], "exudyn": kept}}
    given = dict(files)
    for dotted, value in overrides.items():
        below: Any = value
        for step in reversed(dotted.split(".")):
            below = {step: below}
        given = merged(given, below)
    return given


def merged(base: Mapping[str, Any], changes: Mapping[str, Any], section: str = "") -> dict[str, Any]:
    """Merge ``changes`` into ``base``, section by section.

    One partner's number over that of both leaves the other's as it is.
    """
    result = dict(base)
    for key, value in changes.items():
        below, dotted = result.get(key), f"{section}{key}"
        if dotted in MATERIALS and value and not isinstance(below, dict | None):
            below = dict.fromkeys(PARTNERS, below)
        both_sections = isinstance(below, dict) and isinstance(value, dict)
        result[key] = merged(below or {}, value, f"{dotted}.") if both_sections else value
    return result


def combine(
    files: Mapping[str, Any], overrides: Mapping[str, object], values: Mapping[str, object]
) -> dict[str, object]:
    """Return the overrides of a scene when dotted keys, of sections too, are changed once more.

    These are the single keys that then differ from its files.
    """
    values = _single("", values)
    formulation = overrides.get(_FORMULATION, _at(files, _FORMULATION) or "auto")
    result = dict(overrides)
    if values.get(_FORMULATION, formulation) != formulation:
        for key in ("solver.exudyn.step", "solver.exudyn.tolerance"):
            result.pop(key, None)
    for key, value in values.items():
        material = key.rpartition(".")[0]
        if key in MATERIALS:  # of both partners: replaces that of each
            result = {other: kept for other, kept in result.items() if not other.startswith(f"{key}.")}
        elif material in MATERIALS and material in result:
            result |= dict.fromkeys((f"{material}.{partner}" for partner in PARTNERS), result.pop(material))
        result[key] = value
    base = apply(files, {key: result[key] for key in (_FORMULATION,) if key in result})
    return {
        key: value
        for key, value in result.items()
        if not _same(value, _at(files if key == _FORMULATION else base, key))
    }


def _single(section: str, values: Mapping[str, object]) -> dict[str, object]:
    """Return the values of single keys; an empty section is one itself."""
    single: dict[str, object] = {}
    for key, value in values.items():
        dotted = f"{section}.{key}" if section else key
        single |= _single(dotted, value) if isinstance(value, Mapping) and value else {dotted: value}
    return single


def _at(keys: Mapping[str, Any], dotted: str) -> object:
    """Return the value of a dotted key, of a partner's that of both; None where there is none."""
    value: Any = keys
    for step in dotted.split("."):
        value = value.get(step) if isinstance(value, Mapping) else None
    material, _, partner = dotted.rpartition(".")
    if value is None and material in MATERIALS and partner in PARTNERS:
        both = _at(keys, material)
        return None if isinstance(both, Mapping) else both
    return value


def _same(value: object, before: object) -> bool:
    """Return whether a value would change nothing; true is not 1, nor is 1.0 where an integer has to be."""
    integer = type(value) is int and isinstance(before, float) and value == before
    return integer or _toml(value) == _toml(before)


def name_with(name: str, overrides: Mapping[str, object]) -> str:
    """Return a name for files: ``"ideal+drive.cycles=1"``, with a hash where that is too long or no name."""
    whole = "+".join([name, *(f"{key}={_text(value)}" for key, value in overrides.items())])
    if re.match(NAME, whole) and len(whole) <= LONGEST:
        return whole
    return f"{name[:LONGEST]}+{hashlib.sha256(whole.encode()).hexdigest()[:8]}"


def title_with(name: str, overrides: Mapping[str, object]) -> str:
    """Return a title: ``"150rpm-0.2mm with clearance.slider = 0.4 mm"``."""
    changes = []
    for key, value in overrides.items():
        text, unit = _text(value), _place(key.split("."))[1]
        if isinstance(value, float):
            factor, unit = _SHOWN.get(unit, (1.0, unit))
            text = f"{factor * value:.12g}"
        changes.append(f"{key} = {text} {unit}".rstrip())
    return f"{name} with {', '.join(changes)}"


def command_line(
    verb: str, sources: Sequence[str], overrides: Mapping[str, object], options: Sequence[str] = ()
) -> str:
    """Return the command ``sixbar`` that does something to scenes, quoted for a POSIX shell."""
    changes = [word for key, value in overrides.items() for word in ("--set", f"{key}={_text(value)}")]
    return shlex.join(["sixbar", verb, *sources, *changes, *options])


def _text(value: object) -> str:
    """Return a value as --set takes it."""
    return value if isinstance(value, str) and _BARE.fullmatch(value) else _toml(value)


def _toml(value: object) -> str:
    """Return a value as TOML."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{json.dumps(key)} = {_toml(part)}' for key, part in value.items())}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, float):
        return repr(float(value))  # numpy's are floats too, and say so
    if type(value) is int:
        return hex(value) if abs(value) > 10**100 else str(value)  # Python does not print thousands of digits
    # A string of JSON is one of TOML too, but for one character.
    return json.dumps(value, ensure_ascii=False, default=str).replace("\x7f", "\\u007f")


def explain(error: ValidationError, schema: type[BaseModel] = SceneKeys) -> str:
    """Phrase the first of pydantic's errors in one line: key, value, unit, rule.

    For an unknown key the nearest of the schema is suggested.
    """
    first = error.errors()[0]
    kind, value, context = first["type"], first["input"], first.get("ctx", {})
    steps = [str(step) for step in first["loc"]]
    if ".".join(steps[:2]) in MATERIALS:
        steps[2:3] = []  # the branch of the union, "number" or "partners"
    if "key" in context:  # of `schema.rule`
        steps, value = [*steps, *context["key"].split(".")], context.get("value")
    key = ".".join(step if _PLAIN.fullmatch(step) else repr(step) for step in steps) or "the file"
    text = _RULES[kind].format(**context) if kind in _RULES else " ".join(first["msg"].split())
    if kind == "missing":
        hint = ' (scene.extends = "paper" takes over the paper\'s numbers)' if schema is SceneKeys else ""
        return f"{key} {text}{hint}"
    section, unit = _place(steps, schema)
    if kind in ("extra_forbidden", "not_installed"):
        close = difflib.get_close_matches(steps[-1], section.model_fields if section else (), n=1)
        hint = f"; did you mean {'.'.join([*steps[:-1], *close])}?" if close else ""
        return f"{key} {text}{hint}"
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return f"{key} = {short(value)}{f' {unit}' if unit and number else ''} {text}"


def short(value: object) -> str:
    """Return a value as it was given, the middle left out where it is long."""
    try:
        text = repr(value)
    except ValueError:  # Python refuses to print integers of thousands of digits
        return "an integer of thousands of digits"
    return text if len(text) <= 120 else f"{text[:80]} ... {text[-20:]}"


def _place(steps: Sequence[str], schema: type[BaseModel] = SceneKeys) -> tuple[type[BaseModel] | None, str]:
    """Return the section that holds a key, None where there is none, and the key's unit, "" without one."""
    section: type[BaseModel] | None = None
    annotation: Any = schema
    unit = ""
    for step in steps:
        if get_origin(annotation) in (list, dict):
            annotation = get_args(annotation)[-1]
            continue
        section = _section(annotation)
        field = section.model_fields.get(step) if section else None
        annotation = field and field.annotation
        unit = next((n.symbol for n in (field.metadata if field else ()) if isinstance(n, Unit)), unit)
    return section, unit


def _section(annotation: Any) -> type[BaseModel] | None:
    """Return the section in an annotation, such as that of the partners of a number."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(filter(None, map(_section, get_args(annotation))), None)
