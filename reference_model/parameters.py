"""Numbers of a scene in the paper's symbols, read from a plain mapping and checked once."""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np

from reference_model.linkage import Mechanism
from reference_model.workpiece import NO_LOAD, Load

CORNERS = ("ll", "lr", "ul", "ur")
"""Names of the corners: lower or upper in the slider's y, left or right in its x."""
LAWS = ("hertz-corners", "paper-switching", "foundation", "adams-impact")
"""Names of the contact laws (`reference_model.laws`), ..."""
HERTZ_CORNERS, PAPER_SWITCHING, FOUNDATION, ADAMS_IMPACT = range(len(LAWS))
"""... and the numbers by which `Contact.law` refers to them."""
GROUPS = ("accelerations", "corners", "joints", "energy")
FORMULATIONS = ("auto", *tomllib.loads((files("reference_model") / "formulations.toml").read_text("utf-8")))
SCIPY_METHODS = ("BDF", "Radau", "LSODA", "scipy-DOP853")
"""Integrators of `reference_model.scipy_solvers`: scipy's names, except the one with a compiled namesake."""
METHODS = ("dop853", *SCIPY_METHODS)

NARROWEST_RANGE = 1.0e-10
"""m/s, the accuracy to which slips are located: a frictionless range narrower than this is ignored."""
SMALLEST_TOLERANCE = 1e-14
"""Smallest solver.reference.tolerance, rad."""
_LARGEST_SHARE = 0.01
"""Largest tolerance as a share of the angle that crosses a clearance; above it forces reach 1e18 N."""


class Contact(NamedTuple):
    """Constants of one contact. The journal is the last in a list of contacts."""

    law: int
    """Number of the contact law, such as HERTZ_CORNERS."""
    one_side: bool
    """True if the two corners of a side are one contact."""
    lossless: bool
    """True if the contact has no damping."""
    other: int
    """Number among the four corners of the other one on the same side; -1: a journal in its bearing."""
    K: float
    """Stiffness as a point, Eq. 10 or of adams-impact, N/m^n."""
    Ks: float
    """Stiffness of a whole side, Eq. 8, N/m."""
    n: float
    """Exponent of the contact law."""
    C: float
    """3 (1 - c_e^2) / 4 of Eq. 11."""
    c_max: float
    """Largest damping coefficient of adams-impact, N s/m."""
    d_max: float
    """Depth from which on the damping coefficient is `c_max`, m."""
    speed_floor: float
    """Smallest impact speed in the damping term, m/s."""
    c_f: float
    """Friction coefficient."""
    v0: float
    """Speed below which friction is zero, Eq. 13, m/s."""
    v1: float
    """Speed above which friction is full, Eq. 13, m/s."""
    mass: float
    """Mass that is hit, at a corner by the slider's rotation alone, kg: only for the choice of steps."""
    arm: float
    """Lever arm of the angle whose error moves the contact, m: only for the choice of steps."""
    x: float = 0.0
    """Position of a corner from the slider's centre, in the slider's frame, m."""
    y: float = 0.0
    inward: float = 0.0
    """x component of the wall's normal into the guide: +1 at the left wall, -1 at the right."""
    wall: float = 0.0
    """x of the wall, m."""
    clearance: float = math.inf
    """Radial clearance of the journal, m; infinite for a corner, whose wall is flat."""
    radius: float = 0.0
    """Radius R_b of the journal's bearing, m."""


@dataclass(frozen=True)
class Parameters:
    """One scene as the reference model sees it."""

    mechanism: Mechanism
    corners: tuple[Contact, ...]
    """Contacts of the slider's four corners, if it has clearance; in the order of `CORNERS`."""
    journal: Contact
    """Contact at the crank pin, if that has clearance."""
    load: Load
    slider_start: tuple[float, float]
    """x (m) and its rate (m/s) of the slider's centre at t = 0."""
    guide_x: float
    """Centre line of the guide, m."""
    slider_offset: float
    """Start of the slider's centre relative to guide_x, m."""
    slider_angle: float
    """theta_5 at t = 0, rad."""
    slider_omega: float
    """Rate of theta_5 at t = 0, rad/s."""
    period: float
    """T = 60 / |speed in rpm|, s."""
    cycles: float
    ideal_slider: bool
    ideal_pin: bool
    """True if the crank pin A is an ideal revolute."""
    groups: frozenset[str]
    samples_per_cycle: int
    multipliers: bool
    """True if the scene asks for the paper's formulation with multipliers instead of the smallest one."""
    method: str
    """Integrator: "dop853", compiled, or one of `SCIPY_METHODS`."""
    tolerance: float
    """Absolute local error of the positions, m and rad."""
    alpha: float
    """Baumgarte's alpha and beta, 1/s (Eq. 21)."""
    beta: float

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """Contacts of the scene."""
        return (() if self.ideal_slider else self.corners) + (() if self.ideal_pin else (self.journal,))

    @property
    def contact_names(self) -> tuple[str, ...]:
        """Names of `contacts`."""
        return (() if self.ideal_slider else CORNERS) + (() if self.ideal_pin else ("pin",))


