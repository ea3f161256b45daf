"""Events: where in a step the first mode ends, and how the modes change there.

A mode ends where one of its margins (`reference_model.margins`) turns negative: first touch, separation, a
force that would turn to a pull, a kink of the friction. Every margin that the stages leave open is followed
through the step on the dense output, in intervals on which it either certainly keeps its sign or certainly
changes it once, and that zero is located. At a touch the impact speed is frozen.

Nine values of a smooth function decide (`classify`). At the Chebyshev-Lobatto points they determine the
interpolant of degree 8. Its last two Chebyshev coefficients say how far the function may be from it; its
Bernstein coefficients bound it from below, and their changes of sign bound the number of its zeros
(Descartes' rule; G. Farin, "Curves and Surfaces for CAGD", 5th ed., Sec. 5.2-5.3). An interval on which this
decides nothing is halved.
"""

from math import comb

import numpy as np
from numpy.polynomial import chebyshev

from reference_model.compiled import inlined, inner
from reference_model.contact import side_motion
from reference_model.dop853 import END, NOW, POINT, dense, free_states
from reference_model.formulations import Model, motion, tabulate
from reference_model.laws import friction_regime, push, regime_bounds
from reference_model.linkage import Array
from reference_model.margins import GATE, LOCATED, MARGINS, NONE, PULL, UPPER, margin
from reference_model.state import WORKS, Records, Run, Touch

ROUNDING = 1.0e-15
"""Rounding of a margin, m or m/s: that of coordinates near 0.55 m and of slips of some m/s."""
DEEPEST = 2.0 * LOCATED
"""Depth in its wall beyond which an open contact ends at once, m: twice the largest at its beginning."""
MOST_INTERVALS = 1000
"""Largest number of intervals (usual: 1 to 10); a margin unclear then is only rounding, and its mode ends."""

DEGREE = 8
POINTS = DEGREE + 1
ABSCISSAE = 0.5 - 0.5 * np.cos(np.pi * np.arange(POINTS) / DEGREE)
"""Shares of the interval, ascending, both ends included."""

RESOLUTION = 1.0e-13
"""Values up to this count as zero, m or m/s. Gaps are differences of coordinates near 0.55 m and round at
1e-16 m, slips of some m/s alike; the Bernstein coefficients multiply that by up to 300."""
NARROWEST = 2.0**-40
"""Narrowest interval, as a share of a step: within it coordinates change by less than their rounding."""

SETTLED, CROSSES, BELOW, UNCLEAR = range(4)
"""The function is not negative; turns negative exactly once; is nowhere positive; nothing is certain."""

_POWERS = np.arange(POINTS)
_BINOMIALS = np.array([float(comb(DEGREE, power)) for power in _POWERS])
_BERNSTEIN = _BINOMIALS * ABSCISSAE[:, None] ** _POWERS * (1.0 - ABSCISSAE[:, None]) ** (DEGREE - _POWERS)
_TO_BERNSTEIN = np.linalg.inv(_BERNSTEIN)
_WEIGHTS = (-1.0) ** _POWERS * np.where(_POWERS % DEGREE == 0, 0.5, 1.0)
_TO_LAST = np.linalg.inv(chebyshev.chebvander(2.0 * ABSCISSAE - 1.0, DEGREE))[-2:]


@inlined
def classify(values: Array, starting: bool) -> int:
    """Return SETTLED, CROSSES, BELOW or UNCLEAR, from the values (m or m/s) at `ABSCISSAE`, shape (POINTS,).

    With `starting` the mode starts with the interval, at zero within rounding or the error of its location,
    and may turn positive first.
    """
    error = 0.0
    for i in range(2):
        last = 0.0
        for j in range(POINTS):
            last += _TO_LAST[i, j] * values[j]
        error += abs(last)
    least, sign, first, changes = np.inf, 0.0, 0.0, 0
    for i in range(POINTS):
        b = 0.0
        for j in range(POINTS):
            b += _TO_BERNSTEIN[i, j] * values[j]
        least = min(least, b)
        if abs(b) > RESOLUTION:
            b_sign = 1.0 if b > 0.0 else -1.0
            if first == 0.0:
                first = b_sign
            elif b_sign != sign:
                changes += 1
            sign = b_sign
    if not error <= RESOLUTION:
        return SETTLED if least > error else UNCLEAR
    if least >= -RESOLUTION or (starting and first < 0.0 and changes == 1):
        return SETTLED
    if changes == 0 and first < 0.0 and values[0] <= RESOLUTION:
        # The margin of a mode that was located a little too early turns positive later.
        return SETTLED if starting and values[POINTS - 1] > values[0] else BELOW
    if changes == 1 and first > 0.0 and values[POINTS - 1] < 0.0 and last_positive(values) >= 0:
        return CROSSES
    return UNCLEAR


