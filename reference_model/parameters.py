"""The scene's numbers in the paper's symbols, checked and ready for the kernels.

`Parameters` is read from a plain mapping (see the scene format); `Constants` is the flat tuple of
floats that the compiled kernels take.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

SMALLEST_TOLERANCE = 1e-14
"""Of solver.reference.tolerance, rad."""


@dataclass(frozen=True)
class Rod:
    """A rigid rod (Table 1)."""

    length: float
    """L, m."""
    centroid: float
    """L_s, distance of the centroid from the first pin, m."""
    mass: float
    """m, kg."""
    inertia: float
    """J about the centroid, kg m^2."""


@dataclass(frozen=True)
class Slider:
    """The slider 5 (Tables 1 and 2)."""

    mass: float
    """m5, kg."""
    inertia: float
    """J5 about the centroid, kg m^2."""
    length: float
    """L, along the guide (y), m."""
    width: float
    """W_T, across the guide (x), m."""
    thickness: float
    """T, out of the plane, m."""


class Constants(NamedTuple):
    """What the kernels read: floats only, so that one compiled version serves every scene."""

    omega: float
    """Crank speed, rad/s, counter-clockwise positive."""
    theta0: float
    """Crank angle at t = 0, rad."""
    L1: float
    """Crank length, m."""
    L2: float
    """Length of rod 2, m."""
    Ls3: float
    """Rocker pivot H to its centroid, where rod 2 is pinned (B), m."""
    L3: float
    """Rocker length, m."""
    Hx: float
    """Rocker pivot, x, m."""
    Hy: float
    """Rocker pivot, y, m."""
    rocker_branch: float
    """+1: B lies left of the line from A to H; -1: right."""
    L4: float
    """Length of rod 4, m."""
    slider_branch: float
    """-1: the slider hangs below the rocker's tip; +1: it stands above."""
    first_moment: float
    """m4 Ls4 + m5 L4 of rod 4 with the slider's mass at its end, about the tip C, kg m."""
    moving_mass: float
    """m4 + m5, kg."""
    I4: float
    """J4 + m4 Ls4^2 + m5 L4^2, the inertia that goes with it, kg m^2."""
    J5: float
    """Slider inertia, kg m^2."""
    gravity: float
    """Along -y, m/s^2."""
    line_x: float
    """The ideal slider's line: guide_x + reference_offset, m."""
    wall_left: float
    """x of the guide's left wall, m."""
    wall_right: float
    """x of the guide's right wall, m."""
    half_width: float
    """W_T / 2, m."""
    half_length: float
    """L / 2, m."""
    K: float
    """Contact stiffness of a corner, Eq. 10, N/m^n."""
    n: float
    """Exponent of the contact law."""
    C: float
    """3 (1 - c_e^2) / 4 of Eq. 11."""
    speed_floor: float
    """Smallest impact speed in the damping term, m/s."""
    c_f: float
    """Friction coefficient."""
    v0: float
    """Speed below which friction is zero, Eq. 14, m/s."""
    v1: float
    """Speed above which friction is full, Eq. 14, m/s."""


