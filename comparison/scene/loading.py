"""Scenes from TOML files: a plain nested mapping of all keys of `schema.py`, the only input of the models.

The module also warns of values that are valid but probably not meant, and writes the text of a new file.
"""

from __future__ import annotations

import difflib
import hashlib
import json
import os
import re
import textwrap
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, cached_property, reduce
from importlib.resources import files
from math import cos, degrees, gamma, hypot, inf, pi, sin, sqrt
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from comparison.files import contents, reading
from comparison.models import declared_formulations, smallest
from comparison.scene.keys import (
    Key,
    apply,
    combine,
    command_line,
    differences,
    explain,
    flat,
    merge,
    name_with,
    nest,
    readable,
    scene_keys,
    short,
    title_with,
    toml,
    with_name,
)
from comparison.scene.linkage import LinkageKeys, complete, criteria
from comparison.scene.schema import NAME, PARTNERS, Compare, Load, Reliability, SceneKeys

SCENES = Path(str(files("comparison.scene.shipped")))
LINKAGES = Path(str(files("comparison.scene.shipped.linkages")))
BASE = "paper"
JOINTS = ("crank_pin", "slider")
"""Joints that may have clearance."""
LARGEST_FILE = 1_000_000
"""Largest size of a scene file, bytes."""
LONGEST_CHAIN = 20
"""Largest number of files that extend one another."""
_SECTIONS = (
    "drive", "joints", "clearance", "contact", "friction", "load", "environment", "initial", "output",
    "mechanism",
)  # fmt: skip
_HEAD = """\
# Scene of sixbar. What is not written here has the value of the scene that this
# one extends; "sixbar keys" lists all keys. SI units except where a key says so.
"""
_LINKAGE_HEAD = """\
# Linkage of sixbar, complete: a part that is deleted here is gone. "sixbar keys --linkage"
# lists all keys and their defaults. SI units except where a key says so.
"""


class SceneError(ValueError):
    """Invalid scene; the message is one line: location, value, rule."""


