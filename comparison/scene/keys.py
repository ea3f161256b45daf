"""Dotted keys of a scene: their list, suggestions for unknown keys, overrides, messages of validation errors.

The name, title and command line of a changed scene follow from its overrides.
"""

import hashlib
import json
import re
import shlex
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from typing import Any, Literal, NamedTuple, get_args, get_origin

import numpy as np
from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from comparison.scene.linkage import LinkageKeys
from comparison.scene.schema import MATERIALS, NAME, PARTNERS, SceneKeys, Source, Unit

_ALIKE = 0.82
"""Ratio of `difflib` from which one name may be a typing error of another."""
_SIGNS = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}


class Key(NamedTuple):
    """Key of a scene."""

    name: str  # dotted
    unit: str  # empty without one
    bounds: str  # rule for the value: ">= 0", "ideal | clearance"
    default: object  # value in a scene that extends "paper"; None without one
    source: str  # place of the default in the paper, "identified" or "chosen"; empty without one
    description: str


@cache
def scene_keys(schema: type[BaseModel] = SceneKeys) -> list[Key]:
    """Return all keys of a scene in the order of the schema, of a linkage those of each NAME."""
    base: dict[str, Any] = {"solver": {"exudyn": {"step": None}}}  # of a linkage it follows from the duration
    if schema is SceneKeys:
        text = files("comparison.scene.shipped").joinpath("paper.toml").read_text("utf-8")
        base = SceneKeys.model_validate(tomllib.loads(text)).model_dump(exclude={"scene"})
    extends = "Scene whose values hold where this one has none: a shipped name or a path."
    return [Key("scene.extends", "", "text", None, "", extends), *_below(schema, base, "", "")]


def _below(section: type[BaseModel], defaults: Mapping[str, Any], above: str, unit: str) -> Iterator[Key]:
    for name, field in section.model_fields.items():
        notes = list(_notes(field))
        own_unit = next((note.symbol for note in notes if isinstance(note, Unit)), unit)
        default = defaults.get(name, None if field.is_required() else field.default)
        items = (field.annotation, *get_args(field.annotation))  # a section, several by name, one or None
        for item in items:
            if isinstance(item, type) and issubclass(item, BaseModel):
                below = f"{above}{name}.NAME." if dict in notes else f"{above}{name}."
                yield from _below(item, default if isinstance(default, dict) else {}, below, own_unit)
                break
        else:
            sources = [note.text for note in notes if isinstance(note, Source)] or ["chosen"]
            source = "" if default is None else sources[0]
            rule = _bounds(notes)
            yield Key(f"{above}{name}", own_unit, rule, default, source, field.description or "")


def _bounds(notes: list[Any]) -> str:
    """Return the rule for a value from the types and metadata of its annotation."""
    rules = [
        f"{sign} {getattr(note, limit):g}"
        for note in notes
        for limit, sign in _SIGNS.items()
        if hasattr(note, limit)
    ]
    choices = [" | ".join(map(str, get_args(note))) for note in notes if get_origin(note) is Literal]
    if list in notes:
        choices = [f"any of {choice.replace(' | ', ', ')}" for choice in choices]
        rows = "rows of " if notes.count(list) > 1 else ""
        choices += [f"{rows}{note.max_length} values" for note in notes if hasattr(note, "max_length")]
    texts = {dict: "numbers by name", int: "integer", str: "text"}
    types = [text for each, text in texts.items() if each in notes and not choices][:1]
    return ", ".join(dict.fromkeys(types + choices + rules))


def _notes(annotation: Any) -> Iterator[Any]:
    """Yield the types in an annotation, and their metadata."""
    if isinstance(annotation, FieldInfo):
        yield from annotation.metadata
        yield from _notes(annotation.annotation)
    elif get_origin(annotation) in (None, Literal):
        yield annotation
    else:
        yield get_origin(annotation)
        for part in get_args(annotation):
            yield from _notes(part)


