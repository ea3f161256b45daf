"""Numbers of a scene in SI units, derived here from the printed ones; formulation and settings of the solver.

Derived here and nowhere else: angular speed and period, the stiffnesses of Eqs. 8 and 10, the factor of the
damping of Eq. 11, and the solver's settings that the scene leaves open.
"""

import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, NamedTuple

from exudyn_model.laws import FOUNDATION, HERTZ, IMPACT, LAWS, SWITCHING, Law

_GROUPS = ("accelerations", "corners", "joints", "energy")


class Rod(NamedTuple):
    """A rigid rod; its frame sits in the centroid, x along the rod, away from the first pin."""

    # Distances of the second pin and of the centroid from the first pin, m
    length: float
    centroid: float
    # Mass, kg, and inertia about the centroid, kg m^2
    mass: float
    inertia: float

    @property
    def to_tip(self) -> float:
        """Distance from the centroid to the second pin, m."""
        return self.length - self.centroid


class Slider(NamedTuple):
    """The slider (kg, kg m^2), a rectangle: ``length`` along the guide, ``width`` across it, m."""

    mass: float
    inertia: float
    length: float
    width: float


class Mechanism(NamedTuple):
    """The linkage of Fig. 4 and its drive; kernels read it as a record (``kernels.record``)."""

    # Bodies 1 to 4. Rod 2 is pinned to the centroid of the rocker.
    crank: Rod
    rod2: Rod
    rocker: Rod
    rod4: Rod
    slider: Slider  # Body 5
    # Frame pivot H of the rocker, m; the crank's pivot is the origin
    pivot_x: float
    pivot_y: float
    # Centre line of the guide, and offset of an ideal slider's line from it, m
    guide_x: float
    reference_offset: float
    crank_angle: float  # At t = 0, rad
    # +1: joint B lies to the left of the line from the crank's tip to H; +1: rod 4 points up
    rocker_branch: float
    slider_branch: float
    gravity: float  # Along -y, m/s^2
    omega: float  # Angular speed of the crank, counter-clockwise positive, rad/s

    @property
    def period(self) -> float:
        """Duration of one cycle, s."""
        return 2 * math.pi / abs(self.omega)


@dataclass(frozen=True)
class Initial:
    """Slider with clearance at t = 0: x from the guide's centre line (m), angle (rad), and their rates."""

    offset: float
    angle: float
    vx: float
    omega: float


@dataclass(frozen=True)
class Load:
    """Workpiece that pushes the slider up, at its centre."""

    surface: float  # Height at which the centre meets it, m
    # Depths below the surface (m) and forces (N): those of a table, from (0, 0), or one pair of the power law
    rows: tuple[tuple[float, float], ...]
    exponent: float  # Of the power law; 0: a table


@dataclass(frozen=True)
class Integration:
    """Time integration and output."""

    formulation: str  # "full": five bodies; "tree": the coordinates that the drive leaves free
    method: str  # "generalized-alpha" or "trapezoidal-index2"; "dopri5" for "tree"
    step: float  # Step in a contact, "tree": largest step, s
    # Absolute, of the Newton iteration (see ``five_bodies.settings``); "tree": of a step's error, rad, rad/s
    tolerance: float
    samples_per_cycle: int
    # Requested groups of channels
    accelerations: bool
    corners: bool
    joints: bool
    energy: bool


@dataclass(frozen=True)
class Parameters:
    """All numbers of a scene.

    ``guide`` and ``journal`` are the laws of slider and crank pin; None: the joint is ideal. ``load`` is None
    without a workpiece.
    """

    mechanism: Mechanism
    initial: Initial
    guide: Law | None
    journal: Law | None
    load: Load | None
    integration: Integration
    cycles: float

    @property
    def contacts(self) -> list[Law]:
        """Laws of the joints that have clearance."""
        return [law for law in (self.guide, self.journal) if law is not None]

    @property
    def sample_interval(self) -> float:
        """Time between two samples, s."""
        return self.mechanism.period / self.integration.samples_per_cycle

    @property
    def samples(self) -> int:
        """Number of samples besides the one at t = 0."""
        return round(self.cycles * self.integration.samples_per_cycle)

    @property
    def duration(self) -> float:
        """Time of the last sample, s."""
        return self.samples * self.sample_interval