@inlined
def dips(values: Array, depth: float) -> bool:
    """Return whether a function at `ABSCISSAE` is anywhere more than `depth` below zero."""
    least = 0.0
    for j in range(POINTS):
        least = min(least, values[j])
    return least < -depth


@inner
def last_positive(values: Array) -> int:
    """Return the last point at which a function is certainly positive; -1: there is none.

    A function that crosses zero once does so behind that point. At the interval's start it may be zero.
    """
    for j in range(POINTS - 1, -1, -1):
        if values[j] > RESOLUTION:
            return j
    return -1


@inner
def interpolated(values: Array, x: float) -> float:
    """Evaluate the interpolant of `values` at `ABSCISSAE`, shape (POINTS,), at a share of the interval.

    By the barycentric formula (J.-P. Berrut, L. N. Trefethen, SIAM Rev. 46, 2004, 501-517, Eqs. 4.2, 5.4).
    """
    numerator = denominator = 0.0
    for j in range(POINTS):
        if x == ABSCISSAE[j]:
            return float(values[j])
        weight = _WEIGHTS[j] / (x - ABSCISSAE[j])
        numerator += weight * values[j]
        denominator += weight
    return numerator / denominator


@inlined
def crossing(values: Array) -> float:
    """Return the share of the interval at which a function that `classify` says CROSSES is zero.

    The regula falsi (Illinois form) finds it on the interpolant, which is within RESOLUTION of the function.
    """
    lo, hi = float(ABSCISSAE[last_positive(values)]), 1.0
    f_lo, f_hi = interpolated(values, lo), float(values[POINTS - 1])
    side = 0
    for _ in range(60):
        x = (lo * f_hi - hi * f_lo) / (f_hi - f_lo)
        if not lo < x < hi:
            break
        value = interpolated(values, x)
        if abs(value) <= 0.01 * RESOLUTION:
            return x
        if value <= 0.0:
            hi, f_hi = x, value
            f_lo *= 0.5 if side == 1 else 1.0
            side = 1
        else:
            lo, f_lo = x, value
            f_hi *= 0.5 if side == -1 else 1.0
            side = -1
    return hi