def did_you_mean(wrong: str, schema: type[BaseModel] = SceneKeys, below: str = "") -> str:
    """Return the end of a message on an unknown key: the known key that it resembles, if any.

    It is compared, in this order, with last parts of keys in its section, keys without their section,
    sections (the first key of one counts), keys with their words in any order and last parts of keys; else a
    key may contain its last part. ``below``, the first key below an unknown table, replaces it in the second.
    """
    of_scene, table = schema in (SceneKeys, LinkageKeys), wrong.partition(".")[0]
    names = [key.name for key in scene_keys(schema)] if of_scene else [*_names(schema)]
    names = [with_name(name, wrong) for name in names if name != wrong]
    if schema is SceneKeys:
        names += [f"{material}.{partner}" for material in MATERIALS for partner in PARTNERS]
    elif schema is LinkageKeys and table in _tables(SceneKeys) - _tables(schema):
        return f"; {table} is for the press: a scene with [body] has none"
    elif table not in schema.model_fields and (
        matches := get_close_matches(table, schema.model_fields, n=1, cutoff=_ALIKE)
    ):
        return f"; did you mean {matches[0]}?"
    section, _, last = wrong.rpartition(".")
    searches: list[tuple[str, Callable[[str], str]]] = [
        (last, lambda name: _last(name) if name.rpartition(".")[0] == section else ""),
        (below or wrong, lambda name: name.partition(".")[2]),
        (last, lambda name: name.partition(".")[0]),
        (_words(wrong), _words),
        (last, _last),
    ]
    for word, part in searches:
        choices = {part(name): name for name in reversed(names)}
        if word and (matches := get_close_matches(word, choices, n=1, cutoff=_ALIKE)):
            return f"; did you mean {choices[matches[0]]}?"
    similar = next((name for name in names if len(last) > 2 and last in name), "")
    hint = f"; sixbar keys{' --linkage' if schema is LinkageKeys else ''} lists all" if of_scene else ""
    return f"; did you mean {similar}?" if similar else hint


def _tables(schema: type[BaseModel]) -> set[str]:
    return {part for key in scene_keys(schema) for part in key.name.split(".")[:-1]}


def with_name(key: str, of: str) -> str:
    """Return a key of a linkage with the name for its NAME that another key of the same table has."""
    table, _, rest = of.partition(".")
    return key.replace(f"{table}.NAME.", f"{table}.{rest.partition('.')[0]}.")


def _last(name: str) -> str:
    return name.rpartition(".")[2]


def _words(name: str) -> str:
    return " ".join(sorted(re.split(r"[._]", name.lower())))


# ---- overrides and their consequences, and errors of validation

LONGEST = 90
"""Longest name that lists all changes: the schema allows 100 characters, with a hash."""
_FORMULATION = "solver.exudyn.formulation"
_SETTINGS = ("solver.exudyn.step", "solver.exudyn.tolerance")  # their meaning depends on the formulation
_TITLE_UNITS = {"m": (1e3, "mm"), "Pa": (1e-9, "GPa")}  # unit of a key -> a title's, and the factor to it
_WORD = re.compile(r"(?!(true|false|inf|nan)$)[A-Za-z_][A-Za-z0-9_./-]*")  # no TOML: --set takes it as text
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")  # a step of a key that is not quoted
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
    "dict_type": "must be a dict or section of values by name",
    "model_type": "must be a section with keys of its own",
    "model_attributes_type": "must be a section with keys of its own",
    "literal_error": "must be {expected}",
    "too_short": "must hold {min_length} values, not {actual_length}",
    "too_long": "must hold {max_length} values, not {actual_length}",
    "string_too_short": "must not be empty",
    "string_too_long": "must have at most {max_length} characters",
    "string_pattern_mismatch": "must be letters, digits and . _ + = - only: it names files",
    "name": "must be letters, digits, _ and - only",
    "missing": "is missing",
    "extra_forbidden": "is not a known key",
    "not_installed": "is not a known key: no model of this name is installed",
}
"""Type of a pydantic error -> the rule in the message."""


