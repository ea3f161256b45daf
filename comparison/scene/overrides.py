"""Overrides of a scene: dotted keys over its files, and the name, title and command line that follow."""

from __future__ import annotations

import hashlib
import json
import re
import shlex
from collections.abc import Mapping, Sequence
from typing import Any

from comparison.scene.error_messages import unit_of
from comparison.scene.schema import NAME

LONGEST = 54
"""Characters of a name that says what is changed: beside it there is room for a verdict in 80 columns."""
_FORMULATION = "solver.exudyn.formulation"
_OF_FORMULATION = ("solver.exudyn.step", "solver.exudyn.tolerance")
_SHOWN = {"m": (1e3, "mm"), "Pa": (1e-9, "GPa")}
"""Unit of a key -> that of a title, and the factor to it."""
OF_PARTNERS = ("contact.youngs_modulus", "contact.poisson")
PARTNERS = ("slider", "guide")
"""Keys of a number for both partners of a contact, or of one for each."""
_BARE = re.compile(r"(?!(true|false|inf|nan)$)[A-Za-z_][A-Za-z0-9_./-]*")  # no TOML: --set takes it as text


def changed(given: Mapping[str, Any], values: Mapping[str, object]) -> dict[str, Any]:
    """Apply dotted keys to a scene.

    Exudyn's step and tolerance in a scene are meant for the scene's formulation. They have another meaning in
    another formulation chosen here: a step for the five bodies makes the tree take a hundred times its steps.
    """
    solver, wanted = given.get("solver", {}), values.get(_FORMULATION)
    if wanted is not None and isinstance(solver, Mapping):
        exudyn = solver.get("exudyn", {})
        if isinstance(exudyn, Mapping) and exudyn.get("formulation", "auto") != wanted:
            kept = {key: value for key, value in exudyn.items() if key not in ("step", "tolerance")}
            given = {**given, "solver": {**solver, "exudyn": kept}}
    return merged(given, _nested(values))


def updated(
    given: Mapping[str, Any], overrides: Mapping[str, object], values: Mapping[str, object]
) -> dict[str, object]:
    """Return the overrides of a scene whose keys are changed once more: those that differ from its files.

    Parameters
    ----------
    given
        The keys as the files give them.
    overrides
        As they were, of single keys.
    values
        Dotted keys, of sections too.
    """
    values = _single("", values)
    usual = overrides.get(_FORMULATION, _at(given, _FORMULATION) or "auto")
    if values.get(_FORMULATION, usual) != usual:
        overrides = {key: value for key, value in overrides.items() if key not in _OF_FORMULATION}
    values = _with(overrides, values)
    here = changed(given, {key: values[key] for key in (_FORMULATION,) if key in values})
    return {
        key: value
        for key, value in values.items()
        if not _same(value, _at(given if key == _FORMULATION else here, key))
    }


def name_with(name: str, overrides: Mapping[str, object]) -> str:
    """Return a name for files: ``"ideal+drive.cycles=1"``, with a hash where that is too long or no name."""
    whole = "+".join([name, *(f"{key}={_text(value)}" for key, value in overrides.items())])
    if re.match(NAME, whole) and len(whole) <= LONGEST:
        return whole
    return f"{name[:LONGEST]}+{hashlib.sha256(whole.encode()).hexdigest()[:8]}"


def title_with(name: str, overrides: Mapping[str, object]) -> str:
    """Return a title: ``"150rpm-0.2mm with clearance.slider = 0.4 mm"``."""
    changes = ", ".join(f"{key} = {_quantity(value, unit_of(key))}" for key, value in overrides.items())
    return f"{name} with {changes}"


def command_line(
    verb: str, sources: Sequence[str], overrides: Mapping[str, object], options: Sequence[str] = ()
) -> str:
    """Return the command ``sixbar`` that does something to scenes, quoted for a POSIX shell.

    The only place that writes one; nothing reads one.
    """
    changes = [word for key, value in overrides.items() for word in ("--set", f"{key}={_text(value)}")]
    return shlex.join(["sixbar", verb, *sources, *changes, *options])


def merged(base: Mapping[str, Any], changes: Mapping[str, Any], section: str = "") -> dict[str, Any]:
    """Merge ``changes`` into ``base``, section by section.

    One partner's number over that of both leaves the other's as it is.
    """
    result = dict(base)
    for key, value in changes.items():
        below, whole = result.get(key), f"{section}{key}"
        if whole in OF_PARTNERS and value and not isinstance(below, dict | None):
            below = dict.fromkeys(PARTNERS, below)
        sections = isinstance(below, dict) and isinstance(value, dict)
        result[key] = merged(below or {}, value, f"{whole}.") if sections else value
    return result


def _with(overrides: Mapping[str, object], values: Mapping[str, object]) -> dict[str, object]:
    """Return overrides of single keys with further ones: a number of both partners replaces those of each."""
    result = dict(overrides)
    for key, value in values.items():
        both = key.rpartition(".")[0]
        if key in OF_PARTNERS:
            result = {old: kept for old, kept in result.items() if not old.startswith(f"{key}.")}
        elif both in OF_PARTNERS and both in result:
            result |= dict.fromkeys((f"{both}.{partner}" for partner in PARTNERS), result.pop(both))
        result[key] = value
    return result


def _single(section: str, values: Mapping[str, object]) -> dict[str, object]:
    """Return the values of single keys; an empty section is one itself."""
    single: dict[str, object] = {}
    for key, value in values.items():
        whole = f"{section}.{key}" if section else key
        single |= _single(whole, value) if isinstance(value, Mapping) and value else {whole: value}
    return single


def _nested(values: Mapping[str, object]) -> dict[str, Any]:
    """Convert dotted keys to nested mappings."""
    nested: dict[str, Any] = {}
    for dotted, value in values.items():
        inner: Any = value
        for part in reversed(dotted.split(".")):
            inner = {part: inner}
        nested = merged(nested, inner)
    return nested


def _at(given: Mapping[str, Any], dotted: str) -> object:
    """Return the value of a dotted key; None where there is none."""
    both, _, partner = dotted.rpartition(".")
    if both in OF_PARTNERS and partner in PARTNERS and not isinstance(_at(given, both), Mapping):
        dotted = both
    found: Any = given
    for part in dotted.split("."):
        found = found.get(part) if isinstance(found, Mapping) else None
    return found


def _same(value: object, there: object) -> bool:
    """Return whether a value would change nothing; true is not 1, nor is 1.0 where an integer has to be."""
    whole = type(value) is int and isinstance(there, float) and value == there
    return whole or _toml(value) == _toml(there)


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


def _quantity(value: object, unit: str) -> str:
    """Return a value with its unit."""
    if not isinstance(value, float):
        return f"{_text(value)} {unit}".rstrip()
    factor, unit = _SHOWN.get(unit, (1.0, unit))
    return f"{factor * value:.12g} {unit}".rstrip()
