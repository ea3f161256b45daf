"""Keys of a linkage: a scene with tables ``body``, of any planar bodies, joints, springs and drive.

Its complete mapping has the points of all bodies and all defaults; a key without a value is left out.
"""

import tomllib
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from itertools import pairwise
from math import ceil, cos, dist, hypot, pi, radians, sin
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from comparison.scene.schema import (
    EXUDYN_STEP,
    KG,
    KGM2,
    M_S,
    MAX_SAMPLES,
    MAX_SAMPLES_PER_CYCLE,
    RAD_S,
    Compare,
    DampingModel,
    Environment,
    Friction,
    Load,
    M,
    NotNegative,
    Poisson,
    Positive,
    Real,
    Reliability,
    S,
    Section,
    Solver,
    Texts,
    Unit,
    common_violations,
    contact_violations,
)

NAME_TABLES = ("body", "pin", "guide", "spring", "initial", "guess")
"""Tables that hold a table for each name, of a body in the last two."""
STEPS_IN_TURN, STEPS = 50_000, 100_000
"""Least default steps of Exudyn, in a turn where a speed drives, else in the duration."""
ENERGIES = ("kinetic", "gravity", "drive", "spring", "contact", "damping", "friction", "load", "residual")
DEG, N_M = Unit("deg"), Unit("N m")
CORNERS = (".ll", ".lr", ".ul", ".ur")
"""Ends of the names of a guide's contacts: corners of the block, lower and upper along it, left and right."""


def _on_axis(value: object) -> object:
    if not isinstance(value, int | float | list):
        raise PydanticCustomError("rule", "", {"text": "must be a number or [x, y]"})
    return value if isinstance(value, list) else [value, 0.0]


Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$", max_length=50)]
Pair = Annotated[list[Real], Field(min_length=2, max_length=2)]
Samples = Annotated[int, Field(ge=1, le=MAX_SAMPLES)]


class Body(Section):
    """Rigid body; its points are in a frame of its own."""

    mass: Annotated[Positive, KG]
    """Mass."""
    inertia: Annotated[Positive, KGM2]
    """Moment of inertia J about the centroid."""
    centroid: Annotated[Pair, BeforeValidator(_on_axis), M] = Field(default=[0.0, 0.0])
    """Centroid (centre of mass), [x, y], or its distance c from the origin for [c, 0]."""
    length: Annotated[Positive | None, M] = None
    """Length of a rod: short for the points start = [0, 0] and end = [length, 0]."""
    points: Annotated[dict[Name, Pair], M] = Field(default={})
    """Points for joints and springs, [x, y] each."""


class Pin(Section):
    """Revolute joint."""

    joins: Annotated[list[str], Field(min_length=2, max_length=2)]
    """The two points, BODY.POINT each (BODY.centroid is one as well); the first may be "frame"."""
    point: Annotated[Pair, M] = Field(default=[0.0, 0.0])
    """Place of the joint in the fixed frame, where it joins the frame."""


class Guide(Section):
    """Prismatic joint: the centroid of a body stays on a line, and the body keeps its angle to that."""

    body: str
    """Body that slides (block)."""
    on: str = "frame"
    """Body that the guide is part of, or "frame"."""
    point: Annotated[Pair, M] = Field(default=[0.0, 0.0])
    """Point of the line, in the frame of that body."""
    direction_deg: Annotated[Real, DEG] = 0.0
    """Direction of the line there."""
    angle_deg: Annotated[Real | None, DEG] = None
    """Angle of the sliding body there; by default direction_deg."""


class Spring(Pin):
    """Spring with damper between two points."""

    stiffness: Annotated[NotNegative, Unit("N/m")]
    """Stiffness."""
    length: Annotated[NotNegative, M]
    """Free length, without force."""
    damping: Annotated[NotNegative, Unit("N s/m")] = 0.0
    """Damping coefficient."""