def read_parameters(scene: Mapping[str, Any]) -> Parameters:
    """Read a complete scene mapping.

    Parameters
    ----------
    scene
        Nested mapping in the scene format, every default filled in.

    Returns
    -------
    p
        Checked parameters.

    Raises
    ------
    ValueError
        One line that names the key, if this model does not simulate the scene. Numbers that the rules of
        `comparison.scene` forbid, such as a speed of zero, are not looked for.
    """
    mechanism, initial = scene["mechanism"], scene["initial"]
    joints, solver = scene["joints"], scene["solver"]["reference"]
    speed, guide = float(scene["drive"]["speed_rpm"]), float(mechanism["guide_x"])
    groups = frozenset(scene["output"]["groups"])
    formulation = solver.get("formulation", "auto")
    require_known(
        ("joints.slider", joints["slider"], ("clearance", "ideal")),
        ("joints.crank_pin", joints["crank_pin"], ("clearance", "ideal")),
        ("contact.law", scene["contact"]["law"], LAWS),
        ("solver.reference.formulation", formulation, FORMULATIONS),
        ("solver.reference.method", solver["method"], METHODS),
        *(("output.groups", group, GROUPS) for group in sorted(groups)),
    )
    if joints["crank_pin"] == "clearance" and formulation == "multiplier":
        raise ValueError(
            "solver.reference.formulation = 'multiplier' has ideal revolutes only; use 'minimal' with a "
            "clearance at the crank pin"
        )
    require_tolerance(solver["tolerance"])
    ideal_slider = joints["slider"] == "ideal"
    offset = float(mechanism["reference_offset"] if ideal_slider else initial["slider_offset"])
    p = Parameters(
        mechanism=_read_mechanism(mechanism, speed, float(scene["environment"]["gravity"])),
        corners=_read_corners(scene, guide),
        journal=_read_journal(scene),
        load=read_load(scene["load"]),
        slider_start=(guide + offset, 0.0 if ideal_slider else float(initial["slider_vx"])),
        guide_x=guide,
        slider_offset=float(initial["slider_offset"]),
        slider_angle=0.0 if ideal_slider else float(initial["slider_angle"]),
        slider_omega=0.0 if ideal_slider else float(initial["slider_omega"]),
        period=60.0 / abs(speed),
        cycles=float(scene["drive"]["cycles"]),
        ideal_slider=ideal_slider,
        ideal_pin=joints["crank_pin"] == "ideal",
        groups=groups,
        samples_per_cycle=int(scene["output"]["samples_per_cycle"]),
        multipliers=formulation == "multiplier",
        method=solver["method"],
        tolerance=float(solver["tolerance"]),
        alpha=float(solver["baumgarte_alpha"]),
        beta=float(solver["baumgarte_beta"]),
    )
    _require_small(p, float(scene["clearance"]["slider"]))
    return p


def require_known(*rows: tuple[str, Any, tuple[str, ...]]) -> None:
    """Raise if the value of a key is none of its names."""
    for key, value, names in rows:
        if value not in names:
            raise ValueError(f"{key} = {value!r} is not simulated by the reference model; use one of {names}")


def require_tolerance(tolerance: float) -> None:
    """Raise if a tolerance is below the rounding of angles."""
    if tolerance < SMALLEST_TOLERANCE:
        raise ValueError(
            f"solver.reference.tolerance = {tolerance!r} must be at least {SMALLEST_TOLERANCE!r}: "
            "the angles themselves are rounded at 1e-16 rad"
        )


