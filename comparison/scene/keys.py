"""All keys of a scene with unit, bounds, default, source and description, as the schema has them."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.resources import files
from typing import Any, Literal, NamedTuple, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from comparison.scene.schema import SceneKeys, Source, Unit

_SIGNS = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}


class Key(NamedTuple):
    """Key of a scene."""

    name: str  # dotted
    unit: str  # empty without one
    bounds: str  # rule for the value: ">= 0", "ideal | clearance"
    default: object  # of a scene that extends "paper"; None without one
    source: str  # of the default: where the paper prints it, "identified" or "chosen"; empty without one
    description: str


@cache
def scene_keys() -> list[Key]:
    """Return all keys of a scene in the order of the schema; those of ``[[random]]`` as ``random[].key``."""
    text = files("comparison.scene.shipped").joinpath("paper.toml").read_text("utf-8")
    base = SceneKeys.model_validate(tomllib.loads(text)).model_dump(exclude={"scene", "random"})
    extends = "Scene whose values hold where this one has none: a shipped name or a path."
    return [Key("scene.extends", "", "text", None, "", extends), *_below(SceneKeys, base, "", "")]


def _below(section: type[BaseModel], defaults: Mapping[str, Any], above: str, unit: str) -> Iterator[Key]:
    for name, field in section.model_fields.items():
        notes = list(_notes(field))
        own_unit = next((note.symbol for note in notes if isinstance(note, Unit)), unit)
        default = defaults.get(name)
        item, mark = field.annotation, ""
        if get_origin(item) is list and isinstance(get_args(item)[0], type):  # of sections
            item, mark = get_args(item)[0], "[]"
        if isinstance(item, type) and issubclass(item, BaseModel):
            yield from _below(item, default or {}, f"{above}{name}{mark}.", own_unit)
            continue
        sources = [note.text for note in notes if isinstance(note, Source)] or ["chosen"]
        source = "" if default is None else sources[0]
        yield Key(f"{above}{name}", own_unit, _bounds(notes), default, source, field.description or "")


def _bounds(notes: list[Any]) -> str:
    """Return the rule for a value from what is noted of its type."""
    rules = [
        f"{sign} {getattr(note, limit):g}"
        for note in notes
        for limit, sign in _SIGNS.items()
        if hasattr(note, limit)
    ]
    choices = [" | ".join(map(str, get_args(note))) for note in notes if get_origin(note) is Literal]
    if list in notes:
        choices = [f"any of {choice.replace(' | ', ', ')}" for choice in choices]
        choices += [f"{note.max_length} values" for note in notes if hasattr(note, "max_length")]
    words = {dict: "numbers by name", int: "integer", str: "text"}
    kinds = [word for kind, word in words.items() if kind in notes and not choices][:1]
    return ", ".join(dict.fromkeys(kinds + choices + rules))


def _notes(annotation: Any) -> Iterator[Any]:
    """Yield the types in an annotation, and what is noted of them."""
    if isinstance(annotation, FieldInfo):
        yield from annotation.metadata
        yield from _notes(annotation.annotation)
    elif get_origin(annotation) in (None, Literal):
        yield annotation
    else:
        yield get_origin(annotation)
        for part in get_args(annotation):
            yield from _notes(part)
