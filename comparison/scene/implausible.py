"""Values of a scene that are valid but probably not meant: warnings, each with its reason."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from math import cos, degrees, gamma, hypot, inf, pi, sin, sqrt
from typing import Any

from comparison.models import joints_with_clearance
from comparison.scene.schema import PARTNERS

STEPS_PER_CONTACT = 8
"""With fewer the first-cycle error of x does not follow the method's order: above 2e-5 s in the main case."""
LARGEST_TILT = 0.05
"""rad, of a slider in its guide: 3 degrees, four times that of the largest shipped clearance."""


def warnings(data: Mapping[str, Any]) -> Iterator[str]:
    """Yield a line for each implausible value of a complete scene: key, value, unit, reason."""
    joints, exudyn, lasts = joints_with_clearance(data), data["solver"]["exudyn"], contact_time(data)
    gravity, friction = data["environment"]["gravity"], data["friction"]["coefficient"]
    if "slider" in joints:
        yield from _in_guide(data)
    gap, journal = data["clearance"]["crank_pin"], data["clearance"]["journal_radius"]
    if "crank_pin" in joints and gap > journal / 5.0:
        yield f"clearance.crank_pin = {gap:g} m is large for clearance.journal_radius = {journal:g} m"
    # The tree controls its error: its step is the largest one.
    if exudyn["formulation"] != "tree" and exudyn["step"] > lasts / STEPS_PER_CONTACT:
        yield (
            f"solver.exudyn.step = {exudyn['step']:g} s is outside the asymptotic range of convergence: "
            f"contacts of {lasts:.2g} s require at most {lasts / STEPS_PER_CONTACT:.2g} s"
        )
    for partner in PARTNERS if joints else ():
        modulus = _of(data["contact"]["youngs_modulus"], partner)
        if not 1e6 <= modulus <= 1.3e12:
            what = "softer than rubber" if modulus < 1e6 else "stiffer than diamond"
            yield f"contact.youngs_modulus = {modulus:g} Pa is {what}: its unit is Pa"
            break
    if joints and friction > 2.0:
        yield f"friction.coefficient = {friction:g} is more than that of rubber: it is no percentage"
    if abs(gravity) > 100.0:
        yield f"environment.gravity = {gravity:g} m/s^2 is more than ten times the Earth's"
    for name in ("crank", "rod2", "rocker", "rod4", "slider"):
        body = data["mechanism"][name]
        size, centroid = hypot(body["length"], body.get("width", 0.0)), body.get("centroid", 0.0)
        if abs(centroid) > size:
            yield f"mechanism.{name}.centroid = {centroid:g} m is farther out than the rod's end, {size:g} m"
        if body["inertia"] > (largest := body["mass"] * size * size):
            yield (
                f"mechanism.{name}.inertia = {body['inertia']:g} kg m^2 exceeds mass times size squared, "
                f"{largest:.2g} kg m^2"
            )


def contact_time(data: Mapping[str, Any]) -> float:
    """Return about how long the shortest contacts of a scene last, s; infinite without clearance.

    A mass m hits a spring K d^n at the speed v: for n = 1.5 3.2181 (m^2 / (K^2 v))^(1/5), docs/model.md,
    section 6. m is that of a corner, with rod 4 upright; v = omega sqrt(crank * clearance). In the shipped
    scenes the time is between the shortest and the median; contacts of a ``foundation`` are shorter.
    """
    mechanism, contact, clearance = data["mechanism"], data["contact"], data["clearance"]
    slider, rod, n = mechanism["slider"], mechanism["rod4"], contact["exponent"]
    share, shortest = 1.0 / (n + 1.0), inf
    with suppress(ArithmeticError):  # beyond the numbers of the machine
        hanging = rod["inertia"] + rod["mass"] * rod["centroid"] ** 2 + slider["mass"] * rod["length"] ** 2
        mass = 1.0 / (rod["length"] ** 2 / hanging + (slider["length"] / 2.0) ** 2 / slider["inertia"])
        for joint in joints_with_clearance(data):
            gap, radius, partners = clearance[joint], contact["corner_radius"], PARTNERS
            if joint == "crank_pin":  # journal and bearing, both of the guide's material
                journal = clearance["journal_radius"]
                radius, partners = journal * (journal + gap) / gap, ("guide", "guide")
            poisson, modulus = contact["poisson"], contact["youngs_modulus"]
            compliance = sum((1.0 - _of(poisson, one) ** 2) / _of(modulus, one) for one in partners)
            stiffness = 4.0 / (3.0 * compliance) * sqrt(radius)
            speed = pi / 30.0 * abs(data["drive"]["speed_rpm"]) * sqrt(mechanism["crank"]["length"] * gap)
            depth = ((n + 1.0) * mass * speed**2 / (2.0 * stiffness)) ** share
            time = 2.0 * depth / speed * sqrt(pi) * gamma(1.0 + share) / gamma(0.5 + share)
            shortest = min(shortest, time or inf)
    return shortest


def _in_guide(data: Mapping[str, Any]) -> Iterator[str]:
    slider, gap, start = data["mechanism"]["slider"], data["clearance"]["slider"], data["initial"]
    width, length, radius = slider["width"], slider["length"], data["contact"]["corner_radius"]
    size = f"(width {width:g} m, length {length:g} m)"
    if (tilt := 2.0 * gap / length) > LARGEST_TILT:
        over = width + 2.0 * gap > hypot(width, length)
        does = "turn over" if over else f"tilt by {degrees(tilt):.2g} degrees"
        yield f"clearance.slider = {gap:g} m lets the slider {size} {does} in its guide"
    if radius > min(width, length) / 2.0:
        yield f"contact.corner_radius = {radius:g} m is larger than half the slider {size}"
    offset, angle = start["slider_offset"], start["slider_angle"]
    depth = abs(offset) - gap + (length * abs(sin(angle)) + width * (abs(cos(angle)) - 1.0)) / 2.0
    if abs(offset) > gap:
        yield (
            f"initial.slider_offset = {offset:g} m exceeds clearance.slider = {gap:g} m: the slider starts "
            "inside the wall"
        )
    elif depth > radius:  # where no contact law holds
        yield (
            f"initial.slider_angle = {angle:g} rad puts a corner {depth:.2g} m inside the wall, deeper than "
            f"contact.corner_radius = {radius:g} m"
        )


def _of(material: Any, partner: str) -> float:
    return float(material[partner] if isinstance(material, dict) else material)
