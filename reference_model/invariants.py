"""Check the invariants of a run, which every correct run keeps: their worst values and their bounds.

The values come from the states of the contacts at the ends of accepted steps (`reference_model.recording`),
independently of the location of events. The depth of an open contact in its wall comes from all rows within a
step, too, which show a contact that was stepped over. A run with a value beyond its bound has the status
`invariant-violated`.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from reference_model.dop853 import VELOCITY_TIME
from reference_model.linkage import Array
from reference_model.margins import LOCATED, LOCATED_SPEED
from reference_model.parameters import ADAMS_IMPACT, PAPER_SWITCHING, Contact, Parameters
from reference_model.state import Records

VIOLATED = "invariant-violated"

_TEXTS = {
    "open-depth": "is inside its wall outside a contact",
    "pull": "is pulled by its wall",
    "driving-friction": "is driven by friction",
    "start-gap": "begins a contact away from its wall",
    "leaving-start": "begins a contact while it leaves its wall",
    "overlap": "has two contacts at once",
    "energy": "spurious energy, relative to what was lost, moves or came from gravity",
    "constraint-position": "the constraints are violated",
    "constraint-velocity": "the constraints' rates are violated",
}
USUAL_ACCELERATION = 2.5e5
"""Acceleration of a corner in the hardest contact of 150 random scenes, m/s^2. A slow touch may be located as
late as at the depth LOCATED on the way out, where the corner leaves at sqrt(2 a d), 1e-3 m/s. The same force
accelerates a light part more."""
ENERGY_BOUND = 1e-4
"""Bound up to the usual tolerance, above which it grows in proportion. The worst of 400 random scenes of two
cycles has 2.3e-5."""
USUAL_TOLERANCE = 1e-8
DRIFT = 1e-6
"""Bound of the drift, m, with Baumgarte's terms and a controlled local error. The worst of 40 random scenes
has 5e-12 m at the usual tolerance; more than this would show in the clearances themselves."""
UNCONTROLLED_DRIFT = 1e-3
"""Bound of the drift, m, without stabilization, with stiff gains, or with scipy's solvers: then it depends on
the settings, but does not exceed the clearances."""
STIFF_GAIN = 1e3
"""Gain of Baumgarte's terms above which they are stiff, 1/s."""
REMEDY = (
    "lower solver.reference.tolerance; if that does not help, this is a fault of the model: please report it"
)
REMEDY_OF_SCIPY = (
    "lower solver.reference.tolerance, or set solver.reference.method = 'dop853': scipy's solvers may step "
    "over a short contact"
)

Worst = tuple[float, float, int]
"""Value, time (s), number of the contact (-1: none)."""


class Invariant(NamedTuple):
    """The worst value of one invariant in a run, and its bound."""

    value: float
    bound: float
    unit: str
    time_s: float
    place: str = ""
    """Name of the contact; empty if it concerns none."""


def check(
    p: Parameters, worst: dict[str, Worst], events: Records, drift: dict[str, float] | None
) -> dict[str, Invariant]:
    """Return all invariants that apply to a run, by name.

    `worst` is that of `Observation.worst`, where a missing name means zero; `events` are the `state.Event`
    of all contacts; `drift` is the largest violation of the constraints, None if there are none.
    """
    m, edge, scipy = p.mechanism, p.corners[0], p.method != "dop853"
    corner = 1.0 / m.m5 + (edge.x**2 + edge.y**2) / m.J5
    mobility = max(corner, 1.0 / m.m2 + m.Ls2**2 / m.J2)
    energy = ENERGY_BOUND * max(1.0, p.tolerance / USUAL_TOLERANCE)
    # The paper's surface contact has no potential; scipy's solvers do not control the error of the works.
    if scipy or any(each.law == PAPER_SWITCHING for each in p.contacts):
        energy = math.inf
    contacts, duration = dict(zip(p.contact_names, p.contacts, strict=True)), p.cycles * p.period
    invariants = check_contacts(contacts, worst, events, duration, p.tolerance, mobility, energy, scipy)
    if drift is not None:
        controlled = not scipy and min(p.alpha, p.beta) > 0.0 and max(p.alpha, p.beta) <= STIFF_GAIN
        limit = DRIFT if controlled else UNCONTROLLED_DRIFT
        for part, unit, bound in (("position", "m", limit), ("velocity", "m/s", limit / VELOCITY_TIME)):
            invariants[f"constraint-{part}"] = Invariant(drift[part], bound, unit, drift[f"{part}_time_s"])
    return invariants


