"""The contacts of a linkage as Exudyn and the recorder see them: forces in trial states, accepted states.

Each reads of the step in progress what ``step_choice`` enters in an array that they share.
"""

from collections.abc import Callable
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from exudyn_model.columns import (
    IMPACT_SPEED,
    NAME,
    REGIME,
    SPEED_FLOOR,
)
from exudyn_model.corners import CORNER_COUNT, UPPER, corner_load, corner_motion
from exudyn_model.five_bodies import following
from exudyn_model.five_bodies.contact_forces import (
    PER_BODY,
    in_guide,
    journal_force,
    settle,
    slider_force,
)
from exudyn_model.invariants import Watch
from exudyn_model.journal import journal_motion
from exudyn_model.kernels import machine_code
from exudyn_model.laws import slip_regime
from exudyn_model.memory import start_side

Array = NDArray[np.float64]
# (mbs, t, object number, coordinates, velocities) -> generalized forces
ForceUserFunction = Callable[[Any, float, int, list[float], list[float]], tuple[float, ...]]


class SliderPart:
    """A slider in its guide.

    Parameters
    ----------
    body : int
    first : int
        Row of its first corner among all contacts.
    law : ndarray
    contacts : ndarray, shape (n, columns)
        Memory of all contacts.
    step : ndarray, shape (2,)

    Attributes
    ----------
    bodies : tuple of int
        On which it acts.
    rows : slice
        Of the memory of all contacts.
    force : callable
        Exudyn's ``forceUserFunction`` on their nodes.
    load : ndarray, shape (3,)
        On the bodies' coordinates in the last accepted state (N, N m).
    """

    def __init__(self, body: int, first: int, law: Array, contacts: Array, step: Array) -> None:
        self.bodies, self.rows, self.law = (body,), slice(first, first + CORNER_COUNT), law
        self.load = np.zeros(PER_BODY)
        self._contacts, self._step = contacts[self.rows], step
        self._q, self._v = np.zeros((2, PER_BODY))
        last = np.zeros((CORNER_COUNT, following.BEFORE_COLUMNS))
        self._state = step, law, self._contacts
        self._fixed = first, law, self._contacts, last, self.load
        vectors = self._q, self._v
        self.force = self._user_function()
        self._change = machine_code(following.slider_change, *vectors, *self._state)
        self._follow = machine_code(following.follow_slider, 0.0, step, *vectors, 0.0, *self._fixed)

    def _user_function(self) -> ForceUserFunction:
        force, state = machine_code(slider_force, *(0.0,) * 6, *self._state), self._state

        def user_function(
            _mbs: Any, _t: float, _number: int, q: list[float], v: list[float]
        ) -> tuple[float, ...]:
            # Exudyn passes lists, which numba would copy element by element: scalars are 7 us faster a call
            (x, y, angle), (vx, vy, omega) = q, v
            return force(x, y, angle, vx, vy, omega, *state)

        return user_function

    def attach(self, q: Array, v: Array) -> None:
        """Take the states to come from these vectors of all bodies, shape (3 n,)."""
        own = slice(PER_BODY * self.bodies[0], PER_BODY * self.bodies[0] + PER_BODY)
        self._q, self._v = q[own], v[own]

    def start(self) -> None:
        """Begin what is in contact at t = 0."""
        x, angle, vx, vy, omega = self._in_guide(self._q, self._v)
        motion = cast(Any, corner_motion).py_func  # not compiled for four calls
        corners = [motion(k, x, angle, vx, vy, omega, self.law) for k in range(CORNER_COUNT)]
        for side in range(UPPER):
            start_side(side, corners[side], corners[side + UPPER], self._contacts, self.law)
        self._contacts[:, NAME] += self.rows.start

    def follow(self, time: float, longest: float) -> float:
        """Take the accepted state at ``time`` (s): see ``following.follow_slider``."""
        return self._follow(time, self._step, self._q, self._v, longest, *self._fixed)

    def change(self) -> float:
        """Return the fraction of the step after which a contact begins or ends; more than 1: none does."""
        return self._change(self._q, self._v, *self._state)

    def watch(self, watch: Watch, times: Array, q: Array, v: Array, forces: Array, memory: Array) -> None:
        """Watch states of all bodies, shape (3 n, states), with forces and memory of its rows."""
        own = slice(PER_BODY * self.bodies[0], PER_BODY * self.bodies[0] + PER_BODY)
        motion = np.array(self._in_guide(q[own], v[own]))
        watch.take_slider(self.rows.start, times, motion, forces, memory, self.law)

    def gaps_and_moment(self, q: Array, normals: Array, frictions: Array) -> tuple[Array, Array]:
        """Return the corners' gaps (m), shape (4, states), and the moment (N m) of forces at them (N)."""
        gaps, moment, motion = [], np.zeros(q.shape[1]), cast(Any, corner_motion).py_func
        x, angle, *_ = self._in_guide(q, np.zeros_like(q))
        for k in range(CORNER_COUNT):
            corner = motion(k, x, angle, 0.0, 0.0, 0.0, self.law)
            gaps.append(corner.gap)
            moment += cast(Any, corner_load).py_func(k, normals[k], frictions[k], corner)[2]
        return np.array(gaps), moment

    def _in_guide(self, q: Array, v: Array) -> tuple[Any, ...]:
        """Return x, angle, vx, vy, omega in the guide's frame from the slider's coordinates."""
        motion: tuple[Any, ...] = cast(Any, in_guide).py_func(q, v, self.law)
        return motion