@dataclass(frozen=True)
class Scene:
    """A complete and valid scene."""

    data: dict[str, Any]
    """All keys except the criteria, with defaults filled in; the input of a model."""
    files: dict[str, Any]
    """The dotted keys that its files give, without overrides and defaults."""
    overrides: dict[str, Any]
    """The dotted keys whose values differ from ``files``; name, title and command follow from them."""
    source: str
    """The shipped name or the path of its file; empty if it was not read from one."""
    compare: Compare
    """Rules for two tables without uncertainties."""
    reliability: Reliability
    """Limits of the errors, and intervals of the crank cycle."""

    def __repr__(self) -> str:
        """Return its name; `data` has the numbers."""
        return f"Scene({self.name!r})"

    @property
    def name(self) -> str:
        """Name, of files too."""
        return str(self.data["scene"]["name"])

    @property
    def title(self) -> str:
        """Title, in one line."""
        return str(self.data["scene"]["title"])

    @property
    def description(self) -> str:
        """Description, empty if there is none."""
        return str(self.data["scene"]["description"])

    @property
    def is_linkage(self) -> bool:
        """True for a linkage of bodies that it names itself, False for the press."""
        return "body" in self.data

    @property
    def schema(self) -> type[SceneKeys | LinkageKeys]:
        """The keys that it may have."""
        return LinkageKeys if self.is_linkage else SceneKeys

    @property
    def period(self) -> float:
        """Period of one crank cycle, s; of a linkage without a speed its duration."""
        speed = self.data["drive"].get("speed_rpm")
        return self.duration if speed is None else 60.0 / abs(float(speed))

    @property
    def duration(self) -> float:
        """Simulated time, s: that of the last sample, the cycles rounded to whole samples."""
        if "duration" in self.data["output"]:
            return float(self.data["output"]["duration"])
        per_cycle = self.data["output"]["samples_per_cycle"]
        return float(round(self.data["drive"]["cycles"] * per_cycle) * (self.period / per_cycle))

    @cached_property
    def loose(self) -> tuple[str, ...]:
        """The joints with clearance, of a linkage in its order, else of "crank_pin" and "slider"."""
        if self.is_linkage:
            return tuple(self.data.get("clearance", ()))
        joints = self.data["joints"]
        return tuple(joint for joint in JOINTS if joints.get(joint) == "clearance")

    def clearance(self, joint: str) -> float:
        """Return the clearance of a joint, m; 0 where it is ideal."""
        size: Any = self.data["clearance"][joint] if joint in self.loose else 0.0
        return float(size["size"] if self.is_linkage else size)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """A line for each value that is valid but probably not meant."""
        return tuple(implausible(self))

    @cached_property
    def hash(self) -> str:
        """SHA-256 (hex) of all keys that can change a result: of `data` without the texts."""
        return digest({key: part for key, part in self.data.items() if key != "scene"})

    def require_press(self, what: str) -> None:
        """Raise a `SceneError` for a linkage: ``what`` is of the press alone."""
        if self.is_linkage:
            raise SceneError(f"scene {self.name!r}: {what} is for the press alone, see docs/linkages.md")

    def with_values(self, values: Mapping[str, object]) -> Scene:
        """Return this scene with dotted keys changed, e.g. ``{"drive.speed_rpm": 210}``.

        Its name and title say so, unless they are among the values; it has no description.
        """
        return _validate(self.files, _combine(self.files, self.overrides, values), self.source)

    def variant(self, values: Mapping[str, object]) -> Scene:
        """Return this scene at other settings or from another start, under its name and title."""
        scene = self.with_values(values)
        return replace(scene, data=scene.data | {"scene": self.data["scene"]})

    def command(self, verb: str, *options: str) -> str:
        """Return the command ``sixbar VERB`` for this scene; empty if it was not read from a file."""
        return command_line(verb, [self.source], self.overrides, options) if self.source else ""


def shipped_scenes() -> list[str]:
    """Return the names of the shipped scenes, sorted; the base scene that they extend is not one of them."""
    return sorted(path.stem for path in SCENES.glob("*.toml") if path.stem != BASE)


def shipped_linkages() -> list[str]:
    """Return the names of the shipped linkages that are not the press, sorted."""
    return sorted(path.stem for path in LINKAGES.glob("*.toml"))


def load_scene(name_or_path: str | Path, overrides: Mapping[str, object] | None = None) -> Scene:
    """Read a shipped scene by its name, or any scene file by its path.

    Parameters
    ----------
    name_or_path
        A shipped scene (``"150rpm-0.2mm"``, also the base ``"paper"``) or the path of a TOML file.
    overrides
        Dotted keys and their values, applied last.

    Raises
    ------
    SceneError
        One line with location, value and violated rule.

    Examples
    --------
    >>> import sixbar
    >>> scene = sixbar.load_scene("150rpm-0.2mm", {"drive.speed_rpm": 210})
    >>> scene.name, scene.data["drive"]["cycles"]
    ('150rpm-0.2mm+drive.speed_rpm=210', 2.0)
    """
    if not isinstance(name_or_path, str | Path):
        raise SceneError(f"scene = {short(name_or_path)} must be a name or a path")
    source = str(name_or_path)
    path = _locate(source, Path(), source)
    files = {"scene.name": path.stem} | _read(path, ())
    return _validate(files, _combine(files, {}, overrides or {}), source)


def extension(scene: Scene) -> tuple[str, list[tuple[str, Any, Any]]]:
    """Return the scene that a file extends, and the stated keys whose values differ, there and here."""
    path = _locate(scene.source, Path(), scene.source).resolve()
    base = flat(tomllib.loads(contents(path, LARGEST_FILE))).get("scene.extends", "")
    there = scene
    with suppress(SceneError):  # there is no base, or it is incomplete by itself
        there = load_scene(_locate(base, path.parent, path.stem))
    sides = ({**one.data, "reliability": one.reliability.model_dump(), "scene": {}} for one in (there, scene))
    keys = {*there.files, *scene.files, *scene.overrides}
    return base, [change for change in differences(*sides) if change[0] in keys]


