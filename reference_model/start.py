"""Which formulation a scene gets, and its state at t = 0."""

import math

import numpy as np

from reference_model.bodies import motion_slider_clearance
from reference_model.constants import Constants, Formulation, as_record
from reference_model.forces import Array
from reference_model.linkage import four_bar, reaches_line, rod4_from_slider
from reference_model.parameters import Parameters

NAMES = {
    Formulation.IDEAL: "closed form",
    Formulation.SLIDER: "minimal: rod 4 and slider (2 coordinates)",
    Formulation.PIN: "minimal: rod 2 and rocker (2 coordinates)",
    Formulation.BOTH: "minimal: rod 2, rocker, rod 4 and slider (4 coordinates)",
    Formulation.MULTIPLIER: "multiplier (15 coordinates, 13 multipliers)",
    Formulation.MULTIPLIER_IDEAL: "multiplier (15 coordinates, 15 multipliers)",
}


def formulation(p: Parameters) -> Formulation:
    """Return the smallest formulation for a scene, or the paper's where asked for."""
    if p.formulation == "multiplier":
        return Formulation.MULTIPLIER_IDEAL if p.ideal_slider else Formulation.MULTIPLIER
    if p.ideal_pin:
        return Formulation.IDEAL if p.ideal_slider else Formulation.SLIDER
    return Formulation.PIN if p.ideal_slider else Formulation.BOTH


def start(p: Parameters, kind: Formulation) -> tuple[Constants, Array]:
    """Return the constants of a formulation, and its coordinates and velocities at t = 0.

    All bodies are where the ideal mechanism has them, but for the slider, which starts where the scene says;
    y and vy follow from rod 4. With clearance at A the pin is centred.

    Raises
    ------
    ValueError
        One line, where rod 4 does not reach.
    """
    c = as_record(p.constants, kind)
    ideal = as_record(p.constants, Formulation.IDEAL)
    if not reaches_line(ideal, np.linspace(0.0, p.period, 1000)):
        raise ValueError("mechanism: rod 4 is too short: it does not reach the guide all the way round")
    theta4, w4 = rod4_from_slider(ideal, 0.0, *_slider_start(p))
    if not math.isfinite(theta4):
        raise ValueError(f"initial.slider_offset = {p.slider_offset!r} m: rod 4 does not reach that far")
    theta5, w5 = (0.0, 0.0) if p.ideal_slider else (p.slider_angle, p.slider_omega)
    f = four_bar(ideal, 0.0)
    theta2, theta3 = math.atan2(f.s2, f.c2), math.atan2(f.s3, f.c3)
    if kind is Formulation.SLIDER:
        return c, np.array([theta4, theta5, w4, w5])
    if kind is Formulation.PIN:
        return c, np.array([theta2, theta3, f.w2, f.w3])
    if kind is Formulation.BOTH:
        return c, np.array([theta2, theta3, theta4, theta5, f.w2, f.w3, w4, w5])
    bodies = np.empty((5, 9))
    motion_slider_clearance(ideal, 0.0, np.array([theta4, theta5, w4, w5]), np.zeros(4), bodies)
    return c, np.concatenate([bodies[:, :3].ravel(), bodies[:, 3:6].ravel()])


def _slider_start(p: Parameters) -> tuple[float, float]:
    if p.ideal_slider:
        return p.guide_x + p.reference_offset, 0.0
    return p.guide_x + p.slider_offset, p.slider_vx
