"""Keys of a scene: type, unit, rule for the value, default where there is one, source of the paper's value.

The string below a key, for `sixbar keys` and `sixbar new`, describes it with synonyms, so that words find it.
The mechanism's numbers and reasons are in ``shipped/paper.toml``, which a scene extends.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import inf, isfinite
from typing import Annotated, Any, Generic, Literal, Self, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from comparison.models import engine_names, is_setting

MAX_SAMPLES = 100_000_000  # a larger table would not fit into the memory of an ordinary machine
LEAST_RESTITUTION = 0.01  # for damping factors that divide by it: they are 158 and 100 there
MAX_SAMPLES_PER_CYCLE = 10**15  # floats count exactly up to here; a run may be a small share of a cycle
SMALLEST, LARGEST = 1e-30, 1e30
"""Bounds of the size of a number other than 0: a product of several must not exceed 1e308."""
NAME = r"^[A-Za-z0-9][A-Za-z0-9._+=-]*$"
"""Pattern of the name of a scene, and of its files."""
EXUDYN_STEP = 2e-6
"""Default step of Exudyn in contacts, s."""
MATERIALS = ("contact.youngs_modulus", "contact.poisson")
PARTNERS = ("slider", "guide")
"""The keys `MATERIALS` hold one number for both `PARTNERS` of a contact, or one for each."""
Number = TypeVar("Number")


@dataclass(frozen=True)
class Unit:
    """Unit of a key and of those below it, for messages."""

    symbol: str


@dataclass(frozen=True)
class Source:
    """Origin of the paper's value of a key; a key without one has a chosen value."""

    text: str


def _integer(value: object) -> object:
    """Reject a sign that equals an integer without being one: true, 1.0."""
    if type(value) is not int:
        raise PydanticCustomError("literal_error", "", {"expected": "-1 or 1"})
    return value


def _time_or_any(value: object) -> object:
    if value == "any" or (isinstance(value, int | float) and type(value) is not bool and 0 < value < inf):
        return value
    raise PydanticCustomError("rule", "", {"text": "must be > 0, or 'any'"})


Real = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Poisson = Annotated[float, Field(gt=-1, le=0.5, allow_inf_nan=False)]
Sign = Annotated[Literal[-1, 1], BeforeValidator(_integer)]
M, KG, KGM2, S = Unit("m"), Unit("kg"), Unit("kg m^2"), Unit("s")
M_S, M_S2, RAD, RAD_S = Unit("m/s"), Unit("m/s^2"), Unit("rad"), Unit("rad/s")
TABLE_1, TABLE_2, SEC_4 = Source("Table 1"), Source("Table 2"), Source("Sec. 4")
IDENTIFIED = Source("identified")  # from figures that the paper prints