def read_scene(scene: Mapping[str, Any]) -> Parameters:
    """Read the complete mapping of a scene, defaults filled in.

    Raises
    ------
    ValueError
        If this model does not simulate the scene; one line.
    """
    _require_supported(scene)
    mechanism, joints, initial = scene["mechanism"], scene["joints"], scene["initial"]
    slider, groups = mechanism["slider"], scene["output"]["groups"]
    speed = float(scene["drive"]["speed_rpm"])
    pivot_x, pivot_y = mechanism["rocker_pivot"]
    has_guide, has_journal = joints["slider"] == "clearance", joints["crank_pin"] == "clearance"
    solver = _choose_solver(scene)
    return Parameters(
        Mechanism(
            **{name: _rod(mechanism[name]) for name in ("crank", "rod2", "rocker", "rod4")},
            slider=Slider(*(float(slider[key]) for key in ("mass", "inertia", "length", "width"))),
            pivot_x=float(pivot_x),
            pivot_y=float(pivot_y),
            guide_x=float(mechanism["guide_x"]),
            reference_offset=float(mechanism["reference_offset"]),
            crank_angle=math.radians(mechanism["crank_angle_deg"]),
            rocker_branch=float(mechanism["rocker_branch"]),
            slider_branch=float(mechanism["slider_branch"]),
            gravity=float(scene["environment"]["gravity"]),
            omega=speed * math.pi / 30,
        ),
        Initial(*(float(initial[f"slider_{key}"]) for key in ("offset", "angle", "vx", "omega"))),
        _guide(scene) if has_guide else None,
        _journal(scene) if has_journal else None,
        read_load(scene),
        Integration(
            formulation=solver["formulation"],
            method=solver["method"],
            step=float(solver["step"]),
            tolerance=float(solver["tolerance"]),
            samples_per_cycle=int(scene["output"]["samples_per_cycle"]),
            **{group: group in groups for group in _GROUPS},
        ),
        float(scene["drive"]["cycles"]),
    )


def _rod(values: Mapping[str, float]) -> Rod:
    return Rod(*(float(values[key]) for key in ("length", "centroid", "mass", "inertia")))


def compliance_of(scene: Mapping[str, Any], part: str) -> float:
    """Return sigma of "slider" or "guide", m^2/N: (1 - nu^2) / E, without the pi of some texts."""
    modulus, poisson = (
        values[part] if isinstance(values, Mapping) else values
        for values in (scene["contact"]["youngs_modulus"], scene["contact"]["poisson"])
    )
    return float((1 - poisson**2) / modulus)


DAMPING_FACTORS: Mapping[str, Callable[[float], float]] = {
    "lankarani-nikravesh": lambda e: 3 * (1 - e * e) / 4,
    "hunt-crossley": lambda e: 3 * (1 - e) / 2,
    "flores": lambda e: 8 * (1 - e) / (5 * e),
    "gonthier": lambda e: 1 / e - e,
}
"""`contact.damping_model` to C as a function of the restitution: docs/model.md, section 6."""


def contact_law(
    scene: Mapping[str, Any], law: str, radius: float, compliance: float, **geometry: float
) -> Law:
    """Return the law with K of Eq. 10, from a radius (m) and a sum of sigmas (m^2/N), and C of Eq. 11.

    ``scene`` has the tables ``contact`` and ``friction``; under "adams-impact" its stiffness and damping
    replace K and C.
    """
    contact, friction = scene["contact"], scene["friction"]
    constants = {
        "stiffness": 4 * math.sqrt(radius) / (3 * compliance),
        "damping": DAMPING_FACTORS[contact["damping_model"]](contact["restitution"]),
    }
    if contact["law"] == LAWS[IMPACT]:
        keys = ("stiffness", "damping", "damping_depth")
        constants |= {key: float(contact[key]) for key in keys if contact.get(key) is not None}
    return Law(
        number=float(LAWS.index(law)),
        exponent=float(contact["exponent"]),
        speed_floor=float(contact["impact_speed_floor"]),
        friction=float(friction["coefficient"]),
        static_speed=float(friction["static_speed"]),
        transition_speed=float(friction["transition_speed"]),
        shared=float(law == LAWS[FOUNDATION]),
        **constants,
        **geometry,
    )


def _guide(scene: Mapping[str, Any]) -> Law:
    slider, contact = scene["mechanism"]["slider"], scene["contact"]
    compliance = compliance_of(scene, "slider") + compliance_of(scene, "guide")
    return contact_law(
        scene,
        contact["law"],
        contact["corner_radius"],
        compliance,
        clearance=float(scene["clearance"]["slider"]),
        # Eq. 8 with a = T + L
        side_stiffness=(slider["thickness"] + slider["length"]) / (0.475 * compliance),
        half_width=slider["width"] / 2,
        half_length=slider["length"] / 2,
    )


def _journal(scene: Mapping[str, Any]) -> Law:
    clearance, radius = scene["clearance"]["crank_pin"], scene["clearance"]["journal_radius"]
    return journal_law(scene, float(clearance), float(radius))


