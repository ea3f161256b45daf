"""Keys of a scene: type, unit, rule for the value, and default where there is one.

The numbers of the mechanism, with their sources, are in ``shipped/paper.toml``, which a scene extends.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite
from typing import Annotated, Any, Generic, Literal, Self, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from comparison.models import engine_names, is_setting, smallest_in_exudyn

MAX_SAMPLES = 100_000_000  # a larger table would not fit into the memory of an ordinary machine
MAX_SAMPLES_PER_CYCLE = 10**15  # of which a short share is asked for; below it floats count exactly
NAME = r"^[A-Za-z0-9][A-Za-z0-9._+=-]*$"
"""Of a scene, which names files."""
MATERIALS = ("contact.youngs_modulus", "contact.poisson")
PARTNERS = ("slider", "guide")
"""Keys of a number for both partners of a contact, or of one for each."""
Number = TypeVar("Number")


@dataclass(frozen=True)
class Unit:
    """Unit of a key and of those below it, for messages."""

    symbol: str


def integer(value: object) -> object:
    """Reject what is equal to an integer and is none: true, 1.0."""
    if type(value) is not int:
        raise PydanticCustomError("literal_error", "", {"expected": "-1 or 1"})
    return value


Real = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Poisson = Annotated[float, Field(gt=-1, le=0.5, allow_inf_nan=False)]
Sign = Annotated[Literal[-1, 1], BeforeValidator(integer)]
M, KG, KGM2, S = Unit("m"), Unit("kg"), Unit("kg m^2"), Unit("s")
M_S, M_S2, RAD, RAD_S = Unit("m/s"), Unit("m/s^2"), Unit("rad"), Unit("rad/s")


class Section(BaseModel):
    """Section of the scene file; unknown keys are rejected."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class Texts(Section):
    """Name and title of the scene."""

    name: Annotated[str, Field(min_length=1, max_length=100, pattern=NAME)]
    title: str
    description: str = ""


class Rod(Section):
    """Slender body between two pins; the centroid is measured from the first pin."""

    length: Annotated[Positive, M]
    centroid: Annotated[Real, M]
    mass: Annotated[Positive, KG]
    inertia: Annotated[Positive, KGM2]


class Slider(Section):
    """The slider: length along the guide (y), width across it (x)."""

    mass: Annotated[Positive, KG]
    inertia: Annotated[Positive, KGM2]
    length: Annotated[Positive, M]
    width: Annotated[Positive, M]
    thickness: Annotated[Positive, M]


class Mechanism(Section):
    """Bodies and their assembly positions."""

    crank: Rod
    rod2: Rod
    rocker: Rod
    rod4: Rod
    slider: Slider
    rocker_pivot: Annotated[list[Real], Field(min_length=2, max_length=2), M]
    guide_x: Annotated[Real, M]
    reference_offset: Annotated[Real, M]
    crank_angle_deg: Annotated[Real, Unit("deg")]
    rocker_branch: Sign
    slider_branch: Sign


class Drive(Section):
    """Constant speed of the crank, counter-clockwise positive, and number of cycles."""

    speed_rpm: Annotated[Real, Unit("rpm")]
    cycles: Positive


class Initial(Section):
    """Initial state of the slider relative to the guide's centre line; None: on the ideal slider's line."""

    slider_offset: Annotated[Real | None, M] = None
    slider_angle: Annotated[Real, RAD] = 0.0
    slider_vx: Annotated[Real, M_S] = 0.0
    slider_omega: Annotated[Real, RAD_S] = 0.0


class Joints(Section):
    """Type of the joints that may have clearance."""

    slider: Literal["clearance", "ideal"] = "clearance"
    crank_pin: Literal["ideal", "clearance"] = "ideal"


class Clearance(Section):
    """Clearances: per side for the slider, radial for the crank pin."""

    slider: Annotated[NotNegative, M]
    crank_pin: Annotated[NotNegative, M]
    journal_radius: Annotated[Positive, M]


class Partners(Section, Generic[Number]):
    """A number of each partner of a contact."""

    slider: Number
    guide: Number


ONE, EACH = Tag("number"), Tag("partners")
CHOICE = Discriminator(lambda value: "partners" if isinstance(value, dict | Section) else "number")