def as_scene(scene: Scene | str | Path) -> Scene:
    """Return a scene, read where its name or path is given; a `SceneError` if it is none of these."""
    if isinstance(scene, str | Path):
        return load_scene(scene)
    if isinstance(scene, Scene):
        return scene
    raise SceneError(f"scene = {short(scene)} must be a name, a path, or what sixbar.load_scene returns")


def scene_from_mapping(data: Mapping[str, Any]) -> Scene:
    """Validate a complete mapping, such as the one recorded beside a table, also by an earlier version."""
    keys = {"scene.name": "scene"} | flat(data)
    if keys.get("contact.impact_speed") == "frozen":  # up to 0.2.0; the only meaning that is left
        del keys["contact.impact_speed"]
    return _validate(keys, {}, "")


def parse_set(assignments: Sequence[str]) -> dict[str, object]:
    """Parse ``key=value`` pairs of the command line; a value that is not valid TOML is a string.

    >>> parse_set(["drive.speed_rpm=210", "joints.slider=ideal"])
    {'drive.speed_rpm': 210, 'joints.slider': 'ideal'}
    """
    values: dict[str, object] = {}
    for assignment in assignments:
        key, equals, text = assignment.partition("=")
        if not equals or not all(part.strip() for part in key.split(".")):
            raise SceneError(f"--set {assignment!r} must be key=value, as in --set drive.speed_rpm=210")
        try:
            content = tomllib.loads(f"value = {text.strip()}")
        except (ValueError, RecursionError):  # not TOML, too many digits, too deep
            content = {}
        # More than one key means that the text contains a line break and is not a TOML value.
        values[key.strip()] = content["value"] if content.keys() == {"value"} else text.strip()
    return values


def digest(value: object, default: Callable[[Any], Any] | None = None) -> str:
    """Return the SHA-256 (hex) of a value's canonical JSON; ``default`` converts what JSON lacks."""
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False, default=default)
    return hashlib.sha256(text.encode()).hexdigest()


def _locate(name: str, folder: Path, referrer: str) -> Path:
    """Find the file: a shipped name first, else a path relative to ``folder``."""
    if name in (BASE, *shipped_scenes()):
        return SCENES / f"{name}.toml"
    if name in shipped_linkages():
        return LINKAGES / f"{name}.toml"
    try:
        path = folder / Path(name).expanduser()
        if path.is_file():
            return path
    except (OSError, RuntimeError) as error:  # too long a name; a user who does not exist
        reason = getattr(error, "strerror", None) or "there is no such home folder"
        raise SceneError(f"scene {' '.join(referrer.split())!r}: {reason}") from error
    names = [*shipped_scenes(), *shipped_linkages()]
    close = difflib.get_close_matches(name, names, n=1)
    hint = f"did you mean {close[0]!r}?" if close else f"shipped are {', '.join(names)}"
    raise SceneError(f"scene {referrer!r}: {name!r} is neither a shipped scene nor a file; {hint}")