@inner  # with the flags of `evaluate_nodes`, for which numba would compile `tabulate` once more
def first_end(model: Model, t: float, h: float, run: Run) -> tuple[float, int]:
    """Return at which share of a step a margin first turns negative, and its place.

    The place is NONE if no margin does; if the share is then below 1, this is certain only up to there, where
    the step should end. The margins are those of `run.unsettled`, the step that from `t` of length `h` (s),
    whose dense output is in `run`.
    """
    contacts, modes, nodes, values = model.contacts, run.modes, run.nodes, run.values
    lo, width = 0.0, 1.0
    for interval in range(MOST_INTERVALS):
        hi = min(1.0, lo + width)
        for j in range(POINTS):
            x = lo + (hi - lo) * ABSCISSAE[j]
            node = 0 if x == 0.0 else (END if x == 1.0 else POINT)
            if node == POINT:
                dense(x, free_states(nodes), nodes.y, run.f)
                tabulate(model, t + x * h, 0.0, NOW)
                motion(model, t + x * h, POINT, modes, nodes)
            for place in range(contacts.size * MARGINS):
                if run.unsettled[place]:
                    k, number = place // MARGINS, place % MARGINS
                    values[place, j] = margin(contacts, modes, nodes.touches[node], k, number, run.scales[k])
        share, first, unclear = 2.0, NONE, NONE
        for place in range(contacts.size * MARGINS):
            if run.unsettled[place]:
                column = values[place]
                # A mode that has just begun starts at zero within rounding, and may turn positive before it
                # ends. An open contact that goes deeper into its wall than it is located to ends at once,
                # even if it comes out again within the step.
                starting = lo == 0.0 and column[0] <= ROUNDING
                outside = place % MARGINS == GATE and not modes[place // MARGINS].inside
                if outside and dips(column, DEEPEST):
                    starting = False
                verdict = classify(column, starting)
                at_share = 2.0
                if verdict == CROSSES:
                    at_share = lo + (hi - lo) * crossing(column)
                elif verdict == BELOW:
                    at_share = lo
                elif verdict == UNCLEAR:
                    unclear = place
                if at_share < share:
                    share, first = at_share, place
        if unclear != NONE and (width > NARROWEST or interval == MOST_INTERVALS - 1):
            width *= 0.5
            if interval == MOST_INTERVALS - 1:
                return lo, unclear
        elif first != NONE or hi >= 1.0:
            return share, first
        else:
            lo, width = hi, 2.0 * width
    return lo, NONE


@inner
def touches_too(touch: Touch, other: Touch) -> bool:
    """Return whether a contact touches at the same instant as another one whose gap was just located."""
    return touch.rate < 0.0 and touch.gap <= abs(other.gap) + ROUNDING


@inner
def impulse(contacts: Records, k: int, run: Run) -> float:
    """Return the impulse of a contact, or of its side, since t = 0, N s."""
    y = run.nodes.y
    first = y.shape[1] - contacts.size - WORKS
    total: float = y[0, first + k]
    if contacts[k].one_side:
        total += y[0, first + contacts[k].other]
    return total


@inner
def start_contact(contacts: Records, k: int, t: float, rate: float, slip: float, run: Run) -> None:
    """Freeze the impact speed of contact `k`, or of its side, and open its row of the event table."""
    contact, mode, touch, event = contacts[k], run.modes[k], run.nodes.touches[0, k], run.current_events[k]
    mode.inside, mode.speed = True, max(-rate, contact.speed_floor)
    mode.regime = friction_regime(contact, slip)
    mode.clipped = not contact.lossless and push(contact, -touch.gap, -rate, mode.speed) < 0.0
    event.contact, event.start, event.normal_speed, event.impulse = (
        k,
        t,
        mode.speed,
        impulse(contacts, k, run),
    )
    event.peak_force = event.largest_depth = 0.0
    event.gap, event.rate = touch.gap, touch.rate


@inlined
def begin(contacts: Records, run: Run) -> None:
    """Close the contacts that start inside their wall."""
    touches = run.nodes.touches[0]
    for k in range(contacts.size):
        contact, touch = contacts[k], touches[k]
        # A corner that starts on its wall within rounding is not inside it: it touches like any other.
        if touch.gap < -ROUNDING:
            run.modes[k].inside = True
            # If both corners of a side are inside, the deeper one, or the lower of equal ones, came first.
            lead = touches[contact.other].gap - touch.gap if contact.one_side else 1.0
            if lead > 0.0 or (lead == 0.0 and k < contact.other):
                rate, slip = touch.rate, touch.slip
                if contact.one_side:
                    _, rate, slip = side_motion(contact, touch, touches[contact.other])
                start_contact(contacts, k, 0.0, rate, slip, run)


@inner
def enter(contacts: Records, k: int, t: float, run: Run) -> None:
    """Close contact `k`; if its side is in contact already, only note that this corner is inside, too."""
    run.modes[k].inside = True
    contact, touch = contacts[k], run.nodes.touches[0, k]
    rate = touch.rate
    if contact.one_side:
        m = contact.other
        other = run.nodes.touches[0, m]
        if max(run.modes[k].speed, run.modes[m].speed) > 0.0:
            return
        # Of two corners that touch at once the faster one is ahead; rounding decides which is located.
        if touches_too(other, touch):
            rate = min(rate, other.rate)
    start_contact(contacts, k, t, rate, touch.slip, run)


@inner
def leave(contacts: Records, k: int, t: float, run: Run) -> None:
    """Open contact `k` and write its event; if the other corner of its side is inside, only note the exit."""
    modes, counters = run.modes, run.counters[0]
    modes[k].inside = False
    if contacts[k].one_side:
        m = contacts[k].other
        if run.nodes.touches[0, m].gap < 0.0:
            modes[m].inside = True
        if modes[m].inside:
            return
        if modes[k].speed == 0.0:
            k = m
    event = run.current_events[k]
    event.end, event.impulse = t, impulse(contacts, k, run) - event.impulse
    run.events[counters.events] = event
    counters.events += 1
    counters.contacts += 1
    mode = modes[k]
    mode.speed, mode.regime, mode.clipped, mode.inside = 0.0, 0, False, False


@inlined
def switch(contacts: Records, t: float, place: int, run: Run) -> None:
    """Change the mode whose margin ended at `t` (s); contacts that close at the same instant follow."""
    k, number, modes, touches = place // MARGINS, place % MARGINS, run.modes, run.nodes.touches[0]
    mode = modes[k]
    run.counters[0].switches += 1
    if number == GATE and mode.inside:
        leave(contacts, k, t, run)
    elif number == GATE:
        enter(contacts, k, t, run)
        for m in range(contacts.size):
            if not modes[m].inside and touches_too(touches[m], touches[k]):
                enter(contacts, m, t, run)
    elif number == PULL:
        mode.clipped = not mode.clipped
    else:  # the neighbouring regime
        lower, upper = regime_bounds(contacts[k], mode.regime)
        slip = np.nextafter(upper, np.inf) if number == UPPER else np.nextafter(lower, -np.inf)
        mode.regime = friction_regime(contacts[k], slip)