class LinkageContact(Section):
    """Contact law and materials of clearances: keys of the press's, with one number for both partners."""

    law: Literal["hertz-corners", "adams-impact"] = "hertz-corners"
    """Contact model, force law: by Hertz, or IMPACT of ADAMS."""
    youngs_modulus: Annotated[Positive, Unit("Pa")] = 210e9
    """Young's modulus E (elastic stiffness) of the material."""
    poisson: Poisson = 0.28
    """Poisson's ratio nu of the material."""
    restitution: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] = 0.9
    """Coefficient of restitution e of an impact, which sets the damping: 1 has none."""
    damping_model: DampingModel = "lankarani-nikravesh"
    """Damping factor of Hertz's law."""
    exponent: Annotated[float, Field(ge=1, allow_inf_nan=False)] = 1.5
    """Exponent n (power) of the depth in the contact force."""
    impact_speed_floor: Annotated[Positive, M_S] = 1e-4
    """Smallest impact speed that the damping refers to."""
    stiffness: Annotated[Positive | None, Unit("N/m^n")] = None
    """Stiffness k of the law adams-impact; without it K of Hertz's law, from the materials."""
    damping: Annotated[NotNegative, Unit("N s/m")] = 260.0
    """Largest damping coefficient c_max of the law adams-impact."""
    damping_depth: Annotated[Positive, M] = 1e-5
    """Depth d_max at which the damping of the law adams-impact is the largest."""


class LinkageFriction(Friction):
    """Modified Coulomb friction in clearances, none by default."""

    coefficient: NotNegative = 0.0
    """Coefficient mu of Coulomb friction (dynamic, kinetic)."""
    static_speed: Annotated[NotNegative, M_S] = 1e-4
    """Sliding speed v0 below which there is no friction."""
    transition_speed: Annotated[Positive, M_S] = 1e-3
    """Sliding speed v1 above which friction is full; it exceeds static_speed."""


class Clearance(Section):
    """Clearance of the pin or guide of its name: journal in bearing, or rectangular block between walls."""

    size: Annotated[Positive, M]
    """Gap (play): radial of a pin, on each side of a guide."""
    journal_radius: Annotated[Positive | None, M] = None
    """Radius of a pin's journal, which the first of the two points carries; 0.01 by default."""
    length: Annotated[Positive | None, M] = None
    """Length of a guide's block along the guide."""
    width: Annotated[Positive | None, M] = None
    """Width of a guide's block across the guide."""
    corner_radius: Annotated[Positive | None, M] = None
    """Radius (rounding) of the block's corners in Hertz's law; 0.001 by default."""
    offset: Annotated[Pair | Real | None, M] = None
    """Start: [x, y] of the journal from the bearing's centre, or distance of the block to the line's left."""
    offset_rate: Annotated[Pair | Real | None, M_S] = None
    """Start: rate of the offset."""
    tilt_deg: Annotated[Real | None, DEG] = None
    """Start: angle of a guide's block beyond the guide's angle_deg."""
    tilt_rate: Annotated[Real | None, RAD_S] = None
    """Start: rate of the tilt."""
    contact: LinkageContact | None = None
    friction: LinkageFriction | None = None


OF_PIN: dict[str, Any] = {"journal_radius": 0.01, "offset": [0.0, 0.0], "offset_rate": [0.0, 0.0]}
OF_GUIDE: dict[str, Any] = {"length": None, "width": None, "corner_radius": 1e-3}
OF_GUIDE |= dict.fromkeys(("offset", "offset_rate", "tilt_deg", "tilt_rate"), 0.0)
"""Keys of a clearance at a pin, at a guide, and their defaults; without one a key must be given."""


class LinkageDrive(Section):
    """Drive of one body: a speed, a torque, or none."""

    body: str | None = None
    """Body that is driven."""
    speed_rpm: Annotated[Real | None, Unit("rpm")] = None
    """Constant speed, counter-clockwise positive; not zero."""
    cycles: Positive | None = None
    """Duration in turns (revolutions) of a body driven by speed, 1 by default."""
    torque: Annotated[Real | None, N_M] = None
    """Constant torque of the motor, from the frame, in place of a speed."""
    torque_table: list[Pair] | None = None
    """Rows [angle in deg, torque in N m] over a turn, 0 to 360, linear and periodic, in place of a speed."""
    free: Literal[True] | None = None
    """No drive."""