def _read(path: Path, chain: tuple[Path, ...]) -> dict[str, Any]:
    """Read the keys of a file and of those that it extends, without the texts of the latter."""
    where = f"scene {path.stem!r}"
    path = path.resolve()
    if len(chain) >= LONGEST_CHAIN:
        raise SceneError(f"{where}: scene.extends leads over more than {LONGEST_CHAIN} files")
    if path in chain:
        loop = " -> ".join(p.name for p in (*chain[chain.index(path) :], path))
        raise SceneError(f"{where}: scene.extends is circular: {loop}")
    with reading(f"{where}: {path}", SceneError, "TOML"):
        keys = flat(tomllib.loads(contents(path, LARGEST_FILE)))
    base = keys.pop("scene.extends", None)
    if base is None:
        return keys
    if not isinstance(base, str):
        raise SceneError(f"{where}: scene.extends = {short(base)} must be a shipped name or a path")
    inherited = _read(_locate(base, path.parent, path.stem), (*chain, path))
    keys = merge({key: value for key, value in inherited.items() if key.partition(".")[0] != "scene"}, keys)
    if {"body", "mechanism"} <= {key.partition(".")[0] for key in keys}:
        rule = "a linkage ([body]) and the press ([mechanism]) cannot extend one another"
        raise SceneError(f"{where}: scene.extends = {short(base)}: {rule}")
    return keys


def _combine(
    files: dict[str, Any], overrides: dict[str, Any], values: Mapping[str, object]
) -> dict[str, Any]:
    if not isinstance(values, Mapping):
        raise SceneError(f"overrides = {short(values)} must be a dict of dotted keys and their values")
    return combine(files, overrides, values)


def _validate(files: dict[str, Any], overrides: dict[str, Any], source: str) -> Scene:
    """Fill in texts and defaults, and validate."""
    values = apply(files, overrides)
    name = values["scene.name"] if values.get("scene", {}) == {} else Path(source).name
    texts = {key: value for key, value in overrides.items() if key.startswith("scene.")}
    changes = {key: value for key, value in overrides.items() if key not in texts}
    if changes and isinstance(name, str) and "scene" not in changes:  # the files' texts are of the files
        derived = {"scene.name": name_with(name, changes), "scene.title": title_with(name, changes)}
        values |= derived | {"scene.description": ""} | texts
    schema = LinkageKeys if any(key.startswith("body.") for key in files) else SceneKeys
    try:
        keys = schema.model_validate(nest({"scene.title": name} | values))
    except ValidationError as error:
        raise SceneError(f"scene {short(name)}: {explain(error, schema)}") from error
    if isinstance(keys, LinkageKeys):
        return Scene(complete(keys), files, overrides, source, keys.compare, criteria(keys))
    data = keys.model_dump(exclude={"compare", "reliability"})
    start, exudyn = data["initial"], data["solver"]["exudyn"]
    if start["slider_offset"] is None:
        start["slider_offset"] = data["mechanism"]["reference_offset"]
    if exudyn["formulation"] == "auto":
        exudyn["formulation"] = smallest("exudyn", data)
    defaults = declared_formulations("exudyn").get(exudyn["formulation"], {}).get("usual", {})
    exudyn |= {key: defaults[key] for key in defaults.keys() - keys.solver.exudyn.model_fields_set}
    return Scene(data, files, overrides, source, keys.compare, keys.reliability)