class Contact(Section):
    """Contact law and materials: a number holds for both partners, or each has its own.

    Journal and bearing of the crank pin are of the guide's material. The speed that the damping refers to is
    that of the touch, kept until separation ("frozen"), or follows the depth's rate d' without memory
    ("current"): sqrt(d'^2 + impact_speed_floor^2).
    """

    law: Literal["hertz-corners", "paper-switching", "foundation"]
    impact_speed: Literal["frozen", "current"] = "frozen"
    youngs_modulus: Annotated[
        Annotated[Positive, ONE] | Annotated[Partners[Positive], EACH], CHOICE, Unit("Pa")
    ]
    poisson: Annotated[Annotated[Poisson, ONE] | Annotated[Partners[Poisson], EACH], CHOICE]
    restitution: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
    exponent: Annotated[float, Field(ge=1, allow_inf_nan=False)]
    corner_radius: Annotated[Positive, M]
    impact_speed_floor: Annotated[Positive, M_S]


class Friction(Section):
    """Modified Coulomb friction, Eqs. 12-13: zero below the static speed, full above the transition speed."""

    coefficient: NotNegative
    static_speed: Annotated[NotNegative, M_S]
    transition_speed: Annotated[Positive, M_S]


class Environment(Section):
    """Gravity along -y."""

    gravity: Annotated[Real, M_S2]


class Output(Section):
    """Recorded channel groups and sampling density."""

    groups: list[Literal["accelerations", "corners", "joints", "energy"]] = ["accelerations", "corners"]
    samples_per_cycle: Annotated[int, Field(ge=2, le=MAX_SAMPLES_PER_CYCLE)] = 1000


class ReferenceSolver(Section):
    """Settings of the reference model; tolerance: absolute local error of the positions (m and rad)."""

    formulation: str = "auto"
    method: str = "dop853"
    tolerance: Positive = 1e-10
    baumgarte_alpha: NotNegative = 10.0
    baumgarte_beta: NotNegative = 10.0


class ExudynSolver(Section):
    """Settings of the Exudyn model; the meaning of step and tolerance depends on the formulation.

    For five bodies the step is that in a contact, and steps in flight are up to 32 times as long; without
    clearance, or with a sample at each step all are equal. Samples two to four steps apart are interpolated
    in longer ones. The tolerance is Newton's. For the tree, which has error control, they are the largest
    step and the local error tolerance. "auto" is the smallest formulation that yields the requested channels.
    """

    formulation: str = "auto"
    method: str = "auto"
    step: Annotated[Positive, S] = 2e-6
    tolerance: Positive = 1e-7


class Solver(Section):
    """Settings of the two models; those of other installed models are names with scalar values."""

    model_config = ConfigDict(extra="allow")

    reference: ReferenceSolver = ReferenceSolver()
    exudyn: ExudynSolver = ExudynSolver()


class Compare(Section):
    """Rules for two tables without uncertainties, for every channel.

    The tolerance is a share of the channel's scale; within the time tolerance either table may be early or
    late. A gate holds limits of `comparison.verdict.results.METRICS`.
    """

    tolerance: Positive | None = None
    time_tolerance: Annotated[NotNegative, S] = 0.0
    gate: dict[str, Real] = {}


class Limits(Section):
    """Limits of the permitted error, for `comparison.reliability`: Delta_nu and Delta_mu of Eq. 38."""

    lower: Real = 0.0
    upper: Positive


class DisplacementLimits(Limits):
    """Of the slider's displacement: ISO 2768-1 f for a length of 0.12 m to 0.4 m; the stroke is 0.224 m."""

    upper: Positive = 2e-4


class VelocityLimits(Limits):
    """Of the slider's velocity: one hundredth of the largest that the ideal slider has at 150 rpm."""

    upper: Positive = 0.02


class AccelerationLimits(Limits):
    """Of the slider's acceleration: the published reliabilities imply 110 to 210 m/s^2, case by case."""

    upper: Positive = 150.0


class Reliability(Section):
    """Criteria for the slider's errors, see `comparison.reliability`.

    bins: intervals of the crank cycle. errors: whether mean and deviation are those of e or of |e|.
    """

    bins: Annotated[int, Field(ge=1, le=10_000)] = 10
    errors: Literal["signed", "absolute"] = "absolute"
    displacement: Annotated[DisplacementLimits, M] = DisplacementLimits()
    velocity: Annotated[VelocityLimits, M_S] = VelocityLimits()
    acceleration: Annotated[AccelerationLimits, M_S2] = AccelerationLimits()


