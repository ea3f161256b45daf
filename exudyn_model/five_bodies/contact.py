"""Contacts of five bodies: impact speed in a trial state, update of the memory, and foresight.

Exudyn advances the bodies in implicit steps and calls a force at trial states of the step's end. In the
shortest step (``settings``), inside of which alone a contact may begin or end:

- A contact in progress at the step's start keeps its frozen speed.
- One that was open and is closed in the trial state gets the speed at the instant of touch between the two,
  by :func:`touch`. The update of the memory applies the same function to the accepted state, so the speed
  that is frozen is the one that the step itself was solved with: no jump, and second order is kept.

In a longer step a contact that was open at its start stays without force.

Memory: an impact speed is frozen or cleared by :func:`update_alone` and ``slider_contact.update_side``
alone, from accepted states (the last one is still in the memory), never from trial states of the iteration.

Foresight, for ``settings``: zeros of gaps and kinks of friction (Eq. 13) from the latest rates; ticks that
resolve the oscillation of a normal force; touches and separations in a step, by the gaps' cubic Hermite
interpolants.

Arguments of the kernels here and in ``slider_contact`` and ``journal_contact``: ``step``, of ``STEP``, or its
length (s); ``contact``, the memory at the step's start (``low``, ``up``: of both corners of a side);
``last``, of ``BEFORE``; ``q``, ``v``, coordinates and rates (m, rad, s) of all bodies or of a contact's.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.clearances import Memory
from exudyn_model.kernels import kernel, machine_code, record
from exudyn_model.laws import FOUNDATION, Law

Array = NDArray[np.float64]
Triple = tuple[float, float, float]
# Of the first body, then of the second
Pair = tuple[Triple, Triple]
Six = tuple[float, float, float, float, float, float]
AT_REST = (0.0, 0.0, 0.0)
# (mbs, t, object number, coordinates, velocities) -> generalized forces
ForceUserFunction = Callable[[Any, float, int, list[float], list[float]], tuple[float, ...]]

# Numbers of the coordinates of one body: its centre (m), and its angle (rad)
X, Y, ANGLE = range(3)
PER_BODY = 3
FRAME = -1
STEP = np.dtype([("length", float), ("tick", float)])
"""Step in progress: its length and that of a tick, s."""
_BEFORE = ("rate", "slip", "normal", "normal_rate", "curvature", "largest_curvature", "step")
BEFORE = np.dtype([(name, float) for name in _BEFORE])
"""A contact in the last state: rate of its gap, slip, normal force and its rate, second derivative of the
normal force and its decaying maximum, and the length of the step that led there."""

# Share of the time to a foreseen zero that a step may cover
FORESEEN_SHARE = 0.5
# The oscillation of a normal force, relative to its mean, at which steps in a contact begin to grow
RIPPLE = 1.0
# Decay of the observed second derivative of a normal force, over the phase of its oscillation (rad): that
# passes through zero twice a period
_DECAY = 0.25
NEVER = 2.0
"""Stands for the fraction of a step at which an event lies, where there is none."""


class Partners(NamedTuple):
    """A journal's body and its bearing's, or a slider and the body of its guide; either may be `FRAME`."""

    # Points in body coordinates, m: centres of journal and bearing; of the slider, and on the guide's line
    first: float
    first_x: float
    first_y: float
    second: float
    second_x: float
    second_y: float
    # Origin of the first body's coordinates less that of the second's, m
    apart_x: float
    apart_y: float
    law: Law


class ContactArrays(NamedTuple):
    """Arrays of a contact that its kernels read and fill; ``step`` and ``partners`` have shape (1,)."""

    step: NDArray[Any]  # Of ``STEP``
    partners: NDArray[Any]
    contacts: NDArray[Any]  # Memory of its rows
    last: NDArray[Any]  # Of its rows, of ``BEFORE``
    load: Array  # fx, fy, moment (N, N m) on the first body, then the second, in the last accepted state


@kernel
def arm(angle: float, along: float, across: float) -> tuple[float, float]:
    """Return x and y of a vector of a body's frame, at its angle (rad)."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return cosine * along - sine * across, sine * along + cosine * across