def new_scene(path: Path, source: str) -> str:
    """Return the TOML text of a file that extends a scene and writes its values out, with comments.

    Raises
    ------
    SceneError
        Where ``source`` is no scene, or the file's name cannot be that of a scene.
    """
    if not re.match(NAME, path.stem):
        raise SceneError(f"{path}: a scene's name must be letters, digits and . _ + = - only")
    scene = load_scene(source)
    data: Any = scene.data
    head, extends = _HEAD, source
    if source not in (BASE, *shipped_scenes(), *shipped_linkages()):
        extends = str(Path(source).expanduser().absolute())
        with suppress(ValueError):  # on another drive
            extends = os.path.relpath(extends, path.parent.absolute())
    base = f"extends = {toml(Path(extends).as_posix())}"
    keys = [key for name in _SECTIONS for key in scene_keys() if key.name.startswith(f"{name}.")]
    if scene.is_linkage:  # whole: through a base that it extends a part that is deleted would come back
        head, base, data = _LINKAGE_HEAD, "", nest(scene.files)
        order = {name.rpartition(".")[0]: -n for n, name in enumerate(reversed(scene.files))}
        schema, blank = scene_keys(LinkageKeys), Key("", "", "", None, "", "")  # of another model's settings
        keys = [
            next(
                (key for key in schema if f"{name}.".startswith(f"{with_name(key.name, name)}.")), blank
            )._replace(name=name)
            for name, value in sorted(scene.files.items(), key=lambda item: order[item[0].rpartition(".")[0]])
            if value != {} and not name.startswith("scene.")
        ]
    lines = [head, "[scene]", *filter(None, (base, f"title = {toml(path.stem)}"))]
    for key in keys:
        section, _, leaf = key.name.rpartition(".")
        if f"[{section}]" not in lines:
            lines += ["", f"[{section}]"]
        rule = ", ".join(filter(None, (key.unit, key.bounds)))
        value = reduce(dict.__getitem__, key.name.split("."), data)
        row = f"# {leaf} =" if value is None else f"{leaf} = {readable(value)}"  # nothing is no value of TOML
        line = f"{row}  # {rule}" if rule else row
        comment = key.description if len(line) < 90 else f"{key.description} {rule}"
        lines += textwrap.wrap(comment, 80, initial_indent="# ", subsequent_indent="#   ")
        lines.append(line if comment == key.description else row)
    return "\n".join(lines) + "\n"


# ---- values that are valid but probably not meant

STEPS_PER_CONTACT = 8
"""Steps of Exudyn in a contact from which the error of x has the method's order: 2e-5 s in the main case."""
LARGEST_TILT = 0.05
"""Plausible tilt of a slider in its guide, rad: four times that of the largest shipped clearance."""

HEAVIEST_LOAD = 1e5
"""Plausible force in weights of the slider: 1.7e5 N press a corner of steel deeper than its radius."""


def implausible(scene: Scene) -> Iterator[str]:
    """Yield a line for each implausible value of a scene: key, value, unit, reason."""
    cycles, per_cycle = scene.data["drive"].get("cycles"), scene.data["output"].get("samples_per_cycle")
    # More than the round-off of a product
    if cycles is not None and abs((samples := cycles * per_cycle) - round(samples)) > 1e-6:
        count = f"{samples:.6g} samples; {round(samples)} are run"
        yield f"drive.cycles = {cycles:g} times output.samples_per_cycle = {per_cycle} is {count}"
    if scene.is_linkage:
        return
    data, joints, shortest = scene.data, scene.loose, contact_time(scene)
    exudyn, speed = data["solver"]["exudyn"], data["drive"]["speed_rpm"]
    if abs(speed) > 1e5:
        yield f"drive.speed_rpm = {speed:g} is faster than a turbocharger: its unit is turns a minute"
    gravity, friction = data["environment"]["gravity"], data["friction"]["coefficient"]
    if "slider" in joints:
        yield from _in_guide(data)
    gap, journal = scene.clearance("crank_pin"), data["clearance"]["journal_radius"]
    if gap > journal / 5.0:
        yield f"clearance.crank_pin = {gap:g} m is large for clearance.journal_radius = {journal:g} m"
    # The tree controls its error: its step is the largest one.
    if exudyn["formulation"] != "tree" and exudyn["step"] > shortest / STEPS_PER_CONTACT:
        yield (
            f"solver.exudyn.step = {exudyn['step']:g} s is outside the asymptotic range of convergence: "
            f"contacts of {shortest:.2g} s require at most {shortest / STEPS_PER_CONTACT:.2g} s"
        )
    contact, without_effect = data["contact"], _without_effect(scene)
    for key, why in without_effect.items():
        if contact[key] != _usual_contact().get(key):
            yield f"contact.{key} = {readable(contact[key])} has no effect {why}"
    for partner in PARTNERS:
        modulus = _of_partner(contact["youngs_modulus"], partner)
        if joints and "youngs_modulus" not in without_effect and not 1e6 <= modulus <= 1.3e12:
            what = "softer than rubber" if modulus < 1e6 else "stiffer than diamond"
            yield f"contact.youngs_modulus = {modulus:g} Pa is {what}: its unit is Pa"
            break
    if joints and friction > 2.0:
        yield f"friction.coefficient = {friction:g} is more than that of rubber: it is no percentage"
    if abs(gravity) > 100.0:
        yield f"environment.gravity = {gravity:g} m/s^2 is more than ten times the Earth's"
    for name in ("crank", "rod2", "rocker", "rod4", "slider"):
        body = data["mechanism"][name]
        size, centroid = hypot(body["length"], body.get("width", 0.0)), body.get("centroid", 0.0)
        if abs(centroid) > size:
            yield f"mechanism.{name}.centroid = {centroid:g} m is farther out than the rod's end, {size:g} m"
        if body["inertia"] > (largest := body["mass"] * size * size):
            yield (
                f"mechanism.{name}.inertia = {body['inertia']:g} kg m^2 exceeds mass times size squared, "
                f"{largest:.2g} kg m^2"
            )
    yield from _at_workpiece(data)