def flat(section: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """Return the values of a section by their dotted keys; an empty section counts as a value."""
    keys: dict[str, Any] = {}
    for key, value in section.items():
        is_section = isinstance(value, Mapping) and value
        keys |= flat(value, f"{above}{key}.") if is_section else {f"{above}{key}": unbox(value)}
    return keys


def differences(first: Mapping[str, Any], second: Mapping[str, Any]) -> tuple[tuple[str, Any, Any], ...]:
    """Return the dotted keys whose values differ in two sections, with both; None where one lacks the key."""
    a, b = flat(first), flat(second)
    return tuple((key, a.get(key), b.get(key)) for key in {**a, **b} if a.get(key) != b.get(key))


def unbox(value: object) -> object:
    """Convert a number of numpy, also in a dict, to Python's, which alone a strict type accepts."""
    if isinstance(value, Mapping):
        return {name: unbox(part) for name, part in value.items()}
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else value


def nest(keys: Mapping[str, Any]) -> dict[str, Any]:
    """Return the sections of `flat` keys; where a value and a section have one key, the later remains."""
    result: dict[str, Any] = {}
    for key, value in keys.items():
        *sections, last = key.split(".")
        below = result
        for section in sections:
            if not isinstance(below.get(section), dict):
                below[section] = {}
            below = below[section]
        if value != {}:
            below[last] = value
        elif not isinstance(below.get(last), dict):
            below[last] = {}
    return result


def merge(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return keys with changes: a number for one partner leaves the other's, one for both replaces each."""
    result = dict(base)
    for key, value in changes.items():
        for material in MATERIALS:
            if key.startswith(f"{material}.") and material in result:
                both = result.pop(material)
                result |= {f"{material}.{partner}": both for partner in PARTNERS}
            elif key == material and value != {}:
                result = {name: part for name, part in result.items() if not name.startswith(f"{material}.")}
        result[key] = value
    return result


def apply(files: Mapping[str, Any], overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of a scene's files with overrides."""
    formulation = files.get(_FORMULATION, "auto")
    # Settings belong to a formulation: the five bodies' step would slow the tree a hundredfold.
    if overrides.get(_FORMULATION, formulation) not in (None, formulation):
        files = {key: value for key, value in files.items() if key not in _SETTINGS}
    return merge(files, overrides)


def combine(
    files: Mapping[str, Any], overrides: Mapping[str, Any], values: Mapping[str, Any]
) -> dict[str, Any]:
    """Return a scene's overrides after one more change: the values that differ from those of its files."""
    values = flat(values)
    formulation = overrides.get(_FORMULATION, files.get(_FORMULATION, "auto"))
    if values.get(_FORMULATION, formulation) != formulation:
        overrides = {key: value for key, value in overrides.items() if key not in _SETTINGS}
    changes = merge(overrides, values)
    base = apply(files, {key: changes[key] for key in (_FORMULATION,) if key in changes})
    base[_FORMULATION] = files.get(_FORMULATION)
    return {key: value for key, value in changes.items() if not _same(value, _at(base, key))}


def _at(keys: Mapping[str, Any], key: str) -> object:
    """Return the value of a key, of a partner's else that of both, of a section {}; None without one."""
    both, _, partner = key.rpartition(".")
    if both in MATERIALS and partner in PARTNERS:
        return keys.get(key, keys.get(both))
    return keys.get(key, {} if any(other.startswith(f"{key}.") for other in keys) else None)


def _same(value: object, before: object) -> bool:
    """Return whether a value changes nothing; true is not 1, nor is 1.0 where an integer has to be."""
    integer = type(value) is int and isinstance(before, float) and value == before
    return integer or toml(value) == toml(before)


def name_with(name: str, overrides: Mapping[str, object]) -> str:
    """Return a name for files: ``"ideal+drive.cycles=1"``, cut and with a hash if too long or no name.

    Keys are sorted: the order in which they were changed does not matter.
    """
    full_name = "+".join([name, *(f"{key}={_text(value)}" for key, value in sorted(overrides.items()))])
    if re.match(NAME, full_name) and len(full_name) <= LONGEST:
        return full_name
    stem = re.sub(r"[^A-Za-z0-9._+=-]+", "_", full_name)[:LONGEST]
    return f"{stem}+{hashlib.sha256(full_name.encode('utf-8', 'surrogatepass')).hexdigest()[:8]}"


def title_with(name: str, overrides: Mapping[str, object]) -> str:
    """Return a title: ``"150rpm-0.2mm with clearance.slider = 0.4 mm"``."""
    changes = []
    for key, value in sorted(overrides.items()):
        text, unit = _text(value), _unit(key.split("."))
        if isinstance(value, float):
            factor, unit = _TITLE_UNITS.get(unit, (1.0, unit))
            text = f"{factor * value:.12g}"
        changes.append(f"{key} = {text} {unit}".rstrip())
    return f"{name} with {', '.join(changes)}"


def command_line(
    verb: str, sources: Sequence[str], overrides: Mapping[str, object], options: Sequence[str] = ()
) -> str:
    """Return the command ``sixbar VERB SOURCE ...``, quoted for a POSIX shell."""
    changes = [word for key, value in overrides.items() for word in ("--set", f"{key}={_text(value)}")]
    return shlex.join(["sixbar", verb, *sources, *changes, *options])


def _text(value: object) -> str:
    """Return a value as --set takes it."""
    return value if isinstance(value, str) and _WORD.fullmatch(value) else toml(value)


def toml(value: object) -> str:
    """Return a value as TOML in one line, floats exactly."""
    if isinstance(value, Mapping):
        keys = [key if _BARE_KEY.fullmatch(key) else toml(key) for key in map(str, value)]
        parts = [f"{key} = {toml(part)}" for key, part in zip(keys, value.values(), strict=True)]
        return f"{{ {', '.join(parts)} }}" if parts else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml, value))}]"
    if isinstance(value, float):
        return repr(float(value))  # numpy's are floats too, and say so
    if type(value) is int:
        return hex(value) if abs(value) > 10**100 else str(value)  # Python does not print thousands of digits
    # A string of JSON is one of TOML too, except for the character DEL.
    return json.dumps(value, ensure_ascii=False, default=str).replace("\x7f", "\\u007f")


