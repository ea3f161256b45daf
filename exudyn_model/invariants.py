"""What no correct run can show: bounds with their reasons, and the verdict on a run that violates one.

What is judged here was observed in accepted states, in the table of contacts, in the audit of the energy
(``watch``, ``seen``) and in the constraints (``five_bodies.constraints``), not where contacts are located and
forces computed.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.five_bodies.native_contact import sphere_friction
from exudyn_model.parameters import Parameters
from exudyn_model.seen import Seen

UNITS = {
    "open-depth": "m",
    "pull": "N",
    "driving-friction": "W",
    "leaving-start": "m/s",
    "start-gap": "m",
    "overlap": "s",
    "energy": "1",
    "constraint-position": "m",
    "constraint-velocity": "m/s",
}

# What each says when it is violated
_SENTENCES = {
    "open-depth": "{place} is inside its wall outside a contact",
    "pull": "the wall pulls {place}",
    "driving-friction": "friction drives {place}",
    "leaving-start": "a contact of {place} begins while it leaves",
    "start-gap": "a contact of {place} begins away from its wall",
    "overlap": "two contacts of {place} overlap",
    "energy": "the energy does not balance",
    "constraint-position": "{place} is violated",
    "constraint-velocity": "the rate of {place} is violated",
}


@dataclass(frozen=True)
class Bound:
    """Bound of one invariant.

    Attributes
    ----------
    name : str
        Of ``UNITS``.
    formulations, methods : tuple of str
        Where it holds; see ``solver_choice``.
    factor : float
        Bound over ``scale``.
    scale : str
        What of the run: see :func:`scales`.
    """

    name: str
    formulations: tuple[str, ...]
    methods: tuple[str, ...]
    factor: float
    scale: str


# m: with index 3 the Newton iteration also ends at 1e-8 of the residual that it begins with. Measured in the
# paper's case, whatever the tolerance below this: 1.5e-12 m
_RELATIVE_END = 1e-12

_FIXED, _IMPLICIT = ("full", "native"), ("generalized-alpha", "trapezoidal-index2")
_ALL, _ANY = ("tree", *_FIXED), ("dopri5", *_IMPLICIT)

BOUNDS = (
    # Touches are located until the gap is less than 2e-15 m; what is left is round-off
    Bound("open-depth", ("tree",), _ANY, 1e-11, "one"),
    # A corner that touches inside a step is no deeper at its end, where its contact begins
    Bound("open-depth", _FIXED, _ANY, 1.0, "normal_path"),
    # The law is clipped at 0: a product and a sum are rounded
    Bound("pull", _ALL, _ANY, 1e-13, "force"),
    # Against the slip, whose sign is wrong only where it is rounded
    Bound("driving-friction", ("tree", "full"), _ANY, 1e-13, "power"),
    Bound("driving-friction", ("native",), _ANY, 1.0, "sphere_power"),
    # What is located approaches, but for a contact that has just ended and is pressed back, by some
    # 1e4 m/s^2, before it is 2e-15 m away: the root of twice their product
    Bound("leaving-start", ("tree",), _ANY, 1e-5, "one"),
    # A gap that falls below 0 in a step approaches at its start or at its end, but for the Newton iteration's
    # error in positions over the step
    Bound("leaving-start", _FIXED, _ANY, 1.0, "rounded_speed"),
    # Where touches are located a step ends there; else the wall is reached inside a step
    Bound("start-gap", ("tree",), _ANY, 1e-11, "one"),
    Bound("start-gap", _FIXED, _ANY, 1.0, "normal_path"),
    # A contact ends before the next one begins, both times rounded
    Bound("overlap", _ALL, _ANY, 1.0, "rounded_time"),
    # The trapezoidal rule's error in the contacts
    Bound("energy", _FIXED, ("trapezoidal-index2",), 1.0, "energy_order"),
    # Part of the residual of the Newton iteration, of which the norm is a mean over up to 30 rows
    Bound("constraint-position", _FIXED, ("generalized-alpha",), 10.0, "newton_end"),
    Bound("constraint-velocity", _FIXED, ("trapezoidal-index2",), 10.0, "newton"),
    # Not enforced: an error of second order in the step
    Bound("constraint-velocity", _FIXED, ("generalized-alpha",), 1.0, "crank_speed_order"),
    Bound("constraint-position", _FIXED, ("trapezoidal-index2",), 1.0, "drift_order"),
)


def scales(
    parameters: Parameters,
    contacts: NDArray[np.void],
    events: Mapping[str, NDArray[Any]],
    extrema: Mapping[str, Mapping[str, float]],
    step: float,
    longest: float,
    tolerance: float,
) -> dict[str, float]:
    """Return the scales of a run that the bounds are multiples of.

    Parameters
    ----------
    parameters : Parameters
    contacts : ndarray, shape (5,)
        Watched: see ``watch``.
    events, extrema : mapping
        Of ``simulation.Result``.
    step, longest : float
        That in a contact and the longest one in flight, s; 0 for a tree.
    tolerance : float
        Of the Newton iteration; 0 for a tree.
    """
    force, slip = float(np.max(contacts["strongest"])), float(np.max(contacts["fastest_slip"]))
    omega, duration = parameters.drive.omega, parameters.samples * parameters.sample_interval
    found = {
        "one": 1.0,
        "newton": tolerance,
        "newton_end": max(tolerance, _RELATIVE_END),
        "normal_path": float(np.max(contacts["fastest"])) * step,
        "force": force,
        "power": force * slip,
        "sphere_power": force * sphere_friction(parameters.contact, extrema, slip),
        "rounded_time": 64 * math.ulp(duration),
    }
    if step > 0.0:
        # Positions are rounded to some 1e-15 m
        rounded_speed, squared = 1e-13 / step, (omega * longest) ** 2
        cycles = parameters.drive.cycles
        # A mean of the squares: a long rest beside short impacts says nothing of the steps in those
        impulse = np.asarray(events["impulse"], dtype=float)
        shares = step / np.maximum(events["end"] - events["start"], step)
        squared_share = float(impulse @ shares**2) / float(impulse.sum()) if impulse.sum() > 0.0 else 0.0
        found |= {
            "rounded_speed": rounded_speed,
            "crank_speed_order": abs(omega) * parameters.mechanism.crank.length * (1e-4 + 10 * squared)
            + rounded_speed,
            "drift_order": 1e-7 + 10 * squared * (1 + cycles),
            "energy_order": _energy_order(parameters, step, squared_share) + squared,
        }
    return found


def _energy_order(parameters: Parameters, step: float, squared_share: float) -> float:
    """Bound the energy's residual in contacts, an error of second order in the step's share of one."""
    # The friction of a pin with clearance reverses within a step: measured 4e-6
    order = (1e-6 if parameters.journal is None else 1e-4) + 10 * squared_share
    if parameters.contact.law == "strip":
        # A surface of steel is stiffer than the steps resolve: measured 3e-3
        squared = step**2 * parameters.contact.side_stiffness / parameters.mechanism.slider.mass
        order += 0.05 * min(1.0, squared)
    return order


def judge(
    seen: list[Seen], formulation: str, method: str, scales: Mapping[str, float]
) -> tuple[dict[str, dict[str, Any]], str]:
    """Compare what was observed with its bounds.

    Parameters
    ----------
    seen : list of Seen
    formulation, method : str
        Of ``parameters.Integration``.
    scales : mapping
        Value of each scale that ``BOUNDS`` names.

    Returns
    -------
    invariants : dict
        Name to "value", "bound", "unit" and "time_s", for each that has a bound.
    broken : str
        The worst violation in one line; empty if there is none.
    """
    invariants: dict[str, dict[str, Any]] = {}
    worst, broken = 1.0, ""
    for bound in BOUNDS:
        if formulation not in bound.formulations or method not in bound.methods:
            continue
        limit = bound.factor * scales[bound.scale]
        kind = [one for one in seen if one.name == bound.name]
        if kind:
            one, unit = max(kind, key=lambda one: one.value), UNITS[bound.name]
            invariants[one.name] = {"value": one.value, "bound": limit, "unit": unit, "time_s": one.time}
            excess = one.value / limit if limit > 0.0 else math.inf
            if one.value > limit and excess > worst:
                worst = excess
                sentence = _SENTENCES[one.name].format(place=one.place)
                measure = "" if unit == "1" else f" {unit}"
                broken = (
                    f"{one.name}: {sentence} by {one.value:.3g}{measure} at {one.time:.9g} s, "
                    f"bound {limit:.3g}{measure}"
                )
    return invariants, broken
