"""From the scene mapping to `Parameters`: what this model can simulate, checked once."""

import math
from collections.abc import Mapping
from typing import Any

from reference_model.parameters import IMPACT_SPEEDS, LAWS, SCIPY_METHODS, Parameters, Rod, Slider

GROUPS = ("accelerations", "corners", "joints", "energy")
FORMULATIONS = ("auto", "minimal", "multiplier")
METHODS = ("dop853", *SCIPY_METHODS)
SMALLEST_TOLERANCE = 1e-14
"""Of solver.reference.tolerance, rad."""
_LARGEST_SHARE = 0.01
"""Of the largest tolerance in the angle that crosses a clearance; with some more, forces reach 1e18 N."""


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
    groups = frozenset(scene["output"]["groups"])
    solver = scene["solver"]["reference"]
    formulation = solver.get("formulation", "auto")
    impact_speed = contact.get("impact_speed", "frozen")
    for key, value, known in (
        ("joints.slider", joints["slider"], ("clearance", "ideal")),
        ("joints.crank_pin", joints["crank_pin"], ("clearance", "ideal")),
        ("contact.law", contact["law"], LAWS),
        ("contact.impact_speed", impact_speed, IMPACT_SPEEDS),
        ("solver.reference.formulation", formulation, FORMULATIONS),
        ("solver.reference.method", solver["method"], METHODS),
        *(("output.groups", group, GROUPS) for group in sorted(groups)),
    ):
        if value not in known:
            raise ValueError(f"{key} = {value!r} is not simulated by the reference model; use one of {known}")
    if joints["crank_pin"] == "clearance" and formulation == "multiplier":
        raise ValueError(
            "solver.reference.formulation = 'multiplier' has ideal revolutes only; use 'minimal' with a "
            "clearance at the crank pin"
        )
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
        ideal_pin=joints["crank_pin"] == "ideal",
        clearance=float(scene["clearance"]["slider"]),
        pin_clearance=float(scene["clearance"]["crank_pin"]),
        journal_radius=float(scene["clearance"]["journal_radius"]),
        law=LAWS.index(contact["law"]),
        memoryless=impact_speed == "current",
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
        formulation=formulation,
        method=solver["method"],
        tolerance=float(solver["tolerance"]),
        alpha=float(solver["baumgarte_alpha"]),
        beta=float(solver["baumgarte_beta"]),
    )
    _require_assembly(parameters)
    _require_tolerance(parameters)
    return parameters


def _rod(entry: Mapping[str, Any]) -> Rod:
    return Rod(**{key: float(entry[key]) for key in ("length", "centroid", "mass", "inertia")})


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


def _require_tolerance(p: Parameters) -> None:
    """Raise where an error as large as the tolerance would be no longer small beside a clearance."""
    for free, key, clearance, length in (
        (not p.ideal_slider, "clearance.slider", p.clearance, p.rod4.length),
        (not p.ideal_pin, "clearance.crank_pin", p.pin_clearance, p.rod2.length),
    ):
        largest = _LARGEST_SHARE * clearance / length
        if free and clearance > 0.0 and p.tolerance > largest:
            raise ValueError(
                f"solver.reference.tolerance = {p.tolerance:g} must be at most {largest:.1e} rad, "
                f"{_LARGEST_SHARE:.0%} of the angle by which a rod of {length:g} m crosses {key}"
            )
