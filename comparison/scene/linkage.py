"""Keys of a linkage: a scene with tables ``body``, of any planar bodies, joints, springs and drive.

Its complete mapping has the points of all bodies, defaults, and no key that is neither given nor has one.
"""

import tomllib
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from itertools import pairwise
from math import ceil, dist, pi
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from comparison.scene.schema import (
    KG,
    KGM2,
    M_S,
    MAX_SAMPLES,
    MAX_SAMPLES_PER_CYCLE,
    RAD_S,
    Compare,
    Environment,
    Load,
    M,
    NotNegative,
    Positive,
    Real,
    S,
    Section,
    Solver,
    Texts,
    Unit,
    common_violations,
)

NAMED = ("body", "pin", "guide", "spring", "initial", "guess")
"""Tables that hold a table for each name, of a body in the last two."""
STEPS_IN_TURN, STEPS = 50_000, 100_000
"""Default steps of Exudyn at least, in a turn of what a speed drives, else in the duration."""
DEG, N_M = Unit("deg"), Unit("N m")


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

    groups: list[Literal["accelerations", "joints", "energy"]] = Field(default=["accelerations"])
    """Groups of channels besides the bodies' motion."""
    samples_per_cycle: Annotated[int, Field(ge=2, le=MAX_SAMPLES_PER_CYCLE)] | None = None
    """Samples in a turn of a body driven by speed, 1000 by default."""
    duration: Annotated[Positive | None, S] = None
    """Duration (end time) where no speed drives."""
    samples: Samples | None = None
    """Intervals between samples in the duration, 1000 by default."""


class LinkageKeys(Section):
    """Complete linkage."""

    scene: Texts
    body: Annotated[dict[Name, Body], Field(min_length=1)]
    pin: dict[Name, Pin] = Field(default={})
    guide: dict[Name, Guide] = Field(default={})
    spring: dict[Name, Spring] = Field(default={})
    drive: LinkageDrive
    initial: dict[Name, Start] = Field(default={})
    guess: dict[Name, Guess] = Field(default={})
    load: BodyLoad | None = None
    environment: Environment = Environment(gravity=0.0)
    output: LinkageOutput = LinkageOutput()
    solver: Solver = Solver()
    compare: Compare = Compare()

    def _violations(self) -> Iterator[tuple[str, object, str]]:
        yield from self._name_violations()
        drive, output = self.drive, self.output
        if drive.speed_rpm == 0:
            yield "drive.speed_rpm", 0.0, "must not be zero"
        rows = drive.torque_table or [[0.0, 0.0], [360.0, 0.0]]
        if [rows[0][0], rows[-1][0]] != [0.0, 360.0] or rows[0][1] != rows[-1][1]:
            yield "drive.torque_table", rows, "must lead from 0 to 360 deg, with equal torques there"
        if any(after[0] <= before[0] for before, after in pairwise(rows)):
            yield "drive.torque_table", rows, "must have rising angles"
        guided, body = {guide.body: guide.on for guide in self.guide.values()}, drive.body
        while body in guided:
            body = guided.pop(body)
        if body == "frame" and not drive.free:
            yield "drive.body", drive.body, "cannot turn: a guide holds its angle"
        ways = ("speed_rpm", "torque", "torque_table", "free")
        if len(given := [way for way in ways if getattr(drive, way) is not None]) != 1:
            yield "drive", given, f"must have one of {', '.join(ways)}"
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
        yield from common_violations(self)

    def _name_violations(self) -> Iterator[tuple[str, object, str]]:
        """Yield names that are not those of bodies or of their points, or of two things."""
        seen = ["frame", "drive"]
        for table in NAMED[:4]:
            for name in getattr(self, table):
                if name in seen:
                    yield (
                        f"{table}.{name}",
                        name,
                        "is taken: bodies, pins, guides, springs, frame and drive have names of their own",
                    )
                seen.append(name)
        bodies = [("drive.body", self.drive.body)] if self.drive.body or not self.drive.free else []
        bodies += [("load.body", self.load.body)] if self.load else []
        bodies += [(f"{table}.{name}", name) for table in NAMED[4:] for name in getattr(self, table)]
        for name, guide in self.guide.items():
            bodies += [(f"guide.{name}.body", guide.body)]
            bodies += [(f"guide.{name}.on", guide.on)] if guide.on != "frame" else []
            if guide.on == guide.body:
                yield f"guide.{name}.on", guide.on, "must be another body"
        for name, body in self.body.items():
            if "centroid" in body.points:
                yield f"body.{name}.points.centroid", body.points["centroid"], "is body.centroid already"
            for point, at in ends_of(body).items():
                if (stated := body.points.get(point, at)) != at:
                    yield f"body.{name}.points.{point}", stated, f"differs from {at}, by body.{name}.length"
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
    """Return the complete mapping, without `Compare`: the input of a model."""
    data = keys.model_dump(exclude={"compare"}, exclude_none=True)
    for name, body in keys.body.items():
        data["body"][name]["points"] = {k: at for k, at in points_of(body).items() if k != "centroid"}
    for guide in data["guide"].values():
        guide.setdefault("angle_deg", guide["direction_deg"])
    for guess in data["guess"].values():
        guess.setdefault("angle_deg", 0.0)
    drive, output = data["drive"], data["output"]
    if "speed_rpm" in drive:
        drive.setdefault("cycles", 1.0)
        span, steps, samples = 60.0 / abs(drive["speed_rpm"]), STEPS_IN_TURN, "samples_per_cycle"
    else:
        span, steps, samples = output["duration"], STEPS, "samples"
    count = output.setdefault(samples, 1000)
    if "step" not in keys.solver.exudyn.model_fields_set:
        data["solver"]["exudyn"]["step"] = span / count / ceil(steps / count)
    for model, usual in (("reference", "multiplier"), ("exudyn", "full")):
        if data["solver"][model]["formulation"] == "auto":
            data["solver"][model]["formulation"] = usual
    return data


