"""One point against one surface: normal force and friction, and the speed at the instant of touch.

Normal force: Eqs. 9-11, clipped at 0. Friction: Eqs. 13-14. The damping term needs the normal speed at the
instant when the contact began. Exudyn advances in fixed steps and calls the force at trial states of a
step's end, so the instant lies inside a step:

- :func:`contact_states` holds, for each contact, the state at the *start* of the current step.
  ``contact_memory`` renews it from the accepted state; nothing that a trial state does is ever kept.
- What was in contact at the start keeps its frozen speed.
- What was open and is closed in the trial state gets the speed at the instant of touch between the two, by
  :func:`touch`. The next renewal applies the same function to the accepted state, so the speed that is
  frozen is the one that the step itself was solved with: no jump, and second order is kept.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import kernel
from exudyn_model.parameters import Contact

# Contacts in the order of their memory: the slider's corners, lower/upper along the guide (y), left/right
# across it (x); the journal of the crank pin
CORNERS = ("ll", "lr", "ul", "ur")
CONTACTS = (*CORNERS, "pin")
PIN = 4

# State of one contact at the start of the current step; impact_speed 0 means open. "regime" is that of the
# friction, see `slip_regime`. The fields from "start" on accumulate the contact that is going on (times in s
# from t = 0), those from "known_start" on belong to `watch`.
_STATE = np.dtype(
    [
        (name, np.float64)
        for name in (
            "gap",
            "rate",
            "impact_speed",
            "normal",
            "friction",
            "regime",
            "start",
            "impulse",
            "peak",
            "depth",
            "known_start",
            "known_rate",
            "fastest",
            "fastest_slip",
            "strongest",
            "open_depth",
            "open_depth_time",
            "pull",
            "pull_time",
            "driving",
            "driving_time",
            "leaving",
            "leaving_time",
        )
    ]
)

_SURFACE = (
    "stiffness",
    "exponent",
    "damping",
    "impact_speed_floor",
    "friction",
    "static_speed",
    "transition_speed",
)


def contact_states() -> NDArray[np.void]:
    """Memory of all ``CONTACTS``, shape (5,), all zero: to be renewed before the first step."""
    return np.zeros(len(CONTACTS), _STATE)


def law_type(*geometry: str) -> np.dtype[np.void]:
    """Type of a record with the constants of a contact, among them those named in ``geometry``."""
    return np.dtype([(name, np.float64) for name in (*_SURFACE, "step", *geometry)])


def surface_law(kind: np.dtype[np.void], contact: Contact, step: float) -> NDArray[np.void]:
    """Make such a record, shape (1,), with the surface's constants in SI units and the step in s."""
    law = np.zeros(1, kind)
    for name in _SURFACE:
        law[name] = getattr(contact, name)
    law["step"] = step
    return law


@kernel
def friction_force(normal: float, slip: float, law: Any) -> float:
    """Eqs. 13-14: modified Coulomb friction against the slip, in N; zero below ``static_speed``."""
    share: float = (abs(slip) - law.static_speed) / (law.transition_speed - law.static_speed)
    force: float = -law.friction * min(max(share, 0.0), 1.0) * normal * np.sign(slip)
    return force


@kernel
def slip_regime(slip: float, law: Any) -> float:
    """Tell which straight piece of Eq. 14 holds: 0 none, 1 rising, 2 full friction; with the slip's sign."""
    piece = 2.0 if abs(slip) >= law.transition_speed else 1.0 if abs(slip) >= law.static_speed else 0.0
    return piece if slip >= 0.0 else -piece


@kernel
def friction_in_regime(normal: float, slip: float, regime: float, law: Any) -> float:
    """:func:`friction_force` (N), with one piece of it, see :func:`slip_regime`, drawn out straight."""
    if regime == 0.0:
        return 0.0
    sign, share = np.sign(regime), 1.0
    if abs(regime) == 1.0:
        share = (sign * slip - law.static_speed) / (law.transition_speed - law.static_speed)
    force: float = -law.friction * share * normal * sign
    return force


@kernel
def damped(elastic: float, depth_rate: float, impact_speed: float, law: Any) -> float:
    """Eq. 11: elastic (1 + C depth_rate / impact_speed) in N, at least 0: a surface cannot pull."""
    force: float = elastic * (1.0 + law.damping * depth_rate / impact_speed)
    return max(force, 0.0)


@kernel
def crossing(gap0: float, rate0: float, gap1: float, rate1: float, step: float) -> float:
    """Fraction of a step at which the gap changes its sign: root of its cubic Hermite interpolant.

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
def touch(gap0: float, rate0: float, gap1: float, rate1: float, law: Any) -> tuple[float, float]:
    """Fraction of the step at which an open contact closes, and its impact speed (m/s, floored).

    The speed is interpolated linearly between the ends of the step. The derivative of the Hermite
    interpolant would be of a higher order, but magnifies the Newton iteration's error in the positions by
    1/step.
    """
    fraction = crossing(gap0, rate0, gap1, rate1, law.step)
    speed = -(rate0 + fraction * (rate1 - rate0))
    return fraction, max(speed, law.impact_speed_floor)


@kernel
def impact_speed_in_force(state: Any, gap: float, rate: float, law: Any) -> float:
    """Impact speed (m/s) that the damping refers to in the current step; 0 where the contact is open."""
    if gap >= 0.0:
        return 0.0
    frozen: float = state.impact_speed
    return frozen if frozen > 0.0 else touch(state.gap, state.rate, gap, rate, law)[1]