@kernel
def of_bodies(values: Array, partners: Partners) -> Pair:
    """Return x, y, angle of both bodies, or their rates, from those of all bodies."""
    i, j = PER_BODY * int(partners.first), PER_BODY * int(partners.second)
    first = (values[i], values[i + 1], values[i + 2]) if i >= 0 else AT_REST
    return first, (values[j], values[j + 1], values[j + 2]) if j >= 0 else AT_REST


@kernel
def relative(q: Pair, v: Pair, partners: Partners) -> tuple[float, float, float, float]:
    """Return the vector from the second body's point to the first's (m), and its rate (m/s)."""
    (q1, q2), (v1, v2) = q, v
    jx, jy = arm(q1[ANGLE], partners.first_x, partners.first_y)
    bx, by = arm(q2[ANGLE], partners.second_x, partners.second_y)
    w1, w2 = v1[ANGLE], v2[ANGLE]
    return (
        q1[X] + jx - q2[X] - bx + partners.apart_x,
        q1[Y] + jy - q2[Y] - by + partners.apart_y,
        v1[X] - w1 * jy - v2[X] + w2 * by,
        v1[Y] + w1 * jx - v2[Y] - w2 * bx,
    )


@kernel
def crossing(gap0: float, rate0: float, gap1: float, rate1: float, step: float) -> float:
    """Return the fraction of a step at which the cubic Hermite interpolant of a gap changes its sign.

    Newton's method, safeguarded by bisection; gap0 and gap1 must differ in sign.
    """
    slope0, slope1 = step * rate0, step * rate1
    quadratic = 3.0 * (gap1 - gap0) - 2.0 * slope0 - slope1
    cubic = 2.0 * (gap0 - gap1) + slope0 + slope1
    low, high = 0.0, 1.0
    fraction = gap0 / (gap0 - gap1)
    for _ in range(60):
        value = gap0 + fraction * (slope0 + fraction * (quadratic + fraction * cubic))
        if (value > 0.0) == (gap0 > 0.0):
            low = fraction
        else:
            high = fraction
        slope = slope0 + fraction * (2.0 * quadratic + 3.0 * fraction * cubic)
        change = -value / slope if slope != 0.0 else 2.0
        if not low <= fraction + change <= high:
            change = 0.5 * (low + high) - fraction
        fraction += change
        if abs(change) < 1e-14:
            break
    return fraction


@kernel
def touch(contact: Memory, gap: float, rate: float, step: float, law: Law) -> tuple[float, float]:
    """Return the fraction of a step at which an open contact closes, and its impact speed (m/s, floored).

    The speed is interpolated linearly between the ends of the step. The derivative of the Hermite
    interpolant would be of a higher order, but magnifies the Newton iteration's error in the positions by
    1/step. ``contact`` is the memory at the start, ``gap`` (m) and ``rate`` (m/s) are those at the end.
    """
    fraction = crossing(contact.gap, contact.rate, gap, rate, step)
    speed = -(contact.rate + fraction * (rate - contact.rate))
    return fraction, max(speed, law.speed_floor)


@kernel
def speed_in_step(contact: Memory, gap: float, rate: float, step: Any, law: Law) -> float:
    """Return the impact speed (m/s) of a contact in a trial state of a step; 0 where it is open."""
    if gap >= 0.0:
        return 0.0
    impact_speed: float = contact.impact_speed
    if impact_speed > 0.0 or step.length > step.tick:
        return impact_speed
    return touch(contact, gap, rate, step.length, law)[1]


@kernel
def update_alone(
    time: float, step: float, row: int, gap: float, rate: float, contact: Memory, law: Law
) -> None:
    """Begin the contact of a point that closes in the step to ``time`` (s), end one that opens."""
    if (contact.impact_speed > 0.0) == (gap < 0.0):
        return
    fraction, speed = touch(contact, gap, rate, step, law)
    now = time - (1.0 - fraction) * step
    if gap < 0.0:
        contact.impact_speed, contact.start, contact.name = speed, now, row
    else:
        contact.impact_speed, contact.end = 0.0, now


@kernel
def remember(contact: Memory, gap: float, rate: float, slip: float, normal: float, friction: float) -> None:
    """Keep the state of a contact for the next step."""
    contact.gap, contact.rate, contact.slip = gap, rate, slip
    contact.normal, contact.friction = normal, friction
    contact.closed = 1.0 if gap < 0.0 else 0.0