class Guess(Section):
    """Position of a body, from which Newton's iteration assembles the linkage; it chooses the branch."""

    x: Annotated[Real | None, M] = None
    """Position x of the centroid."""
    y: Annotated[Real | None, M] = None
    """Position y of the centroid."""
    angle_deg: Annotated[Real | None, DEG] = None
    """Angle."""


class Start(Guess):
    """State of a body that holds at the start: as many values in all as there are degrees of freedom."""

    vx: Annotated[Real | None, M_S] = None
    """Velocity x of the centroid."""
    vy: Annotated[Real | None, M_S] = None
    """Velocity y of the centroid."""
    omega: Annotated[Real | None, RAD_S] = None
    """Angular velocity."""


class BodyLoad(Load):
    """Elastic workpiece below a body's centroid."""

    body: str
    """Body that it pushes up."""


class LinkageOutput(Section):
    """Recorded channel groups and sampling density."""

    groups: list[Literal["accelerations", "contacts", "joints", "energy"]] = Field(default=["accelerations"])
    """Groups of channels besides the bodies' motion; by default, with clearance, contacts as well."""
    samples_per_cycle: Annotated[int, Field(ge=2, le=MAX_SAMPLES_PER_CYCLE)] | None = None
    """Samples in a turn of a body driven by speed, 1000 by default."""
    duration: Annotated[Positive | None, S] = None
    """Duration (end time) where no speed drives."""
    samples: Samples | None = None
    """Intervals between samples in the duration, 1000 by default."""


class LinkageReliability(Reliability):
    """Criteria for the errors of a body's motion, against the same linkage without clearance."""

    of: str | None = None
    """Channel of the displacement, x, y or angle of a body (limits in rad), of which there is a rule."""

    @property
    def channels(self) -> dict[str, str]:
        """Channel of each quantity that has limits."""
        body, _, axis = (self.of or ".x").rpartition(".")
        parts = ("angle", "omega", "alpha") if axis == "angle" else (axis, f"v{axis}", f"a{axis}")
        return {name: f"{body}.{part}" for name, part in zip(super().channels, parts, strict=True)}