@dataclass(frozen=True)
class Parameters:
    """One scene as the reference model sees it."""

    crank: Rod
    rod2: Rod
    rocker: Rod
    rod4: Rod
    slider: Slider
    rocker_pivot: tuple[float, float]
    """H, m."""
    guide_x: float
    """Centre line of the guide, m."""
    reference_offset: float
    """The ideal slider's line relative to the guide's, m."""
    crank_angle: float
    """theta_1 at t = 0, rad."""
    rocker_branch: int
    slider_branch: int
    omega: float
    """Crank speed, rad/s."""
    period: float
    """T = 60 / |speed in rpm|, s."""
    cycles: float
    slider_offset: float
    """Start of the slider's centre relative to guide_x, m."""
    slider_angle: float
    """theta_5 at t = 0, rad."""
    slider_vx: float
    """m/s at t = 0."""
    slider_omega: float
    """rad/s at t = 0."""
    ideal_slider: bool
    clearance: float
    """c_T, per side, m."""
    youngs_modulus: float
    """E of slider and guide, Pa."""
    poisson: float
    restitution: float
    exponent: float
    corner_radius: float
    """R, m."""
    impact_speed_floor: float
    """m/s."""
    friction_coefficient: float
    static_speed: float
    """v0, m/s."""
    transition_speed: float
    """v1, m/s."""
    gravity: float
    """m/s^2 along -y."""
    groups: frozenset[str]
    samples_per_cycle: int
    tolerance: float
    """Absolute local error of the positions, m and rad."""

    @property
    def stiffness(self) -> float:
        """K = 4 sqrt(R) / (3 (sigma_m + sigma_n)), sigma = (1 - nu^2) / E (Eq. 10), N/m^1.5."""
        sigma = (1.0 - self.poisson**2) / self.youngs_modulus
        return 4.0 / (3.0 * (sigma + sigma)) * math.sqrt(self.corner_radius)

    @property
    def constants(self) -> Constants:
        """The numbers the kernels need."""
        rod4, slider = self.rod4, self.slider
        half_gap = 0.5 * slider.width + self.clearance
        return Constants(
            omega=self.omega,
            theta0=self.crank_angle,
            L1=self.crank.length,
            L2=self.rod2.length,
            Ls3=self.rocker.centroid,
            L3=self.rocker.length,
            Hx=self.rocker_pivot[0],
            Hy=self.rocker_pivot[1],
            rocker_branch=float(self.rocker_branch),
            L4=rod4.length,
            slider_branch=float(self.slider_branch),
            first_moment=rod4.mass * rod4.centroid + slider.mass * rod4.length,
            moving_mass=rod4.mass + slider.mass,
            I4=rod4.inertia + rod4.mass * rod4.centroid**2 + slider.mass * rod4.length**2,
            J5=slider.inertia,
            gravity=self.gravity,
            line_x=self.guide_x + self.reference_offset,
            wall_left=self.guide_x - half_gap,
            wall_right=self.guide_x + half_gap,
            half_width=0.5 * slider.width,
            half_length=0.5 * slider.length,
            K=self.stiffness,
            n=self.exponent,
            C=0.75 * (1.0 - self.restitution**2),
            speed_floor=self.impact_speed_floor,
            c_f=self.friction_coefficient,
            v0=self.static_speed,
            v1=self.transition_speed,
        )


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
        One line naming the key, where the scene asks for what this model does not simulate or its
        linkage cannot be assembled.
    """
    mechanism, drive, initial = scene["mechanism"], scene["drive"], scene["initial"]
    contact, friction, joints = scene["contact"], scene["friction"], scene["joints"]
    speed = float(drive["speed_rpm"])
    if speed == 0.0:
        raise ValueError("drive.speed_rpm = 0.0 must not be zero")
    if joints["crank_pin"] != "ideal":
        raise ValueError(_unsupported("joints.crank_pin", joints["crank_pin"], "ideal"))
    if contact["law"] != "hertz-corners":
        raise ValueError(_unsupported("contact.law", contact["law"], "hertz-corners"))
    groups = frozenset(scene["output"]["groups"])
    for group in sorted(groups - {"accelerations", "corners"}):
        raise ValueError(_unsupported("output.groups", group, "accelerations' and 'corners"))
    solver = scene["solver"]["reference"]
    if solver["method"] != "dop853":
        raise ValueError(_unsupported("solver.reference.method", solver["method"], "dop853"))
    if solver["tolerance"] < SMALLEST_TOLERANCE:
        raise ValueError(
            f"solver.reference.tolerance = {solver['tolerance']!r} must be at least {SMALLEST_TOLERANCE!r}: "
            "the angles themselves are rounded at 1e-16 rad"
        )
    pivot_x, pivot_y = mechanism["rocker_pivot"]
    parameters = Parameters(
        crank=_rod(mechanism["crank"]),
        rod2=_rod(mechanism["rod2"]),
        rocker=_rod(mechanism["rocker"]),
        rod4=_rod(mechanism["rod4"]),
        slider=Slider(
            **{k: float(mechanism["slider"][k]) for k in ("mass", "inertia", "length", "width", "thickness")}
        ),
        rocker_pivot=(float(pivot_x), float(pivot_y)),
        guide_x=float(mechanism["guide_x"]),
        reference_offset=float(mechanism["reference_offset"]),
        crank_angle=math.radians(mechanism["crank_angle_deg"]),
        rocker_branch=int(mechanism["rocker_branch"]),
        slider_branch=int(mechanism["slider_branch"]),
        omega=speed * 2.0 * math.pi / 60.0,
        period=60.0 / abs(speed),
        cycles=float(drive["cycles"]),
        slider_offset=float(initial["slider_offset"]),
        slider_angle=float(initial["slider_angle"]),
        slider_vx=float(initial["slider_vx"]),
        slider_omega=float(initial["slider_omega"]),
        ideal_slider=joints["slider"] == "ideal",
        clearance=float(scene["clearance"]["slider"]),
        youngs_modulus=float(contact["youngs_modulus"]),
        poisson=float(contact["poisson"]),
        restitution=float(contact["restitution"]),
        exponent=float(contact["exponent"]),
        corner_radius=float(contact["corner_radius"]),
        impact_speed_floor=float(contact["impact_speed_floor"]),
        friction_coefficient=float(friction["coefficient"]),
        static_speed=float(friction["static_speed"]),
        transition_speed=float(friction["transition_speed"]),
        gravity=float(scene["environment"]["gravity"]),
        groups=groups,
        samples_per_cycle=int(scene["output"]["samples_per_cycle"]),
        tolerance=float(solver["tolerance"]),
    )
    _require_assembly(parameters)
    return parameters


def _rod(entry: Mapping[str, Any]) -> Rod:
    return Rod(**{key: float(entry[key]) for key in ("length", "centroid", "mass", "inertia")})


def _unsupported(key: str, value: object, supported: str) -> str:
    return f"{key} = {value!r} is not simulated by the reference model; use '{supported}'"


def _require_assembly(p: Parameters) -> None:
    """Raise unless the four-bar O-A-B-H closes over the whole revolution of the crank."""
    pivot = math.hypot(*p.rocker_pivot)
    near, far = abs(pivot - p.crank.length), pivot + p.crank.length
    longest, shortest = p.rod2.length + p.rocker.centroid, abs(p.rod2.length - p.rocker.centroid)
    if far >= longest or near <= shortest:
        raise ValueError(
            f"mechanism: the linkage cannot be assembled over a whole revolution: crank pin to rocker pivot "
            f"is {near:.6g}..{far:.6g} m, rod 2 and rocker reach {shortest:.6g}..{longest:.6g} m"
        )