class RandomInput(Section):
    """Random variable about the scene's value of a key, for the study random-inputs.

    ``deviation`` is the standard deviation in the unit of the key; for a lognormal variable it must be small
    against the value, which is the median. ``element`` counts from 0 where the key holds a list.
    """

    key: Annotated[str, Field(min_length=1)]
    distribution: Literal["normal", "lognormal", "uniform"]
    deviation: Positive
    element: Annotated[int, Field(ge=0)] | None = None


class SceneKeys(Section):
    """Complete scene."""

    scene: Texts
    mechanism: Mechanism
    drive: Drive
    initial: Initial = Initial()
    joints: Joints = Joints()
    clearance: Clearance
    contact: Contact
    friction: Friction
    environment: Environment
    output: Output = Output()
    solver: Solver = Solver()
    compare: Compare = Compare()
    reliability: Reliability = Reliability()
    random: list[RandomInput] = []

    @model_validator(mode="before")
    @classmethod
    def _name_formulation(cls, given: Any) -> Any:
        """Name Exudyn's smallest formulation where the scene leaves it open, and its usual settings."""
        if not isinstance(given, dict):
            return given
        solver, joints, output = (given.get(section, {}) for section in ("solver", "joints", "output"))
        exudyn: Any = solver.get("exudyn", {}) if isinstance(solver, dict) else None
        if not all(isinstance(section, dict) for section in (exudyn, joints, output)):
            return given  # validation rejects it
        formulation = exudyn.get("formulation", "auto")
        if formulation == "auto":
            formulation = smallest_in_exudyn(given)
        usual = {"step": 1e-4, "tolerance": 1e-10} if formulation == "tree" else {}
        return given | {"solver": solver | {"exudyn": usual | exudyn | {"formulation": formulation}}}

    @model_validator(mode="after")
    def _together(self) -> Self:
        for key, value, text in self._broken():
            raise PydanticCustomError("rule", "{text}", {"key": key, "value": value, "text": text})
        return self

    def _broken(self) -> Iterator[tuple[str, object, str]]:
        """Yield key, value and rule where values exclude each other that are valid by themselves."""
        speed, cycles, friction = self.drive.speed_rpm, self.drive.cycles, self.friction
        if speed == 0:
            yield "drive.speed_rpm", speed, "must not be zero"
        elif not isfinite(60.0 / speed * cycles):
            yield "drive.cycles", cycles, f"last for ever at speed_rpm = {speed:g}"
        if friction.transition_speed <= friction.static_speed:
            bound = f"must be > friction.static_speed = {friction.static_speed:g} m/s"
            yield "friction.transition_speed", friction.transition_speed, bound
        if len(set(self.output.groups)) < len(self.output.groups):
            yield "output.groups", self.output.groups, "must not contain a group twice"
        for name, settings in (self.solver.model_extra or {}).items():
            if name not in engine_names():
                raise PydanticCustomError("not_installed", "", {"key": f"solver.{name}"})
            if not isinstance(settings, dict):
                yield f"solver.{name}", settings, "must be a section with keys of its own"
                continue
            for key, value in settings.items():
                if not is_setting(value):
                    allowed = "must be a string, a boolean or a finite number"
                    yield f"solver.{name}.{key}", value, allowed
        for name in ("displacement", "velocity", "acceleration"):
            limits = getattr(self.reliability, name)
            if limits.lower >= limits.upper:
                yield f"reliability.{name}.lower", limits.lower, f"must be < upper = {limits.upper:g}"
        for joint in ("slider", "crank_pin"):
            if getattr(self.joints, joint) == "clearance" and getattr(self.clearance, joint) == 0:
                yield f"clearance.{joint}", 0.0, f"must be > 0 where joints.{joint} = 'clearance'"
        samples = cycles * self.output.samples_per_cycle
        if not 0.5 < samples <= MAX_SAMPLES:  # rounded: 1
            bound = f"times output.samples_per_cycle must give 1 to {MAX_SAMPLES} samples, not {samples:g}"
            yield "drive.cycles", cycles, bound