def readable(value: object) -> str:
    """Return a value as TOML, large and small numbers with an exponent, None as "not stated"."""
    if value is None:
        return "not stated"
    brief = f"{value:g}" if isinstance(value, float) else ""
    return brief if "e" in brief and float(brief) == value else toml(value)


def explain(error: ValidationError, schema: type[BaseModel] = SceneKeys) -> str:
    """Phrase the first of pydantic's errors in one line: key, value, unit, rule.

    An unknown key goes before a missing one, which it may be meant for; `did_you_mean` adds a known one.
    """
    first = min(error.errors(), key=lambda one: one["type"] == "missing")
    kind, value, context = first["type"], first["input"], first.get("ctx", {})
    # Without the branch of a union.
    steps = [
        step for step in map(str, first["loc"]) if not step.startswith(("constrained-", "literal[", "list["))
    ]
    if ".".join(steps[:2]) in MATERIALS:
        steps[2:3] = []  # the branch of the union, "number" or "partners"
    if steps[-1:] == ["[key]"]:  # a name
        kind, steps = "name", steps[:-1]
    if "key" in context:  # a rule of the schema is violated
        steps, value = [*steps, *context["key"].split(".")], context.get("value")
    key = ".".join(step if _BARE_KEY.fullmatch(step) else repr(step) for step in steps) or "the file"
    text = _RULES[kind].format(**context) if kind in _RULES else " ".join(first["msg"].split())
    of_scene = schema in (SceneKeys, LinkageKeys)
    unit = _unit(steps, schema) if of_scene else ""
    if kind == "missing":
        hint = ' (scene.extends = "paper" takes over the paper\'s numbers)' if schema is SceneKeys else ""
        return f"{key} {text}{hint}"
    if kind in ("extra_forbidden", "not_installed"):
        wrong = ".".join(steps)
        return f"{key} {text}{did_you_mean(wrong, schema, next(iter(flat({wrong: value}))))}"
    if of_scene and kind.startswith("model"):  # a value where a section has to be
        text += did_you_mean(steps[-1], schema)
    if "key" in context and value is None:
        return f"{key} {text}"
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return f"{key} = {short(value)}{f' {unit}' if unit and number else ''} {text}"


def _names(schema: type[BaseModel]) -> Iterator[str]:
    """Yield the dotted keys of a file, also those of its sections."""
    for name, field in schema.model_fields.items():
        yield name
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            yield from (f"{name}.{below}" for below in _names(field.annotation))


def short(value: object) -> str:
    """Return a value as Python writes it, without its middle if it is long."""
    try:
        text = repr(value)
    except ValueError:  # Python refuses to print integers of thousands of digits
        return "an integer of thousands of digits"
    return text if len(text) <= 120 else f"{text[:80]} ... {text[-20:]}"


def _unit(steps: Sequence[str], schema: type[BaseModel] = SceneKeys) -> str:
    """Return the unit of a scene's key, also of one partner's or of a value in a list; "" without one."""
    units = {with_name(key.name, ".".join(steps)): key.unit for key in scene_keys(schema)}
    names = (".".join(steps[:count]) for count in range(len(steps), 0, -1))
    return next((units[name] for name in names if name in units), "")
