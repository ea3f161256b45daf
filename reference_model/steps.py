"""Limit a step where a force is not smooth: at the start and end of a contact, at the kinks of a load.

No error control knows of the kinks of a load where the slider's motion is prescribed: there the load moves
nothing, and is integrated for the drive's work alone. So steps end at the kinks, and shorten towards where a
power law begins. The height of the slider's centre within a step is the cubic Hermite polynomial of both
ends; a step that is cut there and errs a little meets the kink in the next one.
"""

import math

from reference_model.compiled import inlined, inner
from reference_model.parameters import Contact
from reference_model.state import Motion, Records
from reference_model.workpiece import Load

# A 32nd of an elastic contact, which limits at loose tolerances: at 1e-7 0.05 costs 14 % more evaluations.
_FIRST_SHARE = 0.1
# All that the force moves in the first step is 2^3.5 / (2.5 * 3.5) = 1.3 tolerances; 4.0 fails more often.
_FIRST_ERROR = 2.0
# Steps end before the opening, where the force has a kink; 0.5 costs 4 to 16 % evaluations (1e-10 to 1e-7).
_EXIT_SHARE = 0.8
# A clipped force does not move the state, so no error controls the steps over which the loss of the stored
# energy, K d^1.5 d', is integrated: 2e-4 of it is missing with 0.8, 3e-9 with 0.3.
_CLIPPED_SHARE = 0.3

ON_IT = 2.0e-12
"""Distance from the surface of a power law within which a step begins or ends on it, m."""
BEYOND = 1.0e-13
"""Distance beyond a kink of a table at which a step ends and the next one begins, m, with as much error."""
_INTO = 1.0e-6
"""Depth of the first step in the workpiece, m; there the energy is 3e-8 of that at 1 mm."""
_DEPTH_SHARE = 0.25
"""Share of the depth for any further step: then the method misses 1e-9 of a power 1.5 of the time."""


@inner
def first_step_in_contact(
    contacts: Records, k: int, speed: float, touches: Records, tolerance: float
) -> float:
    """Return a first step (s) after a touch at `speed` (m/s), for the mass m of the contact.

    The force K (v t)^1.5 is not smooth at its start, and an estimate of eighth order does not show it: the
    motion errs by about K v^1.5 h^3.5 / m in the first step, which is held against the tolerance. And no more
    than a share of (m^2 / (K^2 v))^0.2, of which an elastic contact lasts 3.2.

    The force of a foundation is smooth, so only such a share counts: of (m / K_s)^0.5, or where the other
    corner of the side is a gap g away and the force K_s (v t)^2 / 2 g, of (2 m g / (K_s v))^1/3.
    """
    contact: Contact = contacts[k]
    mass, K = contact.mass, contact.K
    if contact.one_side:
        gap = max(0.0, touches[contact.other].gap)
        flat = math.sqrt(mass / contact.Ks)
        return _FIRST_SHARE * max(flat, math.pow(2.0 * mass * gap / (contact.Ks * speed), 1.0 / 3.0))
    longest = math.pow(mass * mass / (K * K * speed), 0.2)
    accurate = math.pow(tolerance * contact.arm * mass / (K * speed * math.sqrt(speed)), 1.0 / 3.5)
    return min(_FIRST_SHARE * longest, _FIRST_ERROR * accurate)


@inlined
def step_before_separation(
    contacts: Records, modes: Records, touches: Records, h: float, tolerance: float
) -> float:
    """Return the step to take instead of `h` (s) if a contact will open within it.

    The force K d^1.5 is not smooth where it ends either; a step across that instant fails, and again when it
    is shortened. The instant is foreseen from depth and rate: the steps towards it shorten in proportion to
    the remaining time, until that is as short as a first step.
    """
    for k in range(contacts.size):
        if contacts[k].one_side and modes[contacts[k].other].inside:
            continue
        touch = touches[k]
        if modes[k].inside and touch.rate > 0.0 and touch.gap < 0.0:
            remaining = -touch.gap / touch.rate
            share = _CLIPPED_SHARE if modes[k].clipped else _EXIT_SHARE
            if h > share * remaining:
                shortest = first_step_in_contact(contacts, k, touch.rate, touches, tolerance)
                h = min(h, max(share * remaining, shortest))
    return h


@inlined
def _height(share: float, y0: float, d0: float, y1: float, d1: float) -> float:
    """Evaluate the cubic polynomial with these values (m) and slopes (m a step) at both ends of a step."""
    rest = 1.0 - share
    ends = y0 * rest * rest * (1.0 + 2.0 * share) + y1 * share * share * (3.0 - 2.0 * share)
    return ends + share * rest * (d0 * rest - d1 * share)


@inlined
def share_to_kink(load: Load, y0: float, d0: float, y1: float, d1: float) -> float:
    """Return the share of a step at which the slider has first passed a kink of its load; 1: none.

    A kink of a table is passed by `BEYOND`: the force may be so steep that it jumps there, and the next step
    begins behind it. Heights (m) and slopes (m a step) are those of `_height`.
    """
    if load.surface == -math.inf:
        return 1.0
    turn = d0 / (d0 - d1) if d0 * d1 < 0.0 else 1.0
    lo = 0.0
    for hi in (turn, 1.0):
        first, last = _height(lo, y0, d0, y1, d1), _height(hi, y0, d0, y1, d1)
        nearest, kink = math.inf, 0.0
        for i in range(max(1, load.depths.size)):
            distance, height = ON_IT, load.surface
            if load.depths.size > 0:
                distance = BEYOND
                height += (distance if last > first else -distance) - load.depths[i]
            before, after = first - height, last - height
            if before * after < 0.0 and distance < abs(before) < nearest and abs(after) > distance:
                nearest, kink = abs(before), height
        if nearest < math.inf:
            for _ in range(60):
                middle = 0.5 * (lo + hi)
                if (_height(middle, y0, d0, y1, d1) - kink) * (first - kink) > 0.0:
                    lo = middle
                else:
                    hi = middle
            return hi
        lo = hi
    return 1.0


@inlined
def step_in_workpiece(load: Load, slider: Motion, h: float) -> float:
    """Return the step to take instead of `h` (s) in a workpiece whose force is a broken power of the depth.

    `slider` is its motion now. Near the surface such a power is smooth only over a share of the depth.
    """
    depth, speed = load.surface - slider.y, abs(slider.vy)
    if depth < -ON_IT or load.depths.size > 0 or load.exponent == math.floor(load.exponent):
        return h
    # The slider takes the time depth / speed from the surface, or to it, also if it is about to turn.
    speed += math.sqrt(0.5 * abs(slider.ay) * max(depth, 0.0))
    longest: float = max(_DEPTH_SHARE * depth, _INTO) / speed
    return min(h, longest)
