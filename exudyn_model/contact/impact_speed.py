"""Speed at the instant of touch, which lies inside a step (five bodies alone).

Exudyn advances five bodies in implicit steps and calls the force at trial states of a step's end. In the
shortest step (``five_bodies.step_choice``), inside of which alone a contact may begin or end:

- What was in contact at the step's start keeps its frozen speed.
- What was open and is closed in the trial state gets the speed at the instant of touch between the two, by
  :func:`touch`. The next update (``memory``) applies the same function to the accepted state, so the speed
  that is frozen is the one that the step itself was solved with: no jump, and second order is kept.

In a longer step what was open at its start stays without force.
"""

from typing import Any

import numpy as np

from exudyn_model.compiled import kernel


@kernel
def crossing(gap0: float, rate0: float, gap1: float, rate1: float, step: float) -> float:
    """Return the fraction of a step at which the gap changes its sign: root of its cubic Hermite interpolant.

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
def turning_point(
    value0: float, rate0: float, value1: float, rate1: float, step: float
) -> tuple[float, float]:
    """Return the fraction of a step where a cubic Hermite interpolant has its extremum, and that extremum.

    rate0 and rate1 must differ in sign.
    """
    slope0, slope1, rise = step * rate0, step * rate1, value1 - value0
    # The slope is slope0 + 2 b f + a f^2
    a, b = 3.0 * (slope0 + slope1 - 2.0 * rise), 3.0 * rise - 2.0 * slope0 - slope1
    root = np.sqrt(b * b - a * slope0)
    fraction = -slope0 / (b + root if slope0 < 0.0 else b - root)
    return fraction, value0 + fraction * (slope0 + fraction * (b + fraction * a / 3.0))


@kernel
def touch(gap0: float, rate0: float, gap1: float, rate1: float, law: Any) -> tuple[float, float]:
    """Return the fraction of the step at which an open contact closes, and its impact speed (m/s, floored).

    The speed is interpolated linearly between the ends of the step. The derivative of the Hermite
    interpolant would be of a higher order, but magnifies the Newton iteration's error in the positions by
    1/step.
    """
    fraction = crossing(gap0, rate0, gap1, rate1, law.step)
    speed = -(rate0 + fraction * (rate1 - rate0))
    return fraction, max(speed, law.impact_speed_floor)


@kernel
def impact_speed_in_force(state: Any, gap: float, rate: float, law: Any) -> float:
    """Return the impact speed (m/s) of the damping in the current step; 0 where the contact is open."""
    if gap >= 0.0:
        return 0.0
    frozen: float = state.impact_speed
    if law.stays_open > 0.0:
        return frozen
    return frozen if frozen > 0.0 else touch(state.gap, state.rate, gap, rate, law)[1]