def _read_mechanism(mechanism: Mapping[str, Any], speed: float, gravity: float) -> Mechanism:
    rods = [mechanism[name] for name in ("crank", "rod2", "rocker", "rod4")]
    bodies = [*rods, mechanism["slider"]]
    numbers = {f"m{i}": float(body["mass"]) for i, body in enumerate(bodies, start=1)}
    numbers |= {f"J{i}": float(body["inertia"]) for i, body in enumerate(bodies, start=1)}
    numbers |= {f"Ls{i}": float(rod["centroid"]) for i, rod in enumerate(rods, start=1)}
    numbers |= {f"L{i}": float(rod["length"]) for i, rod in enumerate(rods, start=1)}
    m4, m5, J4, Ls4, L4 = (numbers[name] for name in ("m4", "m5", "J4", "Ls4", "L4"))
    pivot_x, pivot_y = mechanism["rocker_pivot"]
    return Mechanism(
        **numbers,
        omega=speed * 2.0 * math.pi / 60.0,
        theta0=math.radians(mechanism["crank_angle_deg"]),
        Hx=float(pivot_x),
        Hy=float(pivot_y),
        rocker_branch=float(mechanism["rocker_branch"]),
        slider_branch=float(mechanism["slider_branch"]),
        line_x=float(mechanism["guide_x"]) + float(mechanism["reference_offset"]),
        gravity=gravity,
        S4=m4 * Ls4 + m5 * L4,
        I4=J4 + m4 * Ls4**2 + m5 * L4**2,
    )


def _read_corners(scene: Mapping[str, Any], guide: float) -> tuple[Contact, ...]:
    contact, slider = scene["contact"], scene["mechanism"]["slider"]
    half_width, half_length = 0.5 * float(slider["width"]), 0.5 * float(slider["length"])
    compliance = _compliance(contact, "slider") + _compliance(contact, "guide")
    corner = _contact(
        scene,
        LAWS.index(contact["law"]),
        stiffness=point_stiffness(compliance, float(contact["corner_radius"])),
        mass=float(slider["inertia"]) / half_length**2,
        arm=half_length,
    )
    Ks = (float(slider["thickness"]) + float(slider["length"])) / (0.475 * compliance)
    corner = corner._replace(Ks=Ks, one_side=corner.law == FOUNDATION)
    return _four_corners(corner, half_width, half_length, guide, float(scene["clearance"]["slider"]))


def _four_corners(
    corner: Contact, half_width: float, half_length: float, line: float, clearance: float
) -> tuple[Contact, ...]:
    half_guide = half_width + clearance
    return tuple(
        corner._replace(
            other=(k + 2) % 4, x=-inward * half_width, y=-half_length if k < 2 else half_length,
            inward=inward, wall=line - inward * half_guide,
        )
        for k, inward in enumerate((1.0, -1.0, 1.0, -1.0))
    )  # fmt: skip


def _read_journal(scene: Mapping[str, Any]) -> Contact:
    clearance, rod2 = scene["clearance"], scene["mechanism"]["rod2"]
    sizes = float(clearance["journal_radius"]), float(clearance["crank_pin"])
    return _journal(scene, *sizes, mass=float(rod2["mass"]), arm=float(rod2["length"]))


def _journal(scene: Mapping[str, Any], journal: float, pin: float, mass: float, arm: float) -> Contact:
    contact, bearing = scene["contact"], journal + pin
    # Journal and bearing are both of the guide's material, and conformal: R = R_j R_b / (R_b - R_j).
    radius = journal * bearing / pin if pin > 0.0 else math.inf
    return _contact(
        scene,
        ADAMS_IMPACT if contact["law"] == LAWS[ADAMS_IMPACT] else HERTZ_CORNERS,
        stiffness=point_stiffness(2.0 * _compliance(contact, "guide"), radius),
        mass=mass,
        arm=arm,
    )._replace(clearance=pin, radius=bearing)