class Section(BaseModel):
    """Section of the scene file; unknown keys are rejected."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, use_attribute_docstrings=True)

    @model_validator(mode="after")
    def _check_rules(self) -> Self:
        for key, value, text in self._violations():
            raise PydanticCustomError("rule", "{text}", {"key": key, "value": value, "text": text})
        return self

    def _violations(self) -> Iterator[tuple[str, object, str]]:
        """Yield key, value and rule of values that are valid by themselves and not together."""
        return iter(())


class Texts(Section):
    """Name and title of the scene."""

    name: Annotated[str, Field(min_length=1, max_length=100, pattern=NAME)]
    """Name of the scene, and of files about it; the name of its file where none is given."""
    title: str
    """Title in reports, one line; the name where none is given."""
    description: str = ""
    """Purpose of the scene, in a sentence or two."""


class Rod(Section):
    """Slender body between two pins; the centroid is measured from the first pin."""

    length: Annotated[Positive, M, TABLE_1]
    """Length between the two pins."""
    centroid: Annotated[Real, M, TABLE_1]
    """Distance of the centroid (centre of mass) from the first pin."""
    mass: Annotated[Positive, KG, TABLE_1]
    """Mass."""
    inertia: Annotated[Positive, KGM2, TABLE_1]
    """Moment of inertia J about the centroid."""


class Slider(Section):
    """The slider: length along the guide (y), width across it (x)."""

    mass: Annotated[Positive, KG, TABLE_1]
    """Mass."""
    inertia: Annotated[Positive, KGM2, TABLE_1]
    """Moment of inertia J about the centroid."""
    length: Annotated[Positive, M, TABLE_2]
    """Length (height) along the guide, y."""
    width: Annotated[Positive, M, TABLE_2]
    """Width across the guide, x."""
    thickness: Annotated[Positive, M, TABLE_2]
    """Thickness (depth) normal to the plane; only surface contact depends on it."""


class Mechanism(Section):
    """Bodies and their assembly positions."""

    crank: Rod
    rod2: Rod
    rocker: Rod
    rod4: Rod
    slider: Slider
    rocker_pivot: Annotated[list[Real], Field(min_length=2, max_length=2), M, IDENTIFIED]
    """Position [x, y] of the rocker's fixed pivot H; the crank's is the origin."""
    guide_x: Annotated[Real, M, IDENTIFIED]
    """Position of the guide's centre line."""
    reference_offset: Annotated[Real, M, IDENTIFIED]
    """Distance of the ideal slider's line from the guide's centre line, positive to the right."""
    crank_angle_deg: Annotated[Real, Unit("deg"), Source("Sec. 2.2")]
    """Angle of the crank at the start (initial phase)."""
    rocker_branch: Annotated[Sign, IDENTIFIED]
    """Assembly of the rocker: joint with rod 2 left (1) or right (-1) of the line from crank pin to H."""
    slider_branch: Annotated[Sign, IDENTIFIED]
    """Assembly of rod 4: hanging down from the rocker (-1) or standing up (1)."""


class Drive(Section):
    """Constant speed of the crank, counter-clockwise positive, and number of cycles."""

    speed_rpm: Annotated[Real, Unit("rpm"), SEC_4]
    """Speed of the crank (motor, angular velocity omega), counter-clockwise positive; not zero."""
    cycles: Positive
    """Duration (end time) of the simulation in turns (revolutions) of the crank."""


class Initial(Section):
    """Initial state of the slider."""

    slider_offset: Annotated[Real | None, M] = None
    """Start position x of the slider from the guide's centre line; without it mechanism.reference_offset."""
    slider_angle: Annotated[Real, RAD] = 0.0
    """Start angle (tilt) of the slider."""
    slider_vx: Annotated[Real, M_S] = 0.0
    """Start velocity of the slider across the guide."""
    slider_omega: Annotated[Real, RAD_S] = 0.0
    """Start angular velocity (spin) of the slider."""


class Joints(Section):
    """Type of the joints that may have clearance."""

    slider: Literal["clearance", "ideal"] = "clearance"
    """Joint of slider and guide (prismatic, translational)."""
    crank_pin: Literal["ideal", "clearance"] = "ideal"
    """Joint A of crank and rod 2 (revolute)."""


class Clearance(Section):
    """Clearances: per side for the slider, radial for the crank pin."""

    slider: Annotated[NotNegative, M, SEC_4]
    """Gap (play) between slider and guide, on each side."""
    crank_pin: Annotated[NotNegative, M, Source("Sec. 4.2")]
    """Radial gap (play) between journal and bearing of the crank pin."""
    journal_radius: Annotated[Positive, M]
    """Radius of the crank pin's journal."""


class Partners(Section, Generic[Number]):
    """One number for each partner of a contact."""

    slider: Number
    guide: Number


DampingModel = Literal["lankarani-nikravesh", "hunt-crossley", "flores", "gonthier"]
ONE, EACH = Tag("number"), Tag("partners")
CHOICE = Discriminator(lambda value: "partners" if isinstance(value, dict | Section) else "number")


