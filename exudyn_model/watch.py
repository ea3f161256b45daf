"""Observed extremes of a run's contacts and energy, which ``invariants`` judges.

Every accepted state is examined. Gaps, rates and slips are computed here once more from the bodies' motion,
so that a fault in the formulas that the run was computed with does not conceal itself. The worst of each
contact is kept in its own record.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.channels import FRICTION, NORMAL, PER_CONTACT
from exudyn_model.compiled import kernel
from exudyn_model.contact.states import ACROSS, ALONG, CONTACTS, CORNERS, PIN
from exudyn_model.parameters import Parameters

_CORNERS = len(CORNERS)


@kernel
def watch_contact(
    time: float, gap: float, rate: float, slip: float, normal: float, friction: float, state: Any
) -> None:
    """Keep the worst violation of each invariant so far in the record of one contact.

    Parameters
    ----------
    time : float
        s.
    gap, rate, slip : float
        Gap (m), its rate and the slip (m/s).
    normal, friction : float
        The forces that go with this state, N; friction is counted in the slip's direction.
    state : record
        Of ``contact.states.contact_states``.
    """
    if state.impact_speed > 0.0:
        if state.start != state.known_start:
            # Those that begin at t = 0 may separate: a corner may start inside its wall
            state.known_start = state.start
            leaving = min(state.known_rate, rate)
            if leaving > state.leaving:
                state.leaving, state.leaving_time = leaving, time
    elif -gap > state.open_depth:
        state.open_depth, state.open_depth_time = -gap, time
    if -normal > state.pull:
        state.pull, state.pull_time = -normal, time
    if friction * slip > state.driving:
        state.driving, state.driving_time = friction * slip, time
    state.known_rate = rate
    state.fastest = max(state.fastest, abs(rate))
    state.fastest_slip = max(state.fastest_slip, abs(slip))
    state.strongest = max(state.strongest, normal)


@kernel
def watch_corners(
    time: float,
    x: float,
    angle: float,
    vx: float,
    vy: float,
    omega: float,
    values: NDArray[np.float64],
    law: Any,
    contacts: NDArray[np.void],
) -> None:
    """Watch the slider's corners.

    Parameters
    ----------
    time : float
        s.
    x, angle, vx, vy, omega : float
        Slider's x from the guide's centre line (m), angle (rad) and velocities.
    values : ndarray
        Of this state, in the order of ``channels.CHANNELS``; normal forces and friction are read.
    law : record
        From ``contact.gaps.contact_law``.
    contacts : ndarray, shape (5,)
        From ``contact.states``; changed in place.
    """
    cosine, sine = np.cos(angle), np.sin(angle)
    wall = law.half_width + law.clearance
    for number in range(_CORNERS):
        side, end = ACROSS[number], ALONG[number]
        along_x = side * law.half_width * cosine - end * law.half_length * sine
        along_y = side * law.half_width * sine + end * law.half_length * cosine
        watch_contact(
            time,
            wall - side * (x + along_x),
            -side * (vx - omega * along_y),
            vy + omega * along_x,
            values[NORMAL + PER_CONTACT * number],
            values[FRICTION + PER_CONTACT * number],
            contacts[number],
        )


class Eccentricity(NamedTuple):
    """Vector from the bearing's centre to the journal's (m), and its rate (m/s)."""

    x: float
    y: float
    vx: float
    vy: float


@kernel
def watch_pin(
    time: float,
    eccentricity: Eccentricity,
    w1: float,
    w2: float,
    normal: float,
    friction: float,
    law: Any,
    contacts: NDArray[np.void],
) -> None:
    """Watch the crank pin.

    Parameters
    ----------
    time : float
        s.
    eccentricity : Eccentricity
    w1, w2 : float
        Angular velocities of crank and rod 2, rad/s.
    normal, friction : float
        On rod 2, along the bearing's outward normal and along that rotated by +90 degrees, N.
    law : record
        From ``contact.journal.journal_law``.
    contacts : ndarray, shape (5,)
        From ``contact.states``; changed in place.
    """
    ex, ey, vx, vy = eccentricity
    distance = np.sqrt(ex * ex + ey * ey)
    nx, ny = (ex / distance, ey / distance) if distance > 0.0 else (1.0, 0.0)
    # Of the bearing's material against the journal's, in the point of the bearing's surface
    bearing = w2 * law.bearing_radius
    journal = nx * vy - ny * vx + w1 * (law.bearing_radius - distance)
    watch_contact(
        time,
        law.clearance - distance,
        -(nx * vx + ny * vy),
        bearing - journal,
        normal,
        friction,
        contacts[PIN],
    )


@dataclass(frozen=True)
class Seen:
    """The worst of one kind in a run: its value, when (s) and where."""

    name: str
    value: float
    time: float
    place: str = ""


def place_name(number: int) -> str:
    """Return the name of one of ``CONTACTS`` in a sentence."""
    return f"corner {CONTACTS[number]}" if number < len(CORNERS) else "the crank pin"


def seen_in_contacts(contacts: NDArray[np.void]) -> list[Seen]:
    """Return the worst of what is kept in the records of the contacts."""
    found = []
    for name, field in (
        ("open-depth", "open_depth"),
        ("pull", "pull"),
        ("driving-friction", "driving"),
        ("leaving-start", "leaving"),
    ):
        number = int(np.argmax(contacts[field]))
        worst = contacts[number]
        found.append(Seen(name, float(worst[field]), float(worst[f"{field}_time"]), place_name(number)))
    return found


def seen_in_events(events: Mapping[str, NDArray[Any]]) -> Seen:
    """Return the longest overlap of two contacts of one corner; the table is sorted by start."""
    worst = Seen("overlap", 0.0, 0.0)
    for number, name in enumerate(CONTACTS):
        chosen = events["corner"] == name
        start, end = events["start"][chosen], events["end"][chosen]
        if len(start) < 2:
            continue
        overlaps = np.maximum.accumulate(end)[:-1] - start[1:]
        row = int(np.argmax(overlaps))
        if overlaps[row] > worst.value:
            worst = Seen("overlap", float(overlaps[row]), float(start[row + 1]), place_name(number))
    return worst


def seen_in_energy(
    columns: Mapping[str, NDArray[np.float64]], extrema: Mapping[str, Mapping[str, float]]
) -> Seen:
    """Return the largest residual, over all that was dissipated and the largest kinetic energy."""
    residual = extrema["energy_residual"]
    side = "max" if residual["max"] > -residual["min"] else "min"
    base = extrema["energy_kinetic"]["max"]
    base += max(float(columns["energy_damping"][-1] + columns["energy_friction"][-1]), 0.0)
    return Seen("energy", abs(residual[side]) / base, residual[f"time_of_{side}"])


def seen_in_samples(
    columns: Mapping[str, NDArray[np.float64]], events: Mapping[str, NDArray[Any]], parameters: Parameters
) -> Seen:
    """Return the deepest corner at a sample that lies in no contact of the table.

    The state at t = 0 is not looked at: Exudyn's own contact begins with the first step.
    """
    slider, worst = parameters.mechanism.slider, Seen("open-depth", 0.0, 0.0)
    x, angle = (columns[name][1:] for name in ("slider_x", "slider_angle"))
    times = np.arange(1, len(x) + 1) * parameters.sample_interval
    earlier = times * (1.0 - 1e-12)  # those of the table are rounded
    for number, name in enumerate(CORNERS):
        side, end = ACROSS[number], ALONG[number]
        across = side * slider.width / 2 * np.cos(angle) - end * slider.length / 2 * np.sin(angle)
        place = side * (x - parameters.mechanism.guide_x + across)
        depths = place - slider.width / 2 - parameters.contact.clearance
        chosen = events["corner"] == name
        starts, ends = (np.append(-np.inf, events[column][chosen]) for column in ("start", "end"))
        depths[earlier <= ends[np.searchsorted(starts, times, side="right") - 1]] = 0.0
        row = int(np.argmax(depths)) if len(depths) else 0
        if len(depths) and depths[row] > worst.value:
            worst = Seen("open-depth", float(depths[row]), float(times[row]), place_name(number))
    return worst