class LinkageKeys(Section):
    """Complete linkage."""

    scene: Texts
    body: Annotated[dict[Name, Body], Field(min_length=1)]
    pin: dict[Name, Pin] = Field(default={})
    guide: dict[Name, Guide] = Field(default={})
    spring: dict[Name, Spring] = Field(default={})
    clearance: dict[Name, Clearance] = Field(default={})
    contact: LinkageContact | None = None
    friction: LinkageFriction | None = None
    drive: LinkageDrive
    initial: dict[Name, Start] = Field(default={})
    guess: dict[Name, Guess] = Field(default={})
    load: BodyLoad | None = None
    environment: Environment = Environment(gravity=0.0)
    output: LinkageOutput = LinkageOutput()
    solver: Solver = Solver()
    compare: Compare = Compare()
    reliability: LinkageReliability = LinkageReliability()

    def _violations(self) -> Iterator[tuple[str, object, str]]:
        yield from self._name_violations()
        drive, output = self.drive, self.output
        if drive.speed_rpm == 0:
            yield "drive.speed_rpm", 0.0, "must not be zero"
        rows = [[0.0, 0.0], [360.0, 0.0]] if drive.torque_table is None else drive.torque_table
        if [row[0] for row in rows[:1] + rows[-1:]] != [0.0, 360.0] or rows[0][1] != rows[-1][1]:
            yield "drive.torque_table", rows, "must lead from 0 to 360 deg, with equal torques there"
        if any(after[0] <= before[0] for before, after in pairwise(rows)):
            yield "drive.torque_table", rows, "must have rising angles"
        gaps, body = self.clearance, drive.body
        carriers = {guide.body: guide.on for name, guide in self.guide.items() if name not in gaps}
        while body in carriers:
            body = carriers.pop(body)
        if body == "frame" and not drive.free:
            yield "drive.body", drive.body, "cannot turn: a guide holds its angle"
        ways = ("speed_rpm", "torque", "torque_table", "free")
        if len(choices := [way for way in ways if getattr(drive, way) is not None]) != 1:
            yield "drive", choices, f"must have one of {', '.join(ways)}"
        by_speed = drive.speed_rpm is not None
        keys = {"drive.cycles": drive.cycles, "output.samples_per_cycle": output.samples_per_cycle}
        other = {"output.duration": output.duration, "output.samples": output.samples}
        for key, value in (other if by_speed else keys).items():
            if value is not None:
                yield key, value, f"is for a linkage {'without' if by_speed else 'with'} drive.speed_rpm"
        if not by_speed and output.duration is None:
            yield "output.duration", None, "must be given (s): a drive without speed_rpm needs it"
        samples = (drive.cycles or 1.0) * (output.samples_per_cycle or 1000)
        if not 0.5 < samples <= MAX_SAMPLES:
            yield "drive.cycles", drive.cycles, f"must give 1 to {MAX_SAMPLES} samples, not {samples:g}"
        yield from self._clearance_violations()
        yield from common_violations(self)

    @property
    def laws(self) -> dict[str, tuple[LinkageContact, LinkageFriction]]:
        """Contact law and friction of each clearance, by the beginning of its keys; the usual ones by ""."""
        default = self.contact or LinkageContact(), self.friction or LinkageFriction()
        special = {
            f"clearance.{name}.": (_over(default[0], each.contact), _over(default[1], each.friction))
            for name, each in self.clearance.items()
        }
        return {"": default} | special

    def _clearance_violations(self) -> Iterator[tuple[str, object, str]]:
        for table in ("contact", "friction"):
            if (section := getattr(self, table)) and not self.clearance:
                yield table, section.model_dump(exclude_unset=True), "is for a linkage with a table clearance"
        for name, clearance in self.clearance.items():
            at, defaults = f"clearance.{name}", OF_PIN if name in self.pin else OF_GUIDE
            if name not in {**self.pin, **self.guide}:
                yield at, name, f"is no pin or guide{_close(name, {**self.pin, **self.guide})}"
            for key in OF_PIN | OF_GUIDE:
                value, default = getattr(clearance, key), defaults.get(key)
                if value is None and key in defaults and default is None:
                    yield f"{at}.{key}", None, "is missing: a guide needs it"
                elif value is not None and key not in defaults:
                    yield f"{at}.{key}", value, f"is for a {'guide' if defaults is OF_PIN else 'pin'}"
                elif value is not None and isinstance(value, list) is not isinstance(default, list):
                    yield f"{at}.{key}", value, f"must be {'[x, y]' if defaults is OF_PIN else 'a number'}"
            offset, size = clearance.offset or 0.0, clearance.size
            depth = (hypot(*offset) if isinstance(offset, list) else abs(offset)) - size
            if clearance.tilt_deg and clearance.length and clearance.width:
                tilt = radians(clearance.tilt_deg)
                depth += (clearance.length * abs(sin(tilt)) + clearance.width * (abs(cos(tilt)) - 1.0)) / 2.0
            if depth > 0.0:
                key, beyond = "offset", f"starts {depth:.3g} m beyond the gap {at}.size = {size:g} m"
                if not offset:
                    key = "tilt_deg"
                elif clearance.tilt_deg:
                    beyond = f"with tilt_deg = {clearance.tilt_deg:g} deg {beyond}"
                yield f"{at}.{key}", getattr(clearance, key), beyond
        for at, laws in self.laws.items():
            yield from contact_violations(*laws, at)

    def _name_violations(self) -> Iterator[tuple[str, object, str]]:
        """Yield names of bodies or points that do not exist, and names that two things share."""
        names = ["frame", "drive"]
        for table in NAME_TABLES[:4]:
            for name in getattr(self, table):
                if name in names:
                    yield (
                        f"{table}.{name}",
                        name,
                        "is taken: bodies, pins, guides, springs, frame and drive have names of their own",
                    )
                names.append(name)
        bodies = [("drive.body", self.drive.body)] if self.drive.body or not self.drive.free else []
        bodies += [("load.body", self.load.body)] if self.load else []
        bodies += [(f"{table}.{name}", name) for table in NAME_TABLES[4:] for name in getattr(self, table)]
        for name, guide in self.guide.items():
            bodies += [(f"guide.{name}.body", guide.body)]
            bodies += [(f"guide.{name}.on", guide.on)] if guide.on != "frame" else []
            if guide.on == guide.body:
                yield f"guide.{name}.on", guide.on, "must be another body"
        for name, body in self.body.items():
            if "centroid" in body.points:
                yield f"body.{name}.points.centroid", body.points["centroid"], "is body.centroid already"
            for point, at in ends_of(body).items():
                if (position := body.points.get(point, at)) != at:
                    yield f"body.{name}.points.{point}", position, f"differs from {at}, by body.{name}.length"
        if (channel := self.reliability.of) and channel.rpartition(".")[2] not in ("x", "y", "angle"):
            yield "reliability.of", channel, "must be BODY.x, BODY.y or BODY.angle"
        bodies += [("reliability.of", channel.rpartition(".")[0])] if channel else []
        for key, value in bodies:
            if value not in self.body:
                yield key, value, f"is no body{_close(str(value), self.body)}"
        points = {f"{name}.{point}": name for name, body in self.body.items() for point in points_of(body)}
        for table in ("pin", "spring"):
            for name, joint in getattr(self, table).items():
                key, (first, second) = f"{table}.{name}.joins", joint.joins
                for place in [second] if first == "frame" else joint.joins:
                    if place == "frame":
                        yield key, joint.joins, "must name 'frame' first, and once"
                    elif place not in points:
                        yield key, joint.joins, f"names no point {place!r}{_close(place, points)}"
                if first != "frame" and points[first] == points[second]:
                    yield key, joint.joins, "joins a body to itself"
                elif first != "frame" and joint.point != [0.0, 0.0]:
                    yield f"{table}.{name}.point", joint.point, "is for a joint with the frame alone"


