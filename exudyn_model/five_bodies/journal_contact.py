"""Contact of a journal with its bearing: its force in trial states, its update in accepted ones.

The journal's forces are of some kN and rod 2 is light: across the contact, friction changes its speed in a
step of 1e-6 s by several times the width of the ramp of Eq. 13. Newton's method then goes from full
friction of one direction to that of the other and back indefinitely. So the iteration keeps to one straight
piece of Eq. 13; where it converges outside of it, :func:`settle` goes to the next piece, and the iteration is
taken up again. A step is accepted where piece and slip fit: the force is that of Eqs. 12-13.
"""

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from exudyn_model.clearances import (
    JournalMotion,
    bearing_load,
    journal_forces,
    journal_motion,
    touches_at_start,
)
from exudyn_model.five_bodies.contact import (
    ANGLE,
    ContactArrays,
    ContactElement,
    Pair,
    Partners,
    Six,
    allowed_ticks,
    arm,
    of_bodies,
    relative,
    remember,
    speed_in_step,
    update_alone,
    zero_within,
)
from exudyn_model.invariants import Watch
from exudyn_model.kernels import entry, kernel, machine_code
from exudyn_model.laws import friction_in_regime, slip_regime

Array = NDArray[np.float64]


@kernel
def journal_in_bearing(q: Pair, v: Pair, bearing: Partners) -> JournalMotion:
    """Return the motion of a journal from those of its bodies."""
    ex, ey, vx, vy = relative(q, v, bearing)
    return journal_motion(ex, ey, vx, vy, v[0][ANGLE], v[1][ANGLE], bearing.law)


@kernel
def journal_loads(
    normal: float, friction: float, motion: JournalMotion, q: Pair, bearing: Partners
) -> tuple[float, float, float, float]:
    """Return the force on the bearing's body (N) and the moments on the journal's and on it (N m)."""
    bx, by = arm(q[1][ANGLE], bearing.second_x, bearing.second_y)
    gx, gy, moment2 = bearing_load(normal, friction, motion, bx, by, bearing.law)
    jx, jy = arm(q[0][ANGLE], bearing.first_x, bearing.first_y)
    radius = bearing.law.bearing_radius - motion.distance  # from the journal's centre to the surface
    px, py = jx + radius * motion.nx, jy + radius * motion.ny
    return gx, gy, py * gx - px * gy, moment2


@entry
def journal_force(q: Six, v: Six, arrays: ContactArrays) -> Six:
    """Return force and moment on the journal's body, then on the bearing's (N, N m).

    ``q`` and ``v`` are of the journal's body, then of the bearing's.
    """
    bearing, contact, pair = arrays.partners[0], arrays.contacts[0], (q[:3], q[3:])
    motion = journal_in_bearing(pair, (v[:3], v[3:]), bearing)
    speed = speed_in_step(contact, motion.gap, motion.rate, arrays.step[0], bearing.law)
    if speed == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    normal, _, _ = journal_forces(motion, speed, bearing.law)
    friction = friction_in_regime(normal, motion.slip, contact.regime, bearing.law)
    gx, gy, moment1, moment2 = journal_loads(normal, friction, motion, pair, bearing)
    return -gx, -gy, moment1, gx, gy, moment2


@entry
def settle(q: Array, v: Array, arrays: ContactArrays) -> bool:
    """Return whether the friction's piece fits the slip of a converged state; if not, take the next piece.

    One piece at a time: the force falls with the slip, so that the way from piece to piece has one direction.
    """
    bearing, contact = arrays.partners[0], arrays.contacts[0]
    motion = journal_in_bearing(of_bodies(q, bearing), of_bodies(v, bearing), bearing)
    piece = slip_regime(motion.slip, bearing.law)
    if motion.gap >= 0.0:  # no friction in any piece
        contact.regime = piece
    fits: bool = contact.regime == piece
    contact.regime += np.sign(piece - contact.regime)
    return fits


@entry
def follow_journal(time: float, q: Array, v: Array, longest: float, row: int, arrays: ContactArrays) -> float:
    """Take an accepted state of a journal, as ``slider_contact.follow_slider`` does of a slider."""
    bearing, contact, step, load = arrays.partners[0], arrays.contacts[0], arrays.step[0], arrays.load
    law, pair = bearing.law, of_bodies(q, bearing)
    motion = journal_in_bearing(pair, of_bodies(v, bearing), bearing)
    if time > 0.0:
        update_alone(time, step.length, row, motion.gap, motion.rate, contact, law)
    normal, elastic, friction = journal_forces(motion, contact.impact_speed, law)
    remember(contact, motion.gap, motion.rate, motion.slip, normal, friction)
    contact.stored = elastic * max(-motion.gap, 0.0) / (law.exponent + 1.0)
    contact.damping_power = -(normal - elastic) * motion.rate
    contact.friction_power = -friction * motion.slip
    gx, gy, moment1, moment2 = journal_loads(normal, friction, motion, pair, bearing)
    load[0], load[1], load[2] = -gx, -gy, moment1
    load[3], load[4], load[5] = gx, gy, moment2
    ticks = allowed_ticks(time, step, contact, arrays.last[0], law)
    # The friction reverses within a step: see the module
    return 1.0 if contact.closed > 0.0 else min(longest, ticks)


@entry
def journal_change(q: Array, v: Array, arrays: ContactArrays) -> float:
    """Return the fraction of a step after which the contact begins or ends; more than 1: it does not."""
    bearing = arrays.partners[0]
    motion = journal_in_bearing(of_bodies(q, bearing), of_bodies(v, bearing), bearing)
    return zero_within(arrays.contacts[0], motion.gap, motion.rate, arrays.step[0].length)


class JournalElement(ContactElement):
    """A journal in its bearing; ``row`` is that of its memory among all ``contacts``."""

    def __init__(self, bearing: Partners, row: int, contacts: NDArray[Any], step: NDArray[Any]) -> None:
        kernels = (journal_force, follow_journal, journal_change)
        super().__init__(bearing, slice(row, row + 1), contacts, step, kernels)
        self._settle = machine_code(settle, self._q, self._v, self._arrays)

    def start(self) -> None:
        """Begin the contact if it is closed at t = 0."""
        contact = self._arrays.contacts
        motion = cast(Any, journal_motion).py_func(*self._in_bearing(self._q, self._v), self.law)
        if touches_at_start(motion.gap, motion.rate):
            contact["impact_speed"] = max(-motion.rate, self.law.speed_floor)
            contact["name"] = self.rows.start
        contact["regime"] = cast(Any, slip_regime).py_func(motion.slip, self.law)

    def settled(self) -> bool:
        """Return whether the friction's piece fits the state to which Newton's method has converged."""
        return self._settle(self._q, self._v, self._arrays)

    def watch(self, watch: Watch, times: Array, q: Array, v: Array, forces: Array, memory: Array) -> None:
        """Watch states of all bodies, shape (3 n, states), with forces and memory of its row."""
        motion = self._in_bearing(q, v)
        watch.take_journal(self.rows.start, times, motion, forces[0], memory[0], self.law)

    def eccentricity(self, q: Array) -> Array:
        """Return e (m), shape (2, states), from coordinates of all bodies, shape (3 n, states)."""
        return self.motion(q, np.zeros_like(q))[:2]

    def _in_bearing(self, q: Array, v: Array) -> Array:
        """Return e (m), its rate (m/s) and both angular speeds (rad/s)."""
        return self.motion(q, v)[[0, 1, 2, 3, 6, 7]]
