"""Invariants of every correct run: values in each accepted state, bounds with reasons, and a judgement.

Gaps, rates and slips are computed here once more from the bodies' motion, so that a fault in the formulas of
the run does not conceal itself. The table of contacts, the audit of the energy, and the constraints
(``five_bodies.balance``) are judged, too.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.clearances import ACROSS, ALONG, CORNER_COUNT, CORNERS, UPPER
from exudyn_model.laws import SWITCHING, Law
from exudyn_model.parameters import Parameters
from exudyn_model.tables import LOAD, PIN, Contacts

Array = NDArray[np.float64]

WATCHED = ("open-depth", "pull", "driving-friction", "leaving-start", "start-gap")
SPEED, START = 0, 1  # Rows of a memory


class Watch:
    """Largest violations in a run's contacts.

    Each call takes n states, at times (s) of shape (n,); the first is the last one of the call before. The
    memory of a contact, shape (3, n), holds its impact speed (m/s), start (s) and name.

    Attributes
    ----------
    worst : dict
        Value, time (s), and row of the contact of each of ``WATCHED``.
    largest_rate, largest_slip, largest_force : float
        Of a gap (m/s), of a slip (m/s), of the normal forces (N).
    """

    def __init__(self) -> None:
        self.worst: dict[str, tuple[float, float, int]] = dict.fromkeys(WATCHED, (0.0, 0.0, 0))
        self.largest_rate, self.largest_slip, self.largest_force = 0.0, 0.0, 0.0

    def _keep(self, name: str, row: int, times: Array, values: Array) -> None:
        if values.size:
            at = int(np.argmax(values))
            if values[at] > self.worst[name][0]:
                self.worst[name] = float(values[at]), float(times[at]), row

    def _take(
        self,
        row: int,
        times: Array,
        gap: Array,
        rate: Array,
        slip: Array,
        force: Array,
        power: Array,
        closed: Array,
    ) -> None:
        """Take the states of one contact."""
        self._keep("open-depth", row, times, np.where(closed, 0.0, -gap))
        self._keep("pull", row, times, -force)
        self._keep("driving-friction", row, times, power)
        self.largest_rate = max(self.largest_rate, float(np.max(np.abs(rate))))
        self.largest_slip = max(self.largest_slip, float(np.max(np.abs(slip))))
        self.largest_force = max(self.largest_force, float(np.max(force)))

    def _take_starts(
        self, row: int, times: Array, gaps: Array, rates: Array, corner: Any, at: NDArray[np.int64]
    ) -> None:
        """Take the contacts that begin in the steps to states ``at``, by rows ``corner`` of gaps and rates.

        Contacts of t = 0 are left out: a corner may start inside its wall and separate.
        """
        leaving = np.minimum(rates[corner, at - 1], rates[corner, at])
        self._keep("leaving-start", row, times[at], leaving)
        distance = np.minimum(np.abs(gaps[corner, at - 1]), np.abs(gaps[corner, at]))
        self._keep("start-gap", row, times[at], distance)

    def take_slider(
        self, first: int, times: Array, motion: Array, forces: Array, memory: Array, law: Law
    ) -> None:
        """Take states of a slider; ``first`` is the row of its first corner.

        Parameters
        ----------
        motion : ndarray, shape (5, n)
            x, angle, vx, vy, omega in the guide's frame: x across it from its centre line (m, rad, s).
        forces : ndarray, shape (4, 2, n)
            Normal force and friction of each corner, N; likewise ``memory``, shape (4, 3, n).
        """
        x, angle, vx, vy, omega = motion
        cosine, sine = np.cos(angle), np.sin(angle)
        wall, shared = law.half_width + law.clearance, bool(law.shared)
        gaps, rates, slips = np.empty((3, CORNER_COUNT, len(times)))
        for number in range(CORNER_COUNT):
            side, end = ACROSS[number], ALONG[number]
            arm_x = side * law.half_width * cosine - end * law.half_length * sine
            arm_y = side * law.half_width * sine + end * law.half_length * cosine
            gaps[number] = wall - side * (x + arm_x)
            rates[number], slips[number] = -side * (vx - omega * arm_y), vy + omega * arm_x
        powers, closed = forces[:, 1] * slips, memory[:, SPEED] > 0.0
        if shared:
            # The side has one friction, at its resultant: that of one corner alone may drive
            powers = powers + np.roll(powers, UPPER, axis=0)
            closed = closed | np.roll(closed, UPPER, axis=0)
        for number in range(CORNER_COUNT):
            states = first + number, times, gaps[number], rates[number], slips[number]
            self._take(*states, forces[number, 0], powers[number], closed[number])
            speed, start, name = memory[number]
            at = np.flatnonzero((speed[1:] > 0.0) & (start[1:] != start[:-1])) + 1
            # The contact of a side is judged by the corner that it is named after
            corner = name[at].astype(int) - first
            self._take_starts(first + number, times, gaps, rates, corner, at)

    def take_journal(
        self, row: int, times: Array, motion: Array, forces: Array, memory: Array, law: Law
    ) -> None:
        """Take states of a journal.

        Parameters
        ----------
        motion : ndarray, shape (6, n)
            e from the bearing's centre to the journal's (m), its rate (m/s), both angular speeds (rad/s).
        forces : ndarray, shape (2, n)
            Normal force on the bearing's body along e and friction on the journal across it, N.
        """
        ex, ey, vx, vy, w1, w2 = motion
        distance = np.sqrt(ex * ex + ey * ey)
        with np.errstate(invalid="ignore"):
            nx, ny = np.where(distance > 0.0, [ex / distance, ey / distance], [[1.0], [0.0]])
        # Speeds of both materials at the bearing's surface, along n rotated by +90 degrees
        journal_speed = nx * vy - ny * vx + w1 * (law.bearing_radius - distance)
        slip = journal_speed - w2 * law.bearing_radius
        gap, rate = law.clearance - distance, -(nx * vx + ny * vy)
        closed = memory[SPEED] > 0.0
        self._take(row, times, gap, rate, slip, forces[0], forces[1] * slip, closed)
        at = np.flatnonzero((memory[SPEED, 1:] > 0.0) & (memory[START, 1:] != memory[START, :-1])) + 1
        self._take_starts(row, times, gap[None], rate[None], 0, at)


# Unit of each invariant, and the sentence of its violation
_VIOLATIONS = {
    "open-depth": ("m", "{place} is inside its wall outside a contact"),
    "pull": ("N", "the wall pulls {place}"),
    "driving-friction": ("W", "friction drives {place}"),
    "leaving-start": ("m/s", "a contact of {place} begins while it leaves"),
    "start-gap": ("m", "a contact of {place} begins away from its wall"),
    "overlap": ("s", "two contacts of {place} overlap"),
    "energy": ("1", "the energy does not balance"),
    "constraint-position": ("m", "{place} is violated"),
    "constraint-velocity": ("m/s", "the rate of {place} is violated"),
}

# m: with index 3 the Newton iteration also ends at 1e-8 of the residual that it begins with. Measured in the
# paper's case, whatever the tolerance below this: 1.5e-12 m
_RELATIVE_END = 1e-12


def judge_run(
    parameters: Parameters,
    watch: Watch,
    contacts: Contacts,
    events: Mapping[str, NDArray[Any]],
    columns: Mapping[str, Array],
    extrema: Mapping[str, Mapping[str, float]],
    constraints: Mapping[str, tuple[float, float]],
    settings: Mapping[str, float],
) -> tuple[dict[str, dict[str, Any]], str]:
    """Compare the largest violations of a run with their bounds.

    Parameters
    ----------
    parameters : Parameters
    watch : Watch
    contacts : Contacts
    events, columns, extrema : mapping
        As in ``simulation.Result``.
    constraints : mapping
        Largest violation of "position" (m, rad) and "velocity" (m/s, rad/s), with time (s); none in a tree.
    settings : mapping
        Those of five bodies contain "step_used" and "longest_step" (s), and "newton_tolerance".

    Returns
    -------
    invariants : dict
        Name to "value", "bound", "unit" and "time_s" of each invariant that has a bound.
    violation : str
        The worst one in one line; empty if there is none.
    """
    worst = contact_violations(watch, contacts, events)
    worst |= {f"constraint-{name}": (*violation, "a constraint") for name, violation in constraints.items()}
    switches = parameters.guide is not None and parameters.guide.number == SWITCHING
    if parameters.integration.energy and not switches:
        worst["energy"] = _energy(columns, extrema)
    return judge(worst, _bounds(parameters, watch, events, settings))


def contact_violations(
    watch: Watch, contacts: Contacts, events: Mapping[str, NDArray[Any]]
) -> dict[str, tuple[float, float, str]]:
    """Return the worst violation (value, time in s, place) of each invariant of the contacts."""
    worst = {
        name: (value, time, _place(contacts.names[row]) if contacts.names else "")
        for name, (value, time, row) in watch.worst.items()
    }
    return worst | {"overlap": _overlap(contacts, events)}


def judge(
    worst: Mapping[str, tuple[float, float, str]], bounds: Mapping[str, float]
) -> tuple[dict[str, dict[str, Any]], str]:
    """Compare violations (value, time in s, place) with their bounds; return as :func:`judge_run`."""
    invariants: dict[str, dict[str, Any]] = {}
    largest, violation = 1.0, ""
    for name, limit in bounds.items():
        if name not in worst:
            continue
        (value, time, place), (unit, sentence) = worst[name], _VIOLATIONS[name]
        invariants[name] = {"value": value, "bound": limit, "unit": unit, "time_s": time}
        excess = value / limit if limit > 0.0 else math.inf
        if value > limit and excess > largest:
            largest, measure = excess, "" if unit == "1" else f" {unit}"
            violation = (
                f"{name}: {sentence.format(place=place)} by {value:.3g}{measure} at "
                f"{time:.9g} s, bound {limit:.3g}{measure}"
            )
    return invariants, violation


def contact_bounds(watch: Watch, duration: float, step: float, rounding: float) -> dict[str, float]:
    """Return the bounds of contacts in implicit steps.

    ``step`` (s) is that in contacts, and ``rounding`` (m) some roundings of the positions.
    """
    return _force_bounds(watch, duration) | {
        # A corner that touches inside a step is no deeper at its end, where its contact begins
        "open-depth": watch.largest_rate * step,
        "start-gap": watch.largest_rate * step,
        # A gap that falls below 0 in a step approaches at its start or at its end, to the Newton
        # iteration's error in positions over the step
        "leaving-start": rounding / step,
    }


def squared_share(events: Mapping[str, NDArray[Any]], step: float) -> float:
    """Return the mean square of a step's (s) share of a contact, weighted by impulse.

    A long rest must not hide coarse steps in short impacts.
    """
    impulse = np.asarray(events["impulse"], dtype=float)
    shares = step / np.maximum(events["end"] - events["start"], step)
    return float(impulse @ shares**2) / float(impulse.sum()) if impulse.sum() > 0.0 else 0.0


def _force_bounds(watch: Watch, duration: float) -> dict[str, float]:
    return {
        # The law is clipped at 0: a product and a sum are rounded
        "pull": 1e-13 * watch.largest_force,
        # Friction opposes the slip, whose sign is wrong only where it is rounded
        "driving-friction": 1e-13 * watch.largest_force * watch.largest_slip,
        # A contact ends before the next one begins, both times rounded
        "overlap": 64 * math.ulp(duration),
    }


def _bounds(
    parameters: Parameters, watch: Watch, events: Mapping[str, NDArray[Any]], settings: Mapping[str, float]
) -> dict[str, float]:
    """Return the bound of each invariant that applies to the run."""
    if "step_used" not in settings:
        return _force_bounds(watch, parameters.duration) | {
            # Touches are located until the gap is less than 2e-15 m; the rest is round-off
            "open-depth": 1e-11,
            "start-gap": 1e-11,
            # A located corner approaches. One whose contact has just ended may be pressed back, by some
            # 1e4 m/s^2, before it is 2e-15 m away: the root of twice their product
            "leaving-start": 1e-5,
        }
    step, longest, tolerance = (settings[name] for name in ("step_used", "longest_step", "newton_tolerance"))
    # Positions are rounded to some 1e-15 m, and a rate to that over the step
    limits = contact_bounds(watch, parameters.duration, step, 1e-13)
    omega = parameters.mechanism.omega
    squared = (omega * longest) ** 2
    if parameters.integration.method == "trapezoidal-index2":
        # The friction of a journal reverses within a step: measured 4e-6
        order = 1e-6 if parameters.journal is None else 1e-4
        return limits | {
            # The trapezoidal rule's error of second order in the step's share of a contact
            "energy": order + 10 * squared_share(events, step) + squared,
            # Part of the residual of the Newton iteration, of which the norm is a mean over up to 30 rows
            "constraint-velocity": 10.0 * tolerance,
            # Positions are not enforced: their error is of second order in the step
            "constraint-position": 1e-7 + 10 * squared * (1 + parameters.cycles),
        }
    crank_speed = abs(omega) * parameters.mechanism.crank.length
    return limits | {
        "constraint-position": 10.0 * max(tolerance, _RELATIVE_END),
        "constraint-velocity": crank_speed * (1e-4 + 10 * squared) + limits["leaving-start"],
    }


def _place(name: str) -> str:
    kind = "corner" if name in CORNERS or "." in name else "pin"
    return "the crank pin" if name == PIN else f"{kind} {name}"


def _overlap(contacts: Contacts, events: Mapping[str, NDArray[Any]]) -> tuple[float, float, str]:
    """Return the longest overlap of two contacts of one corner or side; the table is sorted by start."""
    worst = 0.0, 0.0, ""
    for number, name in enumerate(contacts.names):
        mask = np.isin(events["corner"], contacts.names_of_row(number))
        start, end = events["start"][mask], events["end"][mask]
        if len(start) < 2:
            continue
        overlaps = np.maximum.accumulate(end)[:-1] - start[1:]
        row = int(np.argmax(overlaps))
        if overlaps[row] > worst[0]:
            worst = float(overlaps[row]), float(start[row + 1]), _place(name)
    return worst


def _energy(
    columns: Mapping[str, Array], extrema: Mapping[str, Mapping[str, float]]
) -> tuple[float, float, str]:
    """Return the largest residual over the sum of dissipation and the largest energies of motion and load."""
    residual = extrema["energy_residual"]
    side = "max" if residual["max"] > -residual["min"] else "min"
    base = extrema["energy_kinetic"]["max"]
    if LOAD in extrema:
        base += extrema[LOAD]["max"]
    base += max(float(columns["energy_damping"][-1] + columns["energy_friction"][-1]), 0.0)
    return abs(residual[side]) / base, residual[f"time_of_{side}"], ""