def journal_law(scene: Mapping[str, Any], clearance: float, radius: float) -> Law:
    """Return the law of conforming cylinders of the guide's material, of the radius R_j R_b / (R_b - R_j)."""
    law = scene["contact"]["law"]
    side_laws = (LAWS[SWITCHING], LAWS[FOUNDATION])
    return contact_law(
        scene,
        LAWS[HERTZ] if law in side_laws else law,
        radius * (radius + clearance) / clearance,
        2 * compliance_of(scene, "guide"),
        clearance=clearance,
        bearing_radius=radius + clearance,
    )


def read_load(scene: Mapping[str, Any]) -> Load | None:
    """Return the workpiece of a scene; None without one."""
    load = scene["load"]
    rows = tuple((float(depth), float(force)) for depth, force in load["table"])
    if rows:
        return Load(float(load["surface"]), rows, 0.0)
    if load["force"] == 0:
        return None
    point = float(load["depth"]), float(load["force"])
    return Load(float(load["surface"]), (point,), float(load["exponent"]))


def _require_supported(scene: Mapping[str, Any]) -> None:
    """Raise a ValueError of one line for a choice that this model does not simulate.

    The rules of a scene, such as a positive ``drive.cycles``, are those of ``comparison.scene``.
    """
    choices: list[tuple[str, str, tuple[str, ...]]] = [
        *((f"joints.{name}", kind, ("clearance", "ideal")) for name, kind in scene["joints"].items()),
        ("contact.law", scene["contact"]["law"], LAWS),
        *(("output.groups", group, _GROUPS) for group in scene["output"]["groups"]),
    ]
    for key, value, options in choices:
        if value not in options:
            usable = " or ".join(map(repr, options))
            raise ValueError(f"{key} = {value!r} is not simulated by the Exudyn model yet; use {usable}")


# Formulation to its methods, and to its usual settings (see `Integration`)
_FORMULATIONS = tomllib.loads((files("exudyn_model") / "formulations.toml").read_text("utf-8"))
METHODS: dict[str, list[str]] = {name: each["methods"] for name, each in _FORMULATIONS.items()}
USUAL = {name: {"method": METHODS[name][0], **each["usual"]} for name, each in _FORMULATIONS.items()}


def _choose_solver(scene: Mapping[str, Any]) -> dict[str, Any]:
    """Return formulation, method, step and tolerance of ``[solver.exudyn]``, defaults filled in.

    "auto" and an absent key mean: the formulation "tree" where it has the requested channels and no implicit
    method is named, else "full"; the usual method of the formulation, or "trapezoidal-index2" for the groups
    "joints" and "energy". These need the constraints' multipliers. Those of "generalized-alpha", whose
    constraints are at position level, carry the Newton iteration's error divided by the square of the step,
    and are no results.

    Raises
    ------
    ValueError
        If keys contradict each other; one line.
    """
    requests = {key: value for key, value in scene["solver"]["exudyn"].items() if value != "auto"}
    formulation = requests.pop("formulation", "auto")
    if formulation not in ("auto", *USUAL):
        raise ValueError(
            f"solver.exudyn.formulation = {formulation!r} must be one of 'auto', 'full' and 'tree'"
        )
    reaction_groups = [group for group in scene["output"]["groups"] if group in ("joints", "energy")]
    has_clearance = "clearance" in (scene["joints"]["slider"], scene["joints"]["crank_pin"])
    if formulation == "auto":
        explicit = requests.get("method", METHODS["tree"][0]) in METHODS["tree"]
        formulation = "tree" if has_clearance and explicit and not reaction_groups else "full"
    defaults = dict(USUAL[formulation])
    if reaction_groups and formulation == "full":
        defaults["method"] = "trapezoidal-index2"
    solver = {"formulation": formulation} | defaults | requests
    if solver["method"] not in METHODS[formulation]:
        raise ValueError(
            f"solver.exudyn.method = {solver['method']!r} does not integrate solver.exudyn.formulation = "
            f"{formulation!r}; use {defaults['method']!r}"
        )
    if reaction_groups and solver["method"] != "trapezoidal-index2":
        raise ValueError(
            f"output.groups = {reaction_groups[0]!r} is not given by solver.exudyn.method = "
            f"{solver['method']!r}; use 'trapezoidal-index2' (formulation 'full')"
        )
    if formulation == "tree" and not has_clearance:
        raise ValueError(
            f"joints.slider = {scene['joints']['slider']!r} leaves solver.exudyn.formulation = 'tree' "
            "nothing free; use 'full'"
        )
    return solver