@cache
def _usual_contact() -> dict[str, Any]:
    contact: dict[str, Any] = nest(_read(SCENES / f"{BASE}.toml", ()))["contact"]
    return contact


def _without_effect(scene: Scene) -> dict[str, str]:
    """Return the keys of the contact without effect, each with the reason; none without clearance."""
    joints, contact = scene.loose, scene.data["contact"]
    if not joints:
        return {}
    law, has_law = contact["law"], f"under contact.law = {contact['law']!r}"
    reasons = {}
    if "slider" not in joints:  # a journal's radius is its own
        reasons["corner_radius"] = "with joints.slider = 'ideal'"
    if law == "foundation":
        reasons["corner_radius"] = has_law
        if "crank_pin" not in joints:  # the law of the pin is Hertz's
            reasons["exponent"] = has_law
    if law != "adams-impact":
        return reasons | dict.fromkeys(("stiffness", "damping", "damping_depth"), has_law)
    if contact["stiffness"] is not None:
        reasons |= dict.fromkeys(("youngs_modulus", "poisson", "corner_radius"), "beside contact.stiffness")
    return reasons | {"restitution": has_law}


def contact_time(scene: Scene) -> float:
    """Return the approximate duration of the shortest contacts, s; infinite without clearance.

    A mass m hits a spring K d^n at the speed v: for n = 1.5 3.2181 (m^2 / (K^2 v))^(1/5), docs/model.md,
    section 6; K may be that of ``adams-impact``. m is that of a corner, with rod 4 upright;
    v = omega sqrt(crank * clearance). In the shipped scenes the time is between the shortest and the median;
    contacts of a ``foundation`` are shorter.
    """
    data = scene.data
    mechanism, contact = data["mechanism"], data["contact"]
    slider, rod, n = mechanism["slider"], mechanism["rod4"], contact["exponent"]
    share, shortest = 1.0 / (n + 1.0), inf
    with suppress(ArithmeticError):  # beyond the numbers of the machine
        hanging = rod["inertia"] + rod["mass"] * rod["centroid"] ** 2 + slider["mass"] * rod["length"] ** 2
        mass = 1.0 / (rod["length"] ** 2 / hanging + (slider["length"] / 2.0) ** 2 / slider["inertia"])
        for joint in scene.loose:
            gap, radius, partners = scene.clearance(joint), contact["corner_radius"], PARTNERS
            if joint == "crank_pin":  # journal and bearing, both of the guide's material
                journal = data["clearance"]["journal_radius"]
                radius, partners = journal * (journal + gap) / gap, ("guide", "guide")
            poisson, modulus = contact["poisson"], contact["youngs_modulus"]
            compliance = sum(
                (1.0 - _of_partner(poisson, one) ** 2) / _of_partner(modulus, one) for one in partners
            )
            stiffness = 4.0 / (3.0 * compliance) * sqrt(radius)
            if contact["law"] == "adams-impact":
                stiffness = contact["stiffness"] or stiffness
            speed = pi / 30.0 * abs(data["drive"]["speed_rpm"]) * sqrt(mechanism["crank"]["length"] * gap)
            depth = ((n + 1.0) * mass * speed**2 / (2.0 * stiffness)) ** share
            time = 2.0 * depth / speed * sqrt(pi) * gamma(1.0 + share) / gamma(0.5 + share)
            shortest = min(shortest, time or inf)
    return shortest


