"""Crank, rod 2 and rocker: a chain of one degree of freedom, known at every crank angle."""

from cmath import exp, phase
from collections.abc import Mapping
from math import pi, radians, sqrt
from typing import Any, NamedTuple


class Pose(NamedTuple):
    """The driven chain at one time: angles, their rates, and the rocker's tip C with its velocity."""

    angles: tuple[float, float, float]
    rates: tuple[float, float, float]
    tip: complex
    tip_velocity: complex


class Linkage:
    """Closure of the driven chain, and of rod 4 with the slider on a given line."""

    def __init__(self, mechanism: Mapping[str, Any], drive: Mapping[str, Any]) -> None:
        self.omega = 2.0 * pi / 60.0 * drive["speed_rpm"]
        self.theta0 = radians(mechanism["crank_angle_deg"])
        self.crank, self.rod2, self.rocker, self.rod4 = (
            mechanism[name]["length"] for name in ("crank", "rod2", "rocker", "rod4")
        )
        self.arm, self.pivot = mechanism["rocker"]["centroid"], complex(*mechanism["rocker_pivot"])
        self.rocker_branch, self.slider_branch = mechanism["rocker_branch"], mechanism["slider_branch"]

    def at(self, t: float) -> Pose:
        """Close the chain; a `ValueError` where it cannot be closed."""
        theta1 = self.omega * t + self.theta0
        u1 = exp(1j * theta1)
        A = self.crank * u1
        d = abs(self.pivot - A)
        e = (self.pivot - A) / d
        p = (d * d + self.rod2**2 - self.arm**2) / (2.0 * d)
        across = self.rod2**2 - p * p
        if across < 0.0:
            raise ValueError(f"mechanism: rod 2 does not reach the rocker at crank angle {theta1:g} rad")
        B = A + e * complex(p, self.rocker_branch * sqrt(across))
        u2, u3 = (B - A) / self.rod2, (B - self.pivot) / self.arm
        share = self.omega * self.crank / cross(u3, u2)
        omega2, omega3 = share * cross(u1, u3) / self.rod2, share * cross(u1, u2) / self.arm
        tip, tip_velocity = self.pivot + self.rocker * u3, 1j * omega3 * self.rocker * u3
        return Pose((theta1, phase(u2), phase(u3)), (self.omega, omega2, omega3), tip, tip_velocity)

    def hang(self, pose: Pose, x: float, vx: float) -> tuple[float, float]:
        """Return angle and rate of rod 4 with its end at x moving at vx; a `ValueError` out of its reach."""
        cosine = (x - pose.tip.real) / self.rod4
        if abs(cosine) >= 1.0:
            angle = pose.angles[0]
            raise ValueError(f"mechanism: rod 4 does not reach the guide at crank angle {angle:g} rad")
        sine = self.slider_branch * sqrt(1.0 - cosine * cosine)
        return phase(complex(cosine, sine)), (pose.tip_velocity.real - vx) / (self.rod4 * sine)


def cross(a: complex, b: complex) -> float:
    """Return a_x b_y - a_y b_x."""
    return a.real * b.imag - a.imag * b.real
