"""All channels in one accepted state of five bodies; the contacts' memory is updated with it."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model import channels
from exudyn_model.accelerations import Forces, slider_acceleration
from exudyn_model.bodies import (
    CRANK_ANGLE,
    CRANK_X,
    CRANK_Y,
    ROD2_ANGLE,
    ROD2_X,
    ROD2_Y,
    SLIDER_ANGLE,
    SLIDER_X,
    SLIDER_Y,
)
from exudyn_model.channels import (
    ADDED,
    ENERGIES,
    FRICTION,
    GAP,
    NORMAL,
    PER_CONTACT,
    SLIDER_ALPHA,
    SLIDER_AX,
    SLIDER_AY,
    SLIDER_OMEGA,
    SLIDER_VX,
    SLIDER_VY,
)
from exudyn_model.compiled import kernel
from exudyn_model.constants import Constants
from exudyn_model.contact.memory import update_corners, update_pin
from exudyn_model.contact.states import CORNERS, PIN
from exudyn_model.energy import audit_energy
from exudyn_model.five_bodies.native_contact import update_native_corners
from exudyn_model.free_rocker import slider_acceleration_with_pin_clearance
from exudyn_model.pulses import note_corners
from exudyn_model.tables import Extrema, update_extrema, update_turning_points
from exudyn_model.watch import Eccentricity, watch_corners, watch_pin

_CORNERS, _ENERGIES = len(CORNERS), len(ENERGIES)


class Vectors(NamedTuple):
    """Views of the state in Exudyn's own memory.

    Attributes
    ----------
    q, v : ndarray, shape (15,)
        Coordinates and their rates, the slider's x from the guide's centre line.
    multipliers : ndarray, shape (n,)
        In the order of ``Model.multipliers``.
    drive : int
        Place of the motor among them.
    """

    q: NDArray[np.float64]
    v: NDArray[np.float64]
    multipliers: NDArray[np.float64]
    drive: int


class Kept(NamedTuple):
    """Arrays that an observation fills.

    Attributes
    ----------
    values : ndarray, shape (channels,)
        ``channels.CHANNELS``; the multipliers; the contact force at joint A, where its pin has clearance; the
        energies, where they are asked for.
    extrema : Extrema
        From ``tables.new_extrema``.
    audit : ndarray, shape (1,)
        From ``energy.new_audit``.
    masses : ndarray, shape (15,) or (0,)
        From ``energy.mass_diagonal``; empty where no energies are asked for.
    pulses : ndarray, shape (4, samples, 2)
        From ``pulses.new_pulses``.
    """

    values: NDArray[np.float64]
    extrema: Extrema
    audit: NDArray[np.void]
    masses: NDArray[np.float64]
    pulses: NDArray[np.float64]


@kernel
def observe(
    vectors: Vectors,
    kept: Kept,
    constants: Constants,
    contacts: NDArray[np.void],
    time: float,
    native: NDArray[np.float64],
    events: NDArray[np.void],
    event_count: int,
) -> int:
    """Update the contacts' memory, fill the values of all channels, update their extrema.

    Parameters
    ----------
    vectors : Vectors
    kept : Kept
    constants : Constants
    contacts : ndarray, shape (5,)
        Changed in place.
    time : float
        s.
    native : ndarray, shape (4, 4) or (0, 4)
        What ``native_contact`` reads of the corners; empty where the contact is the user function.
    events : ndarray, shape (n,)
        With room for a row of each contact from ``event_count`` on.
    event_count : int

    Returns
    -------
    event_count : int
    """
    q, v, multipliers, values = vectors.q, vectors.v, vectors.multipliers, kept.values
    linkage, law, pin_law = constants.linkage[0], constants.law, constants.pin_law
    before = values[:GAP].copy()
    fx, fy, moment = 0.0, 0.0, 0.0
    if len(native) > 0:
        event_count, fx, fy, moment = update_native_corners(
            time, q[SLIDER_X:], v[SLIDER_X:], native, law, contacts, events, event_count
        )
    elif not linkage.ideal_slider:
        event_count, fx, fy, moment = update_corners(
            time, q[SLIDER_X:], v[SLIDER_X:], law, contacts, events, event_count
        )
    note_corners(time, contacts, law[0], kept.pulses)
    values[channels.SLIDER_X] = linkage.guide_x + q[SLIDER_X]
    values[channels.SLIDER_Y], values[channels.SLIDER_ANGLE] = q[SLIDER_Y], q[SLIDER_ANGLE]
    values[SLIDER_VX], values[SLIDER_VY] = v[SLIDER_X], v[SLIDER_Y]
    values[SLIDER_OMEGA] = v[SLIDER_ANGLE]
    if linkage.ideal_pin:
        ax, ay, alpha = slider_acceleration(q, v, fx, fy, moment, linkage)
    else:
        event_count, pin_x, pin_y, pin_moment = update_pin(time, q, v, pin_law, contacts, events, event_count)
        forces = Forces(fx, fy, moment, pin_x, pin_y, pin_moment)
        ax, ay, alpha = slider_acceleration_with_pin_clearance(q, v, forces, linkage)
        reaction = ADDED + len(multipliers)
        values[reaction], values[reaction + 1] = pin_x, pin_y
        _watch_pin(time, q, v, pin_law[0], contacts)
    values[SLIDER_AX], values[SLIDER_AY], values[SLIDER_ALPHA] = ax, ay, alpha
    for number in range(_CORNERS):
        values[GAP + PER_CONTACT * number] = contacts[number].gap
        values[NORMAL + PER_CONTACT * number] = contacts[number].normal
        values[FRICTION + PER_CONTACT * number] = contacts[number].friction
    # Exudyn's own contact begins with the first step, whatever is closed before
    if not linkage.ideal_slider and (time > 0.0 or len(native) == 0):
        watch_corners(
            time,
            q[SLIDER_X],
            q[SLIDER_ANGLE],
            v[SLIDER_X],
            v[SLIDER_Y],
            v[SLIDER_ANGLE],
            values,
            law[0],
            contacts,
        )
    for row in range(len(multipliers)):
        values[ADDED + row] = -multipliers[row]
    if len(kept.masses) > 0:
        torque, energies = -multipliers[vectors.drive], values[len(values) - _ENERGIES :]
        audit_energy(time, q, v, torque, kept.masses, constants, contacts, kept.audit[0], energies)
    update_extrema(kept.extrema, values, time)
    if law[0].stays_open > 0.0:  # longer than a tick
        update_turning_points(kept.extrema, before, values, law[0].step, time)
    return event_count


@kernel
def _watch_pin(
    time: float, q: NDArray[np.float64], v: NDArray[np.float64], law: Any, contacts: NDArray[np.void]
) -> None:
    """Watch the crank pin from the coordinates of all bodies: see ``watch``."""
    x1, y1 = law.crank_to_tip * np.cos(q[CRANK_ANGLE]), law.crank_to_tip * np.sin(q[CRANK_ANGLE])
    x2, y2 = law.rod2_centroid * np.cos(q[ROD2_ANGLE]), law.rod2_centroid * np.sin(q[ROD2_ANGLE])
    w1, w2 = v[CRANK_ANGLE], v[ROD2_ANGLE]
    eccentricity = Eccentricity(
        q[CRANK_X] + x1 - q[ROD2_X] + x2,
        q[CRANK_Y] + y1 - q[ROD2_Y] + y2,
        v[CRANK_X] - w1 * y1 - v[ROD2_X] - w2 * y2,
        v[CRANK_Y] + w1 * x1 - v[ROD2_Y] + w2 * x2,
    )
    state = contacts[PIN]
    watch_pin(time, eccentricity, w1, w2, state.normal, state.friction, law, contacts)