def _at_workpiece(data: Mapping[str, Any]) -> Iterator[str]:
    load, bodies = data["load"], data["mechanism"]
    reach = sum(bodies[name]["length"] for name in ("crank", "rod2", "rocker", "rod4"))
    keys = [key for key in ("surface", "depth", "exponent") if load[key] != Load.model_fields[key].default]
    if not load["force"] and not load["table"]:
        if keys:
            yield f"load.{keys[0]} = {load[keys[0]]:g} has no effect without load.force or load.table"
        return
    if abs(load["surface"]) > reach:
        yield f"load.surface = {load['surface']:g} m is beyond the linkage, {reach:g} m: its unit is m"
    depth = load["table"][1][0] if len(load["table"]) > 1 else load["depth"]
    if depth > reach / 2.0:
        where = "load.table: a depth of" if load["table"] else "load.depth ="
        yield f"{where} {depth:g} m is as large as the linkage, {reach:g} m: its unit is m"


def heavy_load(data: Mapping[str, Any], forces: Mapping[str, float]) -> str:
    """Return a line if a model's forces of the workpiece (`comparison.models.check`) are absurd, else ""."""
    if "mechanism" not in data:
        return ""
    weight = data["mechanism"]["slider"]["mass"] * 9.81
    keys = "load.surface and load.table" if data["load"]["table"] else "load.surface, load.depth, load.force"
    for name, where in (("load_at_start", "at the start"), ("largest_load", "at bottom dead centre")):
        force = forces.get(name, 0.0)
        if force > HEAVIEST_LOAD * weight:
            push = f"{force:.2g} N {where}, {force / weight:.1g} times the slider's weight"
            return f"load: the workpiece pushes with {push}: check {keys}"
    return ""


def _in_guide(data: Mapping[str, Any]) -> Iterator[str]:
    slider, gap, start = data["mechanism"]["slider"], data["clearance"]["slider"], data["initial"]
    width, length, radius = slider["width"], slider["length"], data["contact"]["corner_radius"]
    size = f"(width {width:g} m, length {length:g} m)"
    if (tilt := 2.0 * gap / length) > LARGEST_TILT:
        over = width + 2.0 * gap > hypot(width, length)
        does = "turn over" if over else f"tilt by {degrees(tilt):.2g} degrees"
        yield f"clearance.slider = {gap:g} m lets the slider {size} {does} in its guide"
    if radius > min(width, length) / 2.0:
        yield f"contact.corner_radius = {radius:g} m is larger than half the slider {size}"
    offset, angle = start["slider_offset"], start["slider_angle"]
    depth = abs(offset) - gap + (length * abs(sin(angle)) + width * (abs(cos(angle)) - 1.0)) / 2.0
    if abs(offset) > gap:
        yield (
            f"initial.slider_offset = {offset:g} m exceeds clearance.slider = {gap:g} m: the slider starts "
            "inside the wall"
        )
    elif depth > radius:  # no contact law holds there
        yield (
            f"initial.slider_angle = {angle:g} rad puts a corner {depth:.2g} m inside the wall, deeper than "
            f"contact.corner_radius = {radius:g} m"
        )


def _of_partner(material: Any, partner: str) -> float:
    return float(material[partner] if isinstance(material, dict) else material)