class Contact(Section):
    """Contact law and materials; journal and bearing of the crank pin are of the guide's material."""

    law: Literal["hertz-corners", "paper-switching", "foundation", "adams-impact"]
    """Contact model, force law: each corner by Hertz, the paper's surface switch, a foundation, or IMPACT."""
    youngs_modulus: Annotated[
        Annotated[Positive, ONE] | Annotated[Partners[Positive], EACH], CHOICE, Unit("Pa"), TABLE_2
    ]
    """Young's modulus E (elastic stiffness) of the material; .slider and .guide are those of each partner."""
    poisson: Annotated[Annotated[Poisson, ONE] | Annotated[Partners[Poisson], EACH], CHOICE, TABLE_2]
    """Poisson's ratio nu of the material; .slider and .guide are those of each partner."""
    restitution: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False), TABLE_2]
    """Coefficient of restitution e of an impact, which sets the damping of Eqs. 9-11: 1 has none."""
    damping_model: DampingModel = "lankarani-nikravesh"
    """Damping factor of Hertz's law and of the foundation; the paper's Eq. 11 is the first."""
    exponent: Annotated[float, Field(ge=1, allow_inf_nan=False), TABLE_2]
    """Exponent n (power) of the depth in the contact force."""
    corner_radius: Annotated[Positive, M]
    """Radius (rounding) of the slider's corners in Hertz's law."""
    impact_speed_floor: Annotated[Positive, M_S]
    """Smallest impact speed that the damping refers to."""
    stiffness: Annotated[Positive | None, Unit("N/m^n")] = None
    """Stiffness k of the law adams-impact; without it K of Hertz's law, from the materials."""
    damping: Annotated[NotNegative, Unit("N s/m")] = 260.0
    """Largest damping coefficient c_max of the law adams-impact."""
    damping_depth: Annotated[Positive, M] = 1e-5
    """Depth d_max at which the damping of the law adams-impact is the largest."""


class Friction(Section):
    """Modified Coulomb friction, Eqs. 12-13: zero below the static speed, full above the transition speed."""

    coefficient: Annotated[NotNegative, TABLE_2]
    """Coefficient mu of Coulomb friction (dry, dynamic, kinetic)."""
    static_speed: Annotated[NotNegative, M_S, TABLE_2]
    """Sliding speed v0 below which there is no friction."""
    transition_speed: Annotated[Positive, M_S, TABLE_2]
    """Sliding speed v1 above which friction is full; it exceeds static_speed."""


class Load(Section):
    """Elastic workpiece that pushes the slider up near bottom dead centre; none by default."""

    surface: Annotated[Real, M] = -0.0318
    """Height y at which the centre of the loaded body meets the workpiece, in the fixed frame."""
    force: Annotated[NotNegative, Unit("N")] = 0.0
    """Force of the workpiece (working load) at load.depth; 0 is no workpiece."""
    depth: Annotated[Positive, M] = 3e-3
    """Depth below the surface at which the power law has load.force."""
    exponent: Annotated[float, Field(ge=1, allow_inf_nan=False)] = 1.5
    """Exponent q (power) of the depth in the force of the workpiece."""
    table: list[Annotated[list[Real], Field(min_length=2, max_length=2)]] = []
    """Rows [depth in m, force in N] in place of the power law, from [0, 0]; constant beyond the last."""


class Environment(Section):
    """Gravity along -y."""

    gravity: Annotated[Real, M_S2]
    """Gravitational acceleration g along -y (weight)."""


class Output(Section):
    """Recorded channel groups and sampling density."""

    groups: list[Literal["accelerations", "corners", "joints", "energy"]] = ["accelerations", "corners"]
    """Groups of channels (columns) in a table besides the slider's motion; sixbar channels lists them."""
    samples_per_cycle: Annotated[int, Field(ge=2, le=MAX_SAMPLES_PER_CYCLE)] = 1000
    """Recorded samples in a turn of the crank (sampling rate, resolution)."""


class ReferenceSolver(Section):
    """Settings of the reference model; tolerance: absolute local error of the positions (m and rad)."""

    formulation: str = "auto"
    """Equations of the reference: minimal, multiplier; auto is minimal, of a linkage multiplier."""
    method: str = "dop853"
    """Integrator of the reference: dop853, of the press also those of SciPy's solve_ivp."""
    tolerance: Positive = 1e-10
    """Absolute local error of the reference's positions in metres and radians (accuracy)."""
    baumgarte_alpha: NotNegative = 10.0
    """Baumgarte stabilization of velocities, alpha; only with the press's multipliers."""
    baumgarte_beta: NotNegative = 10.0
    """Baumgarte stabilization of positions, beta; only with the press's multipliers."""