@kernel
def allowed_ticks(time: float, step_taken: Any, contact: Memory, last: Any, law: Law) -> float:
    """Return the number of ticks to which a contact limits the step that starts at ``time`` (s).

    The limit is a share of the time to a zero of its gap, foreseen from gap, rate and acceleration, and to a
    kink of its friction (Eq. 13). Inside a contact it is also the step that resolves the oscillation of the
    normal force N: one by ``RIPPLE`` times N has N'' = ripple omega^2 N, with the frequency omega of the mass
    on the contact; the error of a step is that of N'' times the square of its length.
    """
    acceleration, slip_rate, closed = 0.0, 0.0, contact.closed > 0.0
    step: float = step_taken.length
    tick: float = step_taken.tick
    if time > 0.0:
        acceleration, slip_rate = (contact.rate - last.rate) / step, (contact.slip - last.slip) / step
        normal_rate = (contact.normal - last.normal) / step
        if last.step > 0.0:
            last.curvature = 2.0 * abs(normal_rate - last.normal_rate) / (step + last.step)
        last.normal_rate, last.step = normal_rate, step
    last.rate, last.slip, last.normal = contact.rate, contact.slip, contact.normal
    sign = -1.0 if closed else 1.0
    distance, rate, towards = abs(contact.gap), sign * contact.rate, min(sign * acceleration, 0.0)
    root, span, ticks = np.sqrt(rate * rate - 2.0 * towards * distance), np.inf, np.inf
    if rate < 0.0:
        span = 2.0 * distance / (root - rate)
    elif towards < 0.0:
        span = -(root + rate) / towards
    if not closed:
        last.largest_curvature = 0.0
        return FORESEEN_SHARE * span / tick
    speed, speed_rate = abs(contact.slip), slip_rate if contact.slip >= 0.0 else -slip_rate
    for kink in (0.0, law.static_speed, law.transition_speed):
        if (kink - speed) * speed_rate > 0.0:
            span = min(span, (kink - speed) / speed_rate)
    normal = contact.normal
    if normal <= 0.0:
        return 1.0
    squared_frequency = law.exponent * normal / (distance * law.mass)
    if law.number == FOUNDATION:  # that of a whole side inside: the stiffest
        squared_frequency = law.side_stiffness / law.mass
    decay = np.exp(-_DECAY * np.sqrt(squared_frequency) * last.step)
    last.largest_curvature = max(last.curvature, decay * last.largest_curvature)
    if last.largest_curvature > 0.0:
        ticks = np.sqrt(RIPPLE * squared_frequency * normal / last.largest_curvature)
    return min(ticks, FORESEEN_SHARE * span / tick)


@kernel
def zero_within(contact: Memory, gap: float, rate: float, step: float) -> float:
    """Return the fraction of a step at which a contact's gap first changes its sign, or more than 1.

    By the cubic Hermite interpolant between its memory, at the start, and gap (m) and rate at the end.
    """
    sign = -1.0 if contact.closed > 0.0 else 1.0
    distance0, distance1 = sign * contact.gap, sign * gap
    rate0, rate1 = sign * contact.rate, sign * rate
    if distance1 <= 0.0:
        return crossing(distance0, rate0, distance1, rate1, step) if distance0 > 0.0 else 0.0
    if rate0 >= 0.0 or rate1 <= 0.0:
        return NEVER
    # Least value of the interpolant, where its slope, slope0 + 2 b f + a f^2, vanishes
    slope0, slope1, rise = step * rate0, step * rate1, distance1 - distance0
    a, b = 3.0 * (slope0 + slope1 - 2.0 * rise), 3.0 * rise - 2.0 * slope0 - slope1
    fraction = -slope0 / (b + np.sqrt(b * b - a * slope0))
    least = distance0 + fraction * (slope0 + fraction * (b + fraction * a / 3.0))
    return fraction if least <= 0.0 else NEVER