class JournalPart:
    """A journal in its bearing: parameters and attributes as of :class:`SliderPart`.

    ``ends``, shape (8,): body of the journal, its centre there, body of the bearing, its centre there (m);
    what the first body's coordinates count from, less what the second's do (m).
    """

    def __init__(self, ends: Array, row: int, law: Array, contacts: Array, step: Array) -> None:
        self.bodies, self.rows, self.law = (int(ends[0]), int(ends[3])), slice(row, row + 1), law
        self.load = np.zeros(2 * PER_BODY)
        self._ends, self._contact, self._step = ends, contacts[row], step
        self._q, self._v = np.zeros((2, PER_BODY))
        self._fixed = row, ends, law, self._contact, np.zeros(following.BEFORE_COLUMNS), self.load
        vectors, known = (self._q, self._v), (ends, law, self._contact)
        self._state = step, *known
        self.force = self._user_function()
        self._change = machine_code(following.journal_change, *vectors, *self._state)
        self._settle, self._known = machine_code(settle, *vectors, *known), known
        self._follow = machine_code(following.follow_journal, 0.0, step, *vectors, 0.0, *self._fixed)

    def _user_function(self) -> ForceUserFunction:
        force = machine_code(journal_force, *((0.0,) * PER_BODY,) * 4, *self._state)
        state = self._state

        def user_function(
            _mbs: Any, _t: float, _number: int, q: list[float], v: list[float]
        ) -> tuple[float, ...]:
            (x1, y1, angle1, x2, y2, angle2), (vx1, vy1, w1, vx2, vy2, w2) = q, v
            return force((x1, y1, angle1), (x2, y2, angle2), (vx1, vy1, w1), (vx2, vy2, w2), *state)

        return user_function

    def attach(self, q: Array, v: Array) -> None:
        """Take the states to come from these vectors of all bodies, shape (3 n,)."""
        self._q, self._v = q, v

    def start(self) -> None:
        """Begin what is in contact at t = 0."""
        motion = cast(Any, journal_motion).py_func(*self._eccentricity(self._q, self._v), self.law)
        if motion.gap < 0.0:
            self._contact[[IMPACT_SPEED, NAME]] = max(-motion.rate, self.law[SPEED_FLOOR]), self.rows.start
        self._contact[REGIME] = cast(Any, slip_regime).py_func(motion.slip, self.law)

    def follow(self, time: float, longest: float) -> float:
        """Take the accepted state at ``time`` (s): see ``following.follow_journal``."""
        return self._follow(time, self._step, self._q, self._v, longest, *self._fixed)

    def change(self) -> float:
        """Return the fraction of the step after which the contact begins or ends; more than 1: none."""
        return self._change(self._q, self._v, *self._state)

    def settled(self) -> bool:
        """Whether the friction's piece fits the state that Newton's method has come to."""
        return self._settle(self._q, self._v, *self._known)

    def watch(self, watch: Watch, times: Array, q: Array, v: Array, forces: Array, memory: Array) -> None:
        """Watch states of all bodies, shape (3 n, states), with forces and memory of its row."""
        motion = self._eccentricity(q, v)
        watch.take_journal(self.rows.start, times, motion, forces[0], memory[0], self.law)

    def eccentricity(self, q: Array) -> Array:
        """Return e (m), shape (2, states), from coordinates of all bodies, shape (3 n, states)."""
        return self._eccentricity(q, np.zeros_like(q))[:2]

    def _eccentricity(self, q: Array, v: Array) -> Array:
        """Return e (m), its rate (m/s) and both angular speeds (rad/s)."""
        ends, motions = self._ends, []
        for end, body in enumerate(self.bodies):
            own = slice(PER_BODY * body, PER_BODY * body + PER_BODY)
            (x, y, angle), (vx, vy, w) = q[own], v[own]
            # Points of the plane as complex numbers
            arm = complex(ends[3 * end + 1], ends[3 * end + 2]) * np.exp(1j * angle)
            motions.append((x + 1j * y + arm, vx + 1j * vy + 1j * w * arm, w))
        (place1, rate1, w1), (place2, rate2, w2) = motions
        apart, rate = place1 - place2 + complex(ends[6], ends[7]), rate1 - rate2
        return np.array([apart.real, apart.imag, rate.real, rate.imag, w1, w2])


Part = SliderPart | JournalPart