def check_contacts(
    contacts: Mapping[str, Contact], worst: dict[str, Worst], events: Records, duration: float,
    tolerance: float, mobility: float, energy: float, scipy: bool = False,
) -> dict[str, Invariant]:  # fmt: skip
    """Return the invariants of contacts and of the energy, by name, as `check`.

    The run lasts `duration`, s; 1 N accelerates no place of contact by more than `mobility`, m/s^2; `energy`
    bounds the spurious energy, unless it is infinite.
    """
    zero, names, each_one = (0.0, 0.0, -1), [*contacts], contacts.values()
    # A step may hold the whole peak of a contact: its ends show less.
    force = max(worst.get("force", zero)[0], float(events["peak_force"].max(initial=0.0)))
    # A speed may exceed its limit at the end of a mode by the accuracy of the location, m/s, or by the
    # distance of LSODA's dense output from the ends of its steps.
    excess = 10.0 * (tolerance / VELOCITY_TIME if scipy else LOCATED_SPEED)
    # A contact is met too late by this depth, m: scipy's solvers locate it to their tolerance.
    depth = 10.0 * tolerance if scipy else LOCATED
    # Friction rises from zero at v0, so a slip beyond v0 gives a driving power.
    powers = [each.c_f * force * excess / (each.v1 - each.v0) * (each.v0 + excess) for each in each_one]
    pull = max((_pull(each, events, force, excess, depth) for each in each_one), default=0.0)
    friction_factor = 1.0 + max((each.c_f for each in each_one), default=0.0)
    acceleration = max(USUAL_ACCELERATION, friction_factor * force * mobility)
    later_events = events[events["start"] > 0.0]  # a contact that is closed at t = 0 may leave
    worst = worst | {
        "start-gap": _largest(np.abs(later_events["gap"]), later_events),
        "leaving-start": _largest(later_events["rate"], later_events),
    }
    bounds = {
        "open-depth": (max(1e-11, depth), "m"),
        "pull": (pull, "N"),
        "driving-friction": (max(powers, default=0.0), "W"),
        "start-gap": (max(1e-11, depth), "m"),
        "leaving-start": (np.sqrt(2.0 * acceleration * depth), "m/s"),
    }
    if energy < math.inf:
        bounds["energy"] = (energy, "1")
    invariants = {}
    for name, (bound, unit) in bounds.items():
        value, time, k = worst.get(name, zero)
        place = "" if value == 0.0 or k < 0 or name == "energy" else names[k]
        invariants[name] = Invariant(value, float(bound), unit, time, place)
    invariants["overlap"] = _overlap(contacts, events, duration)
    return invariants


def _pull(contact: Contact, events: Records, force: float, excess: float, depth: float) -> float:
    """Return the largest force below zero that a contact may have where its mode ends, N."""
    if contact.law == ADAMS_IMPACT:
        # The force changes within the located depth by its slopes: c, n K d^(n-1), c' d', c' < 1.5 c / d_max.
        d, v = (float(events[of].max(initial=0.0)) for of in ("largest_depth", "normal_speed"))
        slope = contact.n * contact.K * math.pow(d, contact.n - 1.0)
        return excess * contact.c_max + 10.0 * depth * (slope + 1.5 * contact.c_max / contact.d_max * v)
    # The share of the force by which the damping factor 1 + C d'/v is then below zero; v + C d' is located.
    pull = force * max(contact.C * excess, 10.0 * LOCATED_SPEED) / contact.speed_floor
    # The paper's surface contact lasts until a corner is located outside: Eq. 8.
    return pull + (0.5 * contact.Ks * depth if contact.law == PAPER_SWITCHING else 0.0)


def _largest(values: Array, events: Records) -> Worst:
    if not values.size or not values.max() > 0.0:
        return 0.0, 0.0, -1
    at = int(values.argmax())
    return float(values[at]), float(events["start"][at]), int(events["contact"][at])


def _overlap(contacts: Mapping[str, Contact], events: Records, duration: float) -> Invariant:
    """Return the longest overlap of contacts of one corner, or of one side, s."""
    number, sides = events["contact"], enumerate(contacts.values())
    places = np.array([min(k, each.other) if each.one_side else k for k, each in sides])
    place = places[number] if number.size else number
    order = np.lexsort((events["start"], place))
    start, end = events["start"][order], events["end"][order]
    overlaps = np.where(np.diff(place[order]) == 0, end[:-1] - start[1:], 0.0)
    # Times add up to the duration by rounding.
    bound = 4.0 * float(np.spacing(duration))
    if not overlaps.size or overlaps.max() <= 0.0:
        return Invariant(0.0, bound, "s", 0.0)
    worst = int(overlaps.argmax())
    name = [*contacts][int(number[order][1:][worst])]
    return Invariant(float(overlaps[worst]), bound, "s", float(start[1:][worst]), name)


def violation(invariants: dict[str, Invariant], method: str = "dop853") -> str:
    """Return one line with the violated invariant, its contact, time and size; empty if none is violated."""
    remedy = REMEDY if method == "dop853" else REMEDY_OF_SCIPY
    for name, it in invariants.items():
        if not it.value <= it.bound:
            where = f"{it.place} " if it.place else ""
            return (
                f"{name}: {where}{_TEXTS[name]}: {it.value:.2g} {it.unit} at t = {it.time_s:.6g} s, where at "
                f"most {it.bound:.2g} {it.unit} is rounding; {remedy}"
            )
    return ""
