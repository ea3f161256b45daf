"""One-line messages for pydantic's validation errors: key, value, unit, rule."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from typing import Any, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from comparison.scene.fields import Unit
from comparison.scene.schema import SceneKeys

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
    "string_type": "must be a string",
    "list_type": "must be a list",
    "literal_error": "must be {expected}",
    "too_short": "must hold {min_length} values, not {actual_length}",
    "too_long": "must hold {max_length} values, not {actual_length}",
    "model_type": "must be a section with keys of its own",
    "string_too_short": "must not be empty",
    "string_too_long": "must have at most {max_length} characters",
    "string_pattern_mismatch": "must be letters, digits and . _ + = - only: it names files",
}


def explain(error: ValidationError) -> str:
    """Phrase the first of the errors."""
    first = error.errors()[0]
    # Steps that are no keys (the branches of a union) carry no information for the reader.
    branches = ("float", "none", "list", "number", "partners")
    steps = [str(step) for step in first["loc"] if step not in branches]
    context = first.get("ctx", {})
    kind, value = first["type"], first["input"]
    unit = unit_of(".".join(steps))
    if kind == "rule":
        steps += [str(context["key"])]
        value, unit = context["value"], context["unit"]
    key = ".".join(steps)
    if kind == "missing":
        return f'{key} is missing (scene.extends = "paper" takes over the paper\'s numbers)'
    if kind == "not_installed":
        steps += [str(context["key"])]
        message = "is not a known key: no model of this name is installed"
        return f"{'.'.join(steps)} {message}{_suggestion(steps)}"
    if kind == "extra_forbidden":
        return f"{key} is not a known key{_suggestion(steps)}"
    text = _RULES[kind].format(**context) if kind in _RULES else " ".join(first["msg"].split())
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return f"{key} = {short(value)}{f' {unit}' if unit and number else ''} {text}"


def short(value: object) -> str:
    """Return a value as it was given, the middle left out where it is long."""
    try:
        text = repr(value)
    except ValueError:  # Python refuses to print integers of thousands of digits
        return "an integer of thousands of digits"
    return text if len(text) <= 120 else f"{text[:80]} ... {text[-20:]}"


def unit_of(key: str) -> str:
    """Return the unit of a dotted key, from the annotation of its field; empty without one."""
    section: Any = SceneKeys
    for step in key.split("."):
        section = _element(section)
        if step.isdigit():
            continue
        field = section.model_fields.get(step) if _is_section(section) else None
        if field is None:
            return ""
        for note in field.metadata:
            if isinstance(note, Unit):
                return note.symbol
        section = field.annotation
    return ""


def _suggestion(steps: Sequence[str]) -> str:
    section: Any = SceneKeys
    for step in steps[:-1]:
        section = _element(section)
        if not step.isdigit():
            field = section.model_fields.get(step) if _is_section(section) else None
            section = field and field.annotation
    section = _element(section)
    if not _is_section(section):
        return ""
    close = difflib.get_close_matches(steps[-1], section.model_fields, n=1)
    return f"; did you mean {'.'.join([*steps[:-1], close[0]])}?" if close else ""


def _element(annotation: Any) -> Any:
    """Return the section of a list of sections or of a number's partners, else what is given."""
    if get_origin(annotation) is list:
        return get_args(annotation)[0]
    if get_origin(annotation) is Union:
        branches = [(get_args(branch) or (branch,))[0] for branch in get_args(annotation)]  # of Annotated
        return next((branch for branch in branches if _is_section(branch)), annotation)
    return annotation


def _is_section(annotation: object) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)
