"""Read a scene's plain mapping: this model's own derivation from the printed numbers.

Derived here and nowhere else: angular speed and period, the contact stiffnesses of Eqs. 8 and 10 and the
factor of the damping term of Eq. 11.
"""

import math
from collections.abc import Mapping
from typing import Any

from exudyn_model.contact.laws import LAWS
from exudyn_model.parameters import (
    Drive,
    Guide,
    Initial,
    Integration,
    Journal,
    Mechanism,
    Parameters,
    Rod,
    Slider,
)
from exudyn_model.solver_choice import choose_solver


def read_scene(scene: Mapping[str, Any]) -> Parameters:
    """Read the complete plain mapping of a scene.

    Parameters
    ----------
    scene : mapping
        All sections of the scene format, defaults filled in.

    Returns
    -------
    parameters : Parameters

    Raises
    ------
    ValueError
        In one line, for what this model does not simulate.
    """
    refuse_unsupported(scene)
    solver = choose_solver(scene)
    mechanism, joints, initial = scene["mechanism"], scene["joints"], scene["initial"]
    slider = mechanism["slider"]
    speed = float(scene["drive"]["speed_rpm"])
    pivot_x, pivot_y = mechanism["rocker_pivot"]
    return Parameters(
        Mechanism(
            **{name: _rod(mechanism[name]) for name in ("crank", "rod2", "rocker", "rod4")},
            slider=Slider(
                float(slider["mass"]),
                float(slider["inertia"]),
                float(slider["length"]),
                float(slider["width"]),
            ),
            rocker_pivot=(float(pivot_x), float(pivot_y)),
            guide_x=float(mechanism["guide_x"]),
            reference_offset=float(mechanism["reference_offset"]),
            crank_angle=math.radians(mechanism["crank_angle_deg"]),
            rocker_branch=int(mechanism["rocker_branch"]),
            slider_branch=int(mechanism["slider_branch"]),
            gravity=float(scene["environment"]["gravity"]),
            ideal_slider=joints["slider"] == "ideal",
        ),
        Drive(omega=speed * math.pi / 30, period=60 / abs(speed), cycles=float(scene["drive"]["cycles"])),
        Initial(
            float(initial["slider_offset"]),
            float(initial["slider_angle"]),
            float(initial["slider_vx"]),
            float(initial["slider_omega"]),
        ),
        _guide(scene),
        _journal(scene) if joints["crank_pin"] == "clearance" else None,
        Integration(
            formulation=solver["formulation"],
            method=solver["method"],
            step=float(solver["step"]),
            tolerance=float(solver["tolerance"]),
            samples_per_cycle=int(scene["output"]["samples_per_cycle"]),
            accelerations="accelerations" in scene["output"]["groups"],
            corners="corners" in scene["output"]["groups"] and joints["slider"] == "clearance",
            joints="joints" in scene["output"]["groups"],
            energy="energy" in scene["output"]["groups"],
        ),
    )


def _rod(values: Mapping[str, float]) -> Rod:
    return Rod(*(float(values[key]) for key in ("length", "centroid", "mass", "inertia")))


def _compliance(scene: Mapping[str, Any]) -> float:
    """sigma_m + sigma_n for two bodies of one material, m^2/N."""
    material = scene["contact"]
    # sigma = (1 - nu^2) / E, without the pi that some texts carry
    return float(2 * (1 - material["poisson"] ** 2) / material["youngs_modulus"])


def _impact_speed(scene: Mapping[str, Any]) -> str:
    return str(scene["contact"].get("impact_speed", "frozen"))


def _surface(scene: Mapping[str, Any], radius: float) -> dict[str, Any]:
    """Derive K of Eq. 10 for a radius (m) and the damping factor of Eq. 11; what every contact shares."""
    material, friction = scene["contact"], scene["friction"]
    return {
        "stiffness": 4 * math.sqrt(radius) / (3 * _compliance(scene)),
        "exponent": float(material["exponent"]),
        "damping": 0.75 * (1 - material["restitution"] ** 2),
        "impact_speed": _impact_speed(scene),
        "impact_speed_floor": float(material["impact_speed_floor"]),
        "friction": float(friction["coefficient"]),
        "static_speed": float(friction["static_speed"]),
        "transition_speed": float(friction["transition_speed"]),
    }


def _guide(scene: Mapping[str, Any]) -> Guide:
    slider = scene["mechanism"]["slider"]
    return Guide(
        clearance=float(scene["clearance"]["slider"]),
        law=scene["contact"]["law"],
        # Eq. 8 with a = T + L
        side_stiffness=(slider["thickness"] + slider["length"]) / (0.475 * _compliance(scene)),
        **_surface(scene, scene["contact"]["corner_radius"]),
    )


def _journal(scene: Mapping[str, Any]) -> Journal:
    """Two conforming cylinders: their radius of Eq. 10 is R_j R_b / (R_b - R_j)."""
    clearance, radius = float(scene["clearance"]["crank_pin"]), float(scene["clearance"]["journal_radius"])
    return Journal(
        clearance=clearance,
        radius=radius,
        **_surface(scene, radius * (radius + clearance) / clearance),
    )


def refuse_unsupported(scene: Mapping[str, Any]) -> None:
    """Raise a ValueError of one line for what this model does not simulate."""
    choices = [
        ("joints.slider", scene["joints"]["slider"], ("clearance", "ideal")),
        ("joints.crank_pin", scene["joints"]["crank_pin"], ("ideal", "clearance")),
        ("contact.law", scene["contact"]["law"], LAWS),
        ("contact.impact_speed", _impact_speed(scene), ("frozen", "current")),
        *(
            ("output.groups", group, ("accelerations", "corners", "joints", "energy"))
            for group in scene["output"]["groups"]
        ),
    ]
    for key, value, known in choices:
        if value not in known:
            usable = " or ".join(repr(name) for name in known)
            raise ValueError(f"{key} = {value!r} is not simulated by the Exudyn model yet; use {usable}")
    if scene["drive"]["speed_rpm"] == 0:
        raise ValueError(f"drive.speed_rpm = {scene['drive']['speed_rpm']} must not be zero")
    positive = [
        ("drive.cycles", scene["drive"]["cycles"]),
        ("output.samples_per_cycle", scene["output"]["samples_per_cycle"]),
        ("contact.impact_speed_floor", scene["contact"]["impact_speed_floor"]),
    ]
    for key, value in positive:
        if not value > 0:
            raise ValueError(f"{key} = {value} must be positive")
    cycles, samples = scene["drive"]["cycles"], scene["output"]["samples_per_cycle"]
    if round(cycles * samples) < 1:
        raise ValueError(
            f"drive.cycles = {cycles} must last for a sample at least: {samples} samples a cycle"
        )
    friction = scene["friction"]
    if not friction["transition_speed"] > friction["static_speed"]:
        raise ValueError(
            f"friction.transition_speed = {friction['transition_speed']} must be greater than "
            f"friction.static_speed = {friction['static_speed']}"
        )