class ContactElement:
    """A contact in Exudyn: its force in trial states, and its update in accepted states.

    Parameters
    ----------
    partners : Partners
    rows : slice
        Its rows in the memory of all ``contacts``.
    contacts, step : ndarray
        Of ``clearances.MEMORY`` and ``STEP``.
    kernels : tuple of callable
        They compute the force in a trial state, take an accepted state, and find the first change in a step.

    Attributes
    ----------
    bodies : tuple of int
        Bodies on which the contact acts, or the frame.
    load : ndarray, shape (6,)
        Of `ContactArrays`.
    force : callable
        Exudyn's ``forceUserFunction`` on the nodes of the bodies.
    """

    def __init__(
        self,
        partners: Partners,
        rows: slice,
        contacts: NDArray[Any],
        step: NDArray[Any],
        kernels: tuple[Callable[..., Any], Callable[..., float], Callable[..., float]],
    ) -> None:
        self.partners, self.rows, self.law = partners, rows, partners.law
        self.bodies = int(partners.first), int(partners.second)
        memory = contacts[rows]
        last, self.load = np.zeros(len(memory), BEFORE), np.zeros(2 * PER_BODY)
        self._arrays = ContactArrays(step, record(partners), memory, last, self.load)
        self._q, self._v = vectors = np.zeros((2, PER_BODY))
        force, follow, change = kernels
        # The guide of a slider may be the frame's, which has no coordinates
        numbers = (0.0,) * (PER_BODY if self.bodies[1] == FRAME else 2 * PER_BODY)
        self._force = machine_code(force, numbers, numbers, self._arrays)
        self._follow = machine_code(follow, 0.0, *vectors, 0.0, rows.start, self._arrays)
        self._change = machine_code(change, *vectors, self._arrays)
        self.force = self._user_function()

    def _user_function(self) -> ForceUserFunction:
        force: Callable[..., tuple[float, ...]] = self._force
        arrays, first_is_frame = self._arrays, self.bodies[0] == FRAME
        rest, part = ((0.0,) * PER_BODY, slice(PER_BODY, None)) if first_is_frame else ((), slice(PER_BODY))

        def user_function(
            _mbs: Any, _t: float, _number: int, q: list[float], v: list[float]
        ) -> tuple[float, ...]:
            # Exudyn passes lists, which numba would copy element by element: tuples are 7 us faster a call
            return force(tuple(q), tuple(v), arrays)

        def beside_frame(
            _mbs: Any, _t: float, _number: int, q: list[float], v: list[float]
        ) -> tuple[float, ...]:
            return force((*rest, *q), (*rest, *v), arrays)[part]

        return beside_frame if FRAME in self.bodies else user_function

    def attach(self, q: Array, v: Array) -> None:
        """Read all further states from these vectors of all bodies, shape (3 n,)."""
        self._q, self._v = q, v

    def follow(self, time: float, longest: float) -> float:
        """Take the accepted state at ``time`` (s); return the largest number of ticks of the next step."""
        return self._follow(time, self._q, self._v, longest, self.rows.start, self._arrays)

    def change(self) -> float:
        """Return the fraction of the step after which a contact begins or ends; more than 1: none does."""
        return self._change(self._q, self._v, self._arrays)

    def motion(self, q: Array, v: Array) -> Array:
        """Return the results of :func:`relative`, and both bodies' angles and their rates (rad, rad/s).

        Parameters
        ----------
        q, v : ndarray, shape (3 n, ...)
            States of all bodies.

        Returns
        -------
        motion : ndarray, shape (8, ...)
        """
        partners, motions = self.partners, []
        # Points of the plane as complex numbers
        first = complex(partners.first_x, partners.first_y)
        second = complex(partners.second_x, partners.second_y)
        for body, centre in zip(self.bodies, (first, second), strict=True):
            part, rest = slice(PER_BODY * body, PER_BODY * (body + 1)), np.zeros((PER_BODY, *q.shape[1:]))
            (x, y, angle), (vx, vy, w) = (rest, rest) if body == FRAME else (q[part], v[part])
            point = centre * np.exp(1j * angle)
            motions.append((x + 1j * y + point, vx + 1j * vy + 1j * w * point, angle, w))
        (place1, rate1, *turn1), (place2, rate2, *turn2) = motions
        vector, rate = place1 - place2 + complex(partners.apart_x, partners.apart_y), rate1 - rate2
        angles = turn1[0], turn2[0], turn1[1], turn2[1]
        return np.array([vector.real, vector.imag, rate.real, rate.imag, *angles])