def quantities(data: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the quantities that a linkage requests, by name: fields of a channel, or none of a press's."""
    size, rpm = largest_length(data), abs(data["drive"].get("speed_rpm", 0.0))
    scales = {"length": size, "1": 1.0, "length/T": size * rpm * pi / 30, "1/T": rpm * pi / 30}
    groups, known = {"motion", *data["output"]["groups"]}, dict[str, dict[str, Any]]()
    for table, names in {**data, "drive": ["drive"] if rpm else []}.items():
        for name in names if table in _file() else ():
            for quantity, keys in _file()[table].items():
                own = {"label": f"{name} {quantity}".replace("_", " ")}
                own |= {"rate": f"{name}.{keys['rate']}"} if "rate" in keys else {}
                given = scales.get(keys.get("scale", "")) or None
                known[f"{name}.{quantity}"] = keys | own | {"scale": "range", "given": given}
    known = {name: keys for name, keys in known.items() if keys["group"] in groups}
    parts = ("kinetic", "gravity", "drive", "spring", "damping", *(["load"] * ("load" in data)), "residual")
    energies = [f"energy_{part}" for part in parts if "energy" in groups]
    return known | {name: _file()["energy"].get(name, {}) for name in energies}


def largest_length(data: Mapping[str, Any]) -> float:
    """Return the largest distance of two points of one body of a linkage, or of its frame, m."""
    joints = [*data["pin"].values(), *data["spring"].values()]
    parts = [[joint["point"] for joint in joints if joint["joins"][0] == "frame"]]
    parts += [[body["centroid"], *body["points"].values()] for body in data["body"].values()]
    return max((dist(a, b) for points in parts for a in points for b in points), default=0.0) or 1.0


@cache
def _file() -> dict[str, Any]:
    return tomllib.loads(files("comparison.scene").joinpath("linkage.toml").read_text("utf-8"))
