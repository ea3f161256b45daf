"""Where in a step the depth or the force of a closed contact peaks."""

import math

from reference_model.compiled import bare, inlined
from reference_model.constants import Constants
from reference_model.contact import damping_factor, without_memory
from reference_model.dop853 import dense
from reference_model.forces import (
    CONTACTS,
    GAP,
    INSIDE,
    MEMORY,
    RATE,
    Array,
    normal_force,
    of_side,
    other_corner,
)
from reference_model.formulations import free, right_hand_side
from reference_model.foundation import resultant
from reference_model.progress import Progress
from reference_model.switching import contact_state

_DIFFERENCE = 1.0e-4
"""Of a step, over which the rate of a side's force is taken: only to guess where it peaks."""
_GOLDEN, _SECTIONS = 0.5 * (math.sqrt(5.0) - 1.0), 16
"""Of a step, which shrinks to 5e-4 of itself."""
_STILL = 1.0e-9
"""Of the rates at a step's ends: by its square, 1e-18, the depth at that instant is not the largest."""


@inlined
def force_peak(c: Constants, contact: int, speed: float, h: float, before: Array, after: Array) -> float:
    """Return about where in a step of `h` (s) the force of a closed contact peaks, as a share; -1: nowhere.

    From the zero of d/dt [d^n (1 + C d' / v)], times d, with the mean d'' of the step; v is `speed`. A peak
    close to a step's end can seem to lie in the next step, and from there in this one: then the force at the
    end stands for it, up to 1e-4 of it short.
    """
    if of_side(c, contact):
        rise0, rise1 = _side_rise(c, contact, speed, h, before, after)
        return rise0 / (rise0 - rise1) if rise0 > 0.0 > rise1 else -1.0
    bend = (before[RATE, contact] - after[RATE, contact]) / h
    rise0 = _force_rise(c, before[GAP, contact], before[RATE, contact], bend, speed)
    rise1 = _force_rise(c, after[GAP, contact], after[RATE, contact], bend, speed)
    return rise0 / (rise0 - rise1) if rise0 > 0.0 > rise1 else -1.0


@inlined
def _force_rise(c: Constants, gap: float, rate: float, bend: float, speed: float) -> float:
    if without_memory(c):
        now = math.sqrt(rate * rate + c.speed_floor * c.speed_floor)
        still = c.speed_floor * c.speed_floor / (now * now)
        return -c.n * rate * (1.0 - c.C * rate / now) - c.C * bend * gap * still / now
    return -c.n * rate * (1.0 - c.C * rate / speed) - c.C * bend * gap / speed


@bare
def _side_rise(
    c: Constants, k: int, speed: float, h: float, before: Array, after: Array
) -> tuple[float, float]:
    """Return the rate of a side's force (N/s) at both ends of a step, by a difference with the mean d''."""
    m = other_corner(k)
    bend_k, bend_m = (before[RATE, k] - after[RATE, k]) / h, (before[RATE, m] - after[RATE, m]) / h
    ahead = _DIFFERENCE * h
    rise0 = rise1 = 0.0
    for end in range(2):
        at = before if end == 0 else after
        dk, dm, vk, vm = -at[GAP, k], -at[GAP, m], -at[RATE, k], -at[RATE, m]
        now = _side_force(c, dk, dm, vk, vm, speed)
        later = _side_force(
            c, dk + ahead * vk, dm + ahead * vm, vk + ahead * bend_k, vm + ahead * bend_m, speed
        )
        if end == 0:
            rise0 = (later - now) / ahead
        else:
            rise1 = (later - now) / ahead
    return rise0, rise1


@inlined
def _side_force(c: Constants, d1: float, d2: float, rate1: float, rate2: float, speed: float) -> float:
    elastic, share = resultant(c, d1, d2)
    return elastic * damping_factor(c, share * rate1 + (1.0 - share) * rate2, speed)


@bare
def force_at(
    c: Constants, p: Progress, contact: int, share: float, t: float, h: float, f: Array,
    state: Array, dy: Array, contacts: Array,
) -> float:  # fmt: skip
    """Return a contact's normal force (N) within a step, by its dense output."""
    dense(p.y, f, share, free(c), state)
    right_hand_side(c, t + share * h, state, p.modes, dy, contacts)
    return normal_force(c, contacts, contact)


@bare
def strongest(
    c: Constants, p: Progress, contact: int, guess: float, t: float, h: float, f: Array,
    state: Array, dy: Array, contacts: Array,
) -> float:  # fmt: skip
    """Return the share of the step at which a contact's force peaks, near a guess of it.

    The vertex of a parabola through three forces, ever closer ones. The peak of a law without memory, where
    the factor falls from 1 + C to 1 - C, is narrow and no guess is near it: there by the golden section.
    """
    if without_memory(c):
        lo, hi = 0.0, 1.0
        for _ in range(_SECTIONS):
            a, b = hi - _GOLDEN * (hi - lo), lo + _GOLDEN * (hi - lo)
            if force_at(c, p, contact, a, t, h, f, state, dy, contacts) > force_at(
                c, p, contact, b, t, h, f, state, dy, contacts
            ):
                hi = b
            else:
                lo = a
        return 0.5 * (lo + hi)
    share, width = guess, 0.25 * min(guess, 1.0 - guess)
    for _ in range(2):
        before = force_at(c, p, contact, share - width, t, h, f, state, dy, contacts)
        here = force_at(c, p, contact, share, t, h, f, state, dy, contacts)
        after = force_at(c, p, contact, share + width, t, h, f, state, dy, contacts)
        curve = before - 2.0 * here + after
        if curve < 0.0:
            share += width * max(-1.0, min(1.0, 0.5 * (before - after) / curve))
        width *= 0.25
    return share


@inlined
def has_peak(c: Constants, modes: Array, h: float, before: Array, after: Array) -> bool:
    """Return whether the depth or the force of some closed contact peaks within a step."""
    for i in range(CONTACTS):
        if modes[INSIDE, i] > 0.0 and before[RATE, i] < 0.0 < after[RATE, i]:
            return True
        if modes[MEMORY, i] > 0.0 and force_peak(c, i, modes[MEMORY, i], h, before, after) > 0.0:
            return True
    return False


@bare
def deepest(
    c: Constants, k: int, t: float, h: float, y: Array, f: Array, before: Array, after: Array, state: Array
) -> float:  # fmt: skip
    """Return the share of a step at which contact `k` is deepest: its gap turns from closing to opening.

    The regula falsi in its Illinois form, for the zero of the gap's rate. `state` is overwritten.
    """
    lo, hi, f_lo, f_hi = 0.0, 1.0, before[RATE, k], after[RATE, k]
    small = _STILL * max(-f_lo, f_hi)
    x, side = hi, 0
    for _ in range(60):
        x = (lo * f_hi - hi * f_lo) / (f_hi - f_lo)
        dense(y, f, x, free(c), state)
        _, rate, _ = contact_state(c, k, t + x * h, state)
        if abs(rate) <= small:
            break
        if rate > 0.0:
            hi, f_hi = x, rate
            f_lo *= 0.5 if side == 1 else 1.0
            side = 1
        else:
            lo, f_lo = x, rate
            f_hi *= 0.5 if side == -1 else 1.0
            side = -1
    return x
