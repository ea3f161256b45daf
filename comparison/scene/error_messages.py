"""One-line messages for pydantic's validation errors: key, value, unit, rule."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from typing import Any

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
    "string_pattern_mismatch": "must be letters, digits and . _ + - only: it names files",
}


def explain(error: ValidationError) -> str:
    """Phrase the first of the errors."""
    first = error.errors()[0]
    # Steps that are no keys (the branches of a union) carry no information for the reader.
    steps = [str(step) for step in first["loc"] if step not in ("float", "none", "list")]
    context = first.get("ctx", {})
    kind, value = first["type"], first["input"]
    unit = _unit(steps)
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
    return f"{key} = {value!r}{f' {unit}' if unit and number else ''} {text}"


def _unit(steps: Sequence[str]) -> str:
    """Look up the unit of a key in the annotation of its field."""
    section: Any = SceneKeys
    for step in steps:
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
        section = section.model_fields[step].annotation
    close = difflib.get_close_matches(steps[-1], section.model_fields, n=1)
    return f"; did you mean {'.'.join([*steps[:-1], close[0]])}?" if close else ""


def _is_section(annotation: object) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)