def _over(usual: Any, law: Section | None) -> Any:
    """Return the usual law with the keys that the law of one clearance gives."""
    return usual.model_copy(update={key: getattr(law, key) for key in law.model_fields_set}) if law else usual


def _close(wrong: str, names: Mapping[str, object]) -> str:
    close = get_close_matches(wrong, names, n=1)
    return f"; did you mean {close[0]}?" if close else f"; there are {', '.join(names)}"


def points_of(body: Body) -> dict[str, list[float]]:
    """Return the points of a body, with those of a rod and the centroid, m."""
    return ends_of(body) | body.points | {"centroid": body.centroid}


def ends_of(body: Body) -> dict[str, list[float]]:
    """Return the points that the length of a body gives, m."""
    return {} if body.length is None else {"start": [0.0, 0.0], "end": [body.length, 0.0]}


def complete(keys: LinkageKeys) -> dict[str, Any]:
    """Return the complete mapping, without the criteria: the input of a model."""
    data = keys.model_dump(exclude={"compare", "reliability"}, exclude_none=True)
    for name, body in keys.body.items():
        data["body"][name]["points"] = {k: at for k, at in points_of(body).items() if k != "centroid"}
    for guide in data["guide"].values():
        guide.setdefault("angle_deg", guide["direction_deg"])
    for guess in data["guess"].values():
        guess.setdefault("angle_deg", 0.0)
    drive, output, gaps = data["drive"], data["output"], data["clearance"]
    for at, laws in keys.laws.items() if gaps else ():
        table = gaps[at.split(".")[1]] if at else data
        table |= {name: law.model_dump() for name, law in zip(("contact", "friction"), laws, strict=True)}
    for name in gaps:
        gaps[name] = (OF_PIN if name in keys.pin else OF_GUIDE) | gaps[name]
    if not gaps:
        del data["clearance"]
    elif "groups" not in keys.output.model_fields_set:
        output["groups"] = ["accelerations", "contacts"]
    if "speed_rpm" in drive:
        drive.setdefault("cycles", 1.0)
        span, steps, samples = 60.0 / abs(drive["speed_rpm"]), STEPS_IN_TURN, "samples_per_cycle"
    else:
        span, steps, samples = output["duration"], STEPS, "samples"
    count = output.setdefault(samples, 1000)
    if "step" not in keys.solver.exudyn.model_fields_set:
        steps = max(steps, span / EXUDYN_STEP) if gaps else steps  # contacts are as short as the press's
        data["solver"]["exudyn"]["step"] = span / count / ceil(steps / count)
    for model, formulation in (("reference", "multiplier"), ("exudyn", "full")):
        if data["solver"][model]["formulation"] == "auto":
            data["solver"][model]["formulation"] = formulation
    return data


