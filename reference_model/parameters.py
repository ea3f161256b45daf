"""The scene's numbers in the paper's symbols, checked and ready for the kernels.

`Parameters` is read from a plain mapping by `reference_model.reading`; `Constants` is the flat tuple of
floats that the compiled kernels take.
"""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple, cast

import numpy as np

LAWS = ("hertz-corners", "paper-switching", "strip")
"""Contact laws of the slider, by their number in `Constants.law`."""


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
    """What the kernels read: floats only, so that one compiled version serves every scene.

    The kernels take it as a record (`as_record`).
    """

    omega: float
    """Crank speed, rad/s, counter-clockwise positive."""
    theta0: float
    """Crank angle at t = 0, rad."""
    m1: float
    """Masses, kg."""
    m2: float
    m3: float
    m4: float
    m5: float
    J1: float
    """Inertias about the centroids, kg m^2."""
    J2: float
    J3: float
    J4: float
    J5: float
    Ls1: float
    """Centroids from the first pin, m."""
    Ls2: float
    Ls3: float
    """Also the distance from the rocker's pivot H to B, where rod 2 is pinned."""
    Ls4: float
    L1: float
    """Crank length, m."""
    L2: float
    """Length of rod 2, m."""
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
    law: float
    """0: hertz-corners, 1: paper-switching, 2: strip (`reference_model.contact`)."""
    K: float
    """Contact stiffness of a corner, Eq. 10, N/m^n."""
    Ks: float
    """Stiffness of a whole side, Eq. 8, N/m."""
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
    pin_clearance: float
    """Radial clearance at the crank pin A, m."""
    bearing_radius: float
    """R_b of the bearing in rod 2, m."""
    Kj: float
    """Contact stiffness of journal and bearing, Eq. 10 with R = R_j R_b / (R_b - R_j), N/m^n."""
    alpha: float
    """Baumgarte's alpha and beta of the multiplier form, 1/s (Eq. 21)."""
    beta: float


class Formulation(StrEnum):
    """What the equations of motion are written in."""

    IDEAL = "for_ideal"
    """No freedom left: closed form."""
    SLIDER = "for_slider_clearance"
    """theta_4 and theta_5 behind the driven four-bar."""
    PIN = "for_pin_clearance"
    """theta_2 and theta_3: clearance at the crank pin A, ideal slider."""
    BOTH = "for_both_clearances"
    """theta_2 .. theta_5: clearance at A and at the slider."""
    MULTIPLIER = "for_multiplier"
    """The paper's: 15 coordinates, 13 multipliers, clearance at the slider."""
    MULTIPLIER_IDEAL = "for_multiplier_ideal_slider"
    """15 coordinates, 15 multipliers."""


def as_record(constants: Constants, formulation: Formulation) -> Constants:
    """Return the constants as the kernels take them: one record, passed by reference.

    An extra field named after the formulation makes its type another one, so that numba compiles the
    integrator once for each formulation in use (`reference_model.formulations`).
    """
    dtype = np.dtype([(name, np.float64) for name in (*Constants._fields, formulation.value)])
    record = np.array([(*constants, 0.0)], dtype=dtype).view(np.recarray)[0]
    return cast(Constants, record)


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
    ideal_pin: bool
    """Whether the crank pin A is an ideal revolute."""
    clearance: float
    """c_T, per side, m."""
    pin_clearance: float
    """Radial, at A, m."""
    journal_radius: float
    """R_j, m."""
    law: int
    """Index into LAWS."""
    youngs_modulus: float
    """E of all bodies in contact, Pa."""
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
    formulation: str
    """"auto" (the smallest that gives what the scene asks for), "minimal" or "multiplier"."""
    method: str
    """Integrator: "dop853", compiled, or one of `reference_model.by_scipy.SOLVERS`."""
    tolerance: float
    """Absolute local error of the positions, m and rad."""
    alpha: float
    """Baumgarte's alpha, 1/s (Eq. 21)."""
    beta: float
    """Baumgarte's beta, 1/s."""

    @property
    def compliance(self) -> float:
        """sigma_m + sigma_n with sigma = (1 - nu^2) / E (Eq. 10), 1/Pa."""
        return 2.0 * (1.0 - self.poisson**2) / self.youngs_modulus

    def point_stiffness(self, radius: float) -> float:
        """K = 4 sqrt(R) / (3 (sigma_m + sigma_n)) of a contact of the given radius (Eq. 10), N/m^1.5."""
        return 4.0 / (3.0 * self.compliance) * math.sqrt(radius)

    @property
    def constants(self) -> Constants:
        """The numbers the kernels need."""
        rod4, slider = self.rod4, self.slider
        half_gap = 0.5 * slider.width + self.clearance
        bearing = self.journal_radius + self.pin_clearance
        return Constants(
            omega=self.omega,
            theta0=self.crank_angle,
            m1=self.crank.mass,
            m2=self.rod2.mass,
            m3=self.rocker.mass,
            m4=rod4.mass,
            m5=slider.mass,
            J1=self.crank.inertia,
            J2=self.rod2.inertia,
            J3=self.rocker.inertia,
            J4=rod4.inertia,
            J5=slider.inertia,
            Ls1=self.crank.centroid,
            Ls2=self.rod2.centroid,
            Ls3=self.rocker.centroid,
            Ls4=rod4.centroid,
            L1=self.crank.length,
            L2=self.rod2.length,
            L3=self.rocker.length,
            Hx=self.rocker_pivot[0],
            Hy=self.rocker_pivot[1],
            rocker_branch=float(self.rocker_branch),
            L4=rod4.length,
            slider_branch=float(self.slider_branch),
            first_moment=rod4.mass * rod4.centroid + slider.mass * rod4.length,
            moving_mass=rod4.mass + slider.mass,
            I4=rod4.inertia + rod4.mass * rod4.centroid**2 + slider.mass * rod4.length**2,
            gravity=self.gravity,
            line_x=self.guide_x + self.reference_offset,
            wall_left=self.guide_x - half_gap,
            wall_right=self.guide_x + half_gap,
            half_width=0.5 * slider.width,
            half_length=0.5 * slider.length,
            law=float(self.law),
            K=self.point_stiffness(self.corner_radius),
            Ks=(slider.thickness + slider.length) / (0.475 * self.compliance),
            n=self.exponent,
            C=0.75 * (1.0 - self.restitution**2),
            speed_floor=self.impact_speed_floor,
            c_f=self.friction_coefficient,
            v0=self.static_speed,
            v1=self.transition_speed,
            pin_clearance=self.pin_clearance,
            bearing_radius=bearing,
            # Conformal: R = R_j R_b / (R_b - R_j); without clearance there is no such contact.
            Kj=self.point_stiffness(self.journal_radius * bearing / self.pin_clearance)
            if self.pin_clearance > 0.0
            else math.inf,
            alpha=self.alpha,
            beta=self.beta,
        )