def read_clearance(name: str, clearance: Mapping[str, Any], body: Mapping[str, Any]) -> dict[str, Contact]:
    """Return the contacts of a linkage's clearance by name: of a guide its body's corners, or a journal."""
    contact, size, key = clearance["contact"], float(clearance["size"]), f"clearance.{name}.contact.law"
    require_known((key, contact["law"], (LAWS[HERTZ_CORNERS], LAWS[ADAMS_IMPACT])))
    if "length" not in clearance:
        radius, mass = float(clearance["journal_radius"]), float(body["mass"])
        return {name: _journal(clearance, radius, size, mass, arm=1.0)}
    half_width, half_length = 0.5 * float(clearance["width"]), 0.5 * float(clearance["length"])
    stiffness = point_stiffness(2.0 * _compliance(contact, "guide"), float(clearance["corner_radius"]))
    mass, law = float(body["inertia"]) / half_length**2, LAWS.index(contact["law"])
    corner = _contact(clearance, law, stiffness, mass, arm=half_length)
    corners = _four_corners(corner, half_width, half_length, 0.0, size)
    return {f"{name}.{corner}": contact for corner, contact in zip(CORNERS, corners, strict=True)}


def _contact(scene: Mapping[str, Any], law: int, stiffness: float, mass: float, arm: float) -> Contact:
    """Return a contact without its geometry; adams-impact has the stiffness that the scene gives, if any."""
    contact, friction = scene["contact"], scene["friction"]
    C, c_max = _damping(contact["damping_model"], float(contact["restitution"])), float(contact["damping"])
    static = float(friction["static_speed"])
    return Contact(
        law=law,
        one_side=False,
        lossless=(c_max if law == ADAMS_IMPACT else C) == 0.0,
        other=-1,
        K=(law == ADAMS_IMPACT and float(contact.get("stiffness") or 0.0)) or stiffness,
        Ks=0.0,
        n=float(contact["exponent"]),
        C=C,
        c_max=c_max,
        d_max=float(contact["damping_depth"]),
        speed_floor=float(contact["impact_speed_floor"]),
        c_f=float(friction["coefficient"]),
        v0=static if static > NARROWEST_RANGE else 0.0,
        v1=float(friction["transition_speed"]),
        mass=mass,
        arm=arm,
    )


def _damping(model: str, e: float) -> float:
    """Return C of docs/model.md, section 6, for a coefficient of restitution e."""
    match model:
        case "lankarani-nikravesh":
            return 0.75 * (1.0 - e**2)
        case "hunt-crossley":
            return 1.5 * (1.0 - e)
        case "flores":
            return 8.0 * (1.0 - e) / (5.0 * e)
        case "gonthier":
            return (1.0 - e**2) / e
    raise ValueError(f"contact.damping_model = {model!r} is not known")


def read_load(load: Mapping[str, Any]) -> Load:
    """Return the load of a scene's table."""
    surface, force, rows = float(load["surface"]), float(load["force"]), load["table"]
    if rows:
        depths, forces = np.ascontiguousarray(np.array(rows, dtype=np.float64).T)
        return NO_LOAD._replace(surface=surface, depths=depths, forces=forces)
    if force == 0.0:
        return NO_LOAD
    return Load(surface, force, float(load["depth"]), float(load["exponent"]), np.empty(0), np.empty(0))


def _compliance(contact: Mapping[str, Any], part: str) -> float:
    """Return sigma = (1 - nu^2) / E of the slider or the guide (Eq. 10), 1/Pa."""
    modulus, poisson = (
        float(value[part] if isinstance(value := contact[key], Mapping) else value)
        for key in ("youngs_modulus", "poisson")
    )
    return (1.0 - poisson**2) / modulus


def point_stiffness(compliance: float, radius: float) -> float:
    """Return K = 4 sqrt(R) / (3 (sigma_m + sigma_n)) of a contact of the given radius (Eq. 10), N/m^1.5."""
    return 4.0 / (3.0 * compliance) * math.sqrt(radius)


def _require_small(p: Parameters, slider_clearance: float) -> None:
    """Raise if an error as large as the tolerance is not small compared with a clearance."""
    for ideal, key, clearance, length in (
        (p.ideal_slider, "clearance.slider", slider_clearance, p.mechanism.L4),
        (p.ideal_pin, "clearance.crank_pin", p.journal.clearance, p.mechanism.L2),
    ):
        largest = _LARGEST_SHARE * clearance / length
        if not ideal and clearance > 0.0 and p.tolerance > largest:
            raise ValueError(
                f"solver.reference.tolerance = {p.tolerance:g} must be at most {largest:.1e} rad, "
                f"{_LARGEST_SHARE:.0%} of the angle by which a rod of {length:g} m crosses {key}"
            )