class ExudynSolver(Section):
    """Settings of the Exudyn model.

    The five bodies take steps up to 32 times as long in flight as in a contact; without clearance, or with a
    sample at each step, all steps are equal. Samples two to four steps apart are interpolated.
    """

    formulation: str = "auto"
    """Equations of Exudyn: full (all bodies), of the press also tree; auto is the smallest that suffices."""
    method: str = "auto"
    """Integrator of Exudyn; auto is the formulation's usual one."""
    step: Annotated[Positive, S] = EXUDYN_STEP
    """Time step dt of Exudyn, in contacts if there are some; with tree the largest step, 1e-4 by default."""
    tolerance: Positive = 1e-7
    """Tolerance of Newton's method with full; local error, 1e-10 by default, with tree (accuracy)."""


class Solver(Section):
    """Settings of the two models; those of other installed models are names with scalar values."""

    model_config = ConfigDict(extra="allow")

    reference: ReferenceSolver = ReferenceSolver()
    exudyn: ExudynSolver = ExudynSolver()


class Compare(Section):
    """Rules of a comparison; all but ``until`` are for tables without uncertainties, for every channel."""

    until: Annotated[Positive | Literal["any"], BeforeValidator(_time_or_any), S] | None = None
    """Time until which two results with uncertainties have to be predictable and agree."""

    tolerance: Positive | None = None
    """Permitted difference of two tables without uncertainties, as a share of each channel's scale."""
    time_tolerance: Annotated[NotNegative, S] = 0.0
    """Time by which either of two tables may be early or late."""
    gate: dict[str, Real] = {}
    """Limits of metrics for such tables, by the name of the metric."""


class Limits(Section):
    """Limits of the permitted error, for `comparison.reliability`: Delta_nu and Delta_mu of Eq. 36."""

    lower: Annotated[Real, IDENTIFIED] = 0.0
    """Lower limit of the permitted error."""
    upper: Positive
    """Upper limit of the permitted error."""


class DisplacementLimits(Limits):
    """Limits for the displacement: ISO 2768-1 f for a length of 0.12 m to 0.4 m; the stroke is 0.224 m."""

    upper: Positive = 2e-4
    """Upper limit of the permitted error."""


class VelocityLimits(Limits):
    """Limits for the velocity: one hundredth of the largest that the ideal slider has at 150 rpm."""

    upper: Positive = 0.02
    """Upper limit of the permitted error."""


class AccelerationLimits(Limits):
    """Limits for the acceleration: the published reliabilities imply 110 to 210 m/s^2, case by case."""

    upper: Positive = 150.0
    """Upper limit of the permitted error."""


class Reliability(Section):
    """Criteria for the errors of a motion, the slider's of the press, see `comparison.reliability`."""

    bins: Annotated[int, Field(ge=1, le=10_000)] = 10
    """Intervals of a cycle, each with a reliability of its own."""
    errors: Literal["signed", "absolute"] = "absolute"
    """Mean and deviation are those of the error (signed) or of its magnitude (absolute)."""
    displacement: Annotated[DisplacementLimits, M] = DisplacementLimits()
    velocity: Annotated[VelocityLimits, M_S] = VelocityLimits()
    acceleration: Annotated[AccelerationLimits, M_S2] = AccelerationLimits()

    @property
    def channels(self) -> dict[str, str]:
        """Channel of each quantity that has limits."""
        return {"displacement": "slider_y", "velocity": "slider_vy", "acceleration": "slider_ay"}