def criteria(keys: LinkageKeys) -> LinkageReliability:
    """Return the limits with their channel, by default one of the last body that is not driven.

    It is x or y, whichever is nearer to a guide of the frame that guides the body; without one the angle.
    """
    *_, body = [name for name in keys.body if name != keys.drive.body] or keys.body
    guides = [guide for guide in keys.guide.values() if (guide.body, guide.on) == (body, "frame")]
    along = [abs(part(radians(guide.direction_deg))) for guide in guides[:1] for part in (cos, sin)]
    axis = "xy"[along[1] > along[0]] if along else "angle"
    return keys.reliability.model_copy(update={"of": keys.reliability.of or f"{body}.{axis}"})


def quantities(data: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the fields of each channel that a linkage requests, by name; of a channel of the press none."""
    size, rpm = largest_length(data), abs(data["drive"].get("speed_rpm", 0.0))
    scales = {"length": size, "1": 1.0, "length/T": size * rpm * pi / 30, "1/T": rpm * pi / 30}
    groups, definitions = {"motion", *data["output"]["groups"]}, dict[str, dict[str, Any]]()
    tables = {**data, "drive": ["drive"] if rpm else []}
    places = [("body", name) for name in data["body"]]
    places += [("corner" if "." in place else "journal", place) for place in contacts(data)]
    places += [(table, name) for table in ("pin", "guide", "spring", "drive") for name in tables[table]]
    for table, name in places:
        scales["clearance"] = data.get("clearance", {}).get(name.partition(".")[0], {}).get("size", 0.0)
        prefix = f"{name}{'_' if table == 'corner' else '.'}"
        for quantity, keys in _file()[table].items():
            fields: dict[str, Any] = {"label": f"{name} {quantity}".replace("_", " ")}
            fields |= {key: f"{prefix}{keys[key]}" for key in ("rate", "follows") if key in keys}
            fields["gap"] = tuple(f"{prefix}{axis}" for axis in keys.get("gap", ()))
            scale = scales.get(keys.get("scale", "")) or None
            definitions[f"{prefix}{quantity}"] = keys | fields | {"scale": "range", "given": scale}
    definitions = {name: keys for name, keys in definitions.items() if keys["group"] in groups}
    absent = {"load"} - {*data} | (set() if "clearance" in data else {"contact", "friction"})
    energies = [f"energy_{part}" for part in ENERGIES if "energy" in groups and part not in absent]
    return definitions | {name: _file()["energy"].get(name, {}) for name in energies}


def contacts(data: Mapping[str, Any]) -> list[str]:
    """Return the contacts of a linkage as event tables name them: "PIN", and "GUIDE.ll" of each corner."""
    gaps = data.get("clearance", {})
    return [f"{name}{end}" for name in gaps for end in (CORNERS if name in data["guide"] else [""])]


def largest_length(data: Mapping[str, Any]) -> float:
    """Return the largest distance of two points of one body of a linkage, or of its frame, m."""
    joints = [*data["pin"].values(), *data["spring"].values()]
    parts = [[joint["point"] for joint in joints if joint["joins"][0] == "frame"]]
    parts += [[body["centroid"], *body["points"].values()] for body in data["body"].values()]
    return max((dist(a, b) for points in parts for a in points for b in points), default=0.0) or 1.0


@cache
def _file() -> dict[str, Any]:
    return tomllib.loads(files("comparison.scene").joinpath("linkage.toml").read_text("utf-8"))
