"""The scene's numbers in the paper's symbols, read from a plain mapping by `reference_model.reading`."""

import math
from dataclasses import dataclass

from reference_model.constants import Constants

LAWS = ("hertz-corners", "paper-switching", "strip", "foundation")
"""Contact laws of the slider, by their number in `Constants.law`."""

IMPACT_SPEEDS = ("frozen", "current")
"""What the damping refers to, by its number in `Constants.memoryless`."""

SCIPY_METHODS = ("BDF", "Radau", "LSODA", "scipy-DOP853")
"""Integrators of `reference_model.scipy_solvers`: scipy's names, except the one with a compiled namesake."""

NARROWEST_RANGE = 1.0e-10
"""m/s, what slips are located to: a range without friction below a smaller speed counts as none."""


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
    memoryless: bool
    """Whether the damping refers to the present depth rate, not to the impact speed frozen at the touch."""
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
    """Integrator: "dop853", compiled, or one of `SCIPY_METHODS`."""
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
            memoryless=float(self.memoryless),
            K=self.point_stiffness(self.corner_radius),
            Ks=(slider.thickness + slider.length) / (0.475 * self.compliance),
            n=self.exponent,
            C=0.75 * (1.0 - self.restitution**2),
            speed_floor=self.impact_speed_floor,
            c_f=self.friction_coefficient,
            v0=self.static_speed if self.static_speed > NARROWEST_RANGE else 0.0,
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