class SceneKeys(Section):
    """Complete scene of the press."""

    scene: Texts
    mechanism: Mechanism
    drive: Drive
    initial: Initial = Initial()
    joints: Joints = Joints()
    clearance: Clearance
    contact: Contact
    friction: Friction
    load: Load = Load()
    environment: Environment
    output: Output = Output()
    solver: Solver = Solver()
    compare: Compare = Compare()
    reliability: Reliability = Reliability()

    def _violations(self) -> Iterator[tuple[str, object, str]]:
        speed, cycles = self.drive.speed_rpm, self.drive.cycles
        if speed == 0:
            yield "drive.speed_rpm", speed, "must not be zero"
        elif not isfinite(60.0 / speed * cycles):
            yield "drive.cycles", cycles, f"last for ever at speed_rpm = {speed:g}"
        yield from contact_violations(self.contact, self.friction)
        for joint in ("slider", "crank_pin"):
            if getattr(self.joints, joint) == "clearance" and getattr(self.clearance, joint) == 0:
                yield f"clearance.{joint}", 0.0, f"must be > 0 where joints.{joint} = 'clearance'"
        samples = cycles * self.output.samples_per_cycle
        if not 0.5 < samples <= MAX_SAMPLES:  # rounded: 1
            bound = f"times output.samples_per_cycle must give 1 to {MAX_SAMPLES} samples, not {samples:g}"
            yield "drive.cycles", cycles, bound
        yield from common_violations(self)


def contact_violations(contact: Any, friction: Friction, at: str = "") -> Iterator[tuple[str, object, str]]:
    """Yield key, value and rule of violations in the tables contact and friction ``at`` a place."""
    if friction.transition_speed <= friction.static_speed:
        bound = f"must be > {at}friction.static_speed = {friction.static_speed:g} m/s"
        yield f"{at}friction.transition_speed", friction.transition_speed, bound
    model, restitution = contact.damping_model, contact.restitution
    if model == "lankarani-nikravesh":
        return
    if contact.law not in ("hertz-corners", "foundation"):
        laws = "'hertz-corners'" + " or 'foundation'" * isinstance(contact, Contact)
        yield f"{at}contact.damping_model", model, f"needs {at}contact.law = {laws}, not {contact.law!r}"
    if model != "hunt-crossley" and restitution < LEAST_RESTITUTION:
        rule = f"must be >= {LEAST_RESTITUTION:g}, by which {at}contact.damping_model = {model!r} divides"
        yield f"{at}contact.restitution", restitution, rule


def common_violations(keys: Any) -> Iterator[tuple[str, object, str]]:
    """Yield key, value and rule of violations in any scene: limits, load, groups, solvers, numbers."""
    for name in keys.reliability.channels:
        limits = getattr(keys.reliability, name)
        if limits.lower >= limits.upper:
            yield f"reliability.{name}.lower", limits.lower, f"must be < upper = {limits.upper:g}"
    load = keys.load or Load()
    rows = load.table
    if rows and load.force:
        yield "load.table", rows, f"replaces load.force = {load.force:g} N: set load.force = 0"
    if rows and (rows[0] != [0.0, 0.0] or any(force < 0.0 for _, force in rows)):
        yield "load.table", rows, "must begin with [0, 0] and contain no negative force"
    if any(after[0] <= before[0] for before, after in pairwise(rows)):
        yield "load.table", rows, "must have rising depths; a jump is two rows at nearly one depth"
    if len(set(keys.output.groups)) < len(keys.output.groups):
        yield "output.groups", keys.output.groups, "must not contain a group twice"
    for name, settings in (keys.solver.model_extra or {}).items():
        if name not in engine_names():
            raise PydanticCustomError("not_installed", "", {"key": f"solver.{name}"})
        if not isinstance(settings, dict):
            yield f"solver.{name}", settings, "must be a section with keys of its own"
            continue
        for key, value in settings.items():
            if not is_setting(value):
                rule = "must be a string, a boolean or a finite number"
                yield f"solver.{name}.{key}", value, rule
    for key, value in _numbers(keys.model_dump(exclude={"solver", "compare", "reliability"})):
        if value and not SMALLEST <= abs(value) <= LARGEST:
            yield key, value, f"must be 0 or between {SMALLEST:g} and {LARGEST:g}, of either sign"


def _numbers(values: object, key: str = "") -> Iterator[tuple[str, float]]:
    """Yield the real numbers of a section, with their dotted keys."""
    if isinstance(values, float):
        yield key, values
    elif isinstance(values, dict):
        for name, each in values.items():
            yield from _numbers(each, f"{key}.{name}".lstrip("."))
    elif isinstance(values, list):
        for each in values:
            yield from _numbers(each, key)
