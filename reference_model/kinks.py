"""Steps that meet a load which is not smooth: they end at its kinks, and shorten towards where it begins.

No error control knows of either where the slider's motion is prescribed: there the load moves nothing, and is
integrated for the drive's work alone. The height of the slider's centre within a step is the cubic Hermite
polynomial of both ends; a step that is cut there and errs a little meets the kink in the next one.
"""

import math

from reference_model.compiled import inlined
from reference_model.linkage import Array
from reference_model.workpiece import Load

ON_IT = 2.0e-12
"""m; nearer to the surface of a power law than that a step begins or ends on it."""
BEYOND = 1.0e-13
"""m; so far beyond a kink of a table a step ends and the next one begins, give or take as much."""
_FIRST = 1.0e-6
"""m by which a step goes into the workpiece, at first: of the energy at a depth of 1 mm 3e-8."""
_SHARE = 0.25
"""Of the depth, for any further step: of a power 1.5 of the time the method then misses 1e-9."""


@inlined
def _height(share: float, y0: float, d0: float, y1: float, d1: float) -> float:
    """Evaluate the cubic polynomial with these values (m) and slopes (m a step) at both ends of a step."""
    rest = 1.0 - share
    ends = y0 * rest * rest * (1.0 + 2.0 * share) + y1 * share * share * (3.0 - 2.0 * share)
    return ends + share * rest * (d0 * rest - d1 * share)


@inlined
def share_to_kink(load: Load, start: Array, end: Array, h: float) -> float:
    """Return the share of a step of `h` (s) at which the slider has first passed a kink of its load; 1: none.

    A table's by `BEYOND`: it may be so steep that its force jumps there, and the next step begins behind it.
    `start` and `end` are the slider's motion at both ends, shape (9,).
    """
    if load.surface == -math.inf:
        return 1.0
    y0, d0, y1, d1 = start[1], h * start[4], end[1], h * end[4]
    turn = d0 / (d0 - d1) if d0 * d1 < 0.0 else 1.0
    lo = 0.0
    for hi in (turn, 1.0):
        first, last = _height(lo, y0, d0, y1, d1), _height(hi, y0, d0, y1, d1)
        nearest, kink = math.inf, 0.0
        for i in range(max(1, load.depths.size)):
            near, height = ON_IT, load.surface
            if load.depths.size > 0:
                near = BEYOND
                height += (near if last > first else -near) - load.depths[i]
            before, after = first - height, last - height
            if before * after < 0.0 and near < abs(before) < nearest and abs(after) > near:
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
def step_in_workpiece(load: Load, slider: Array, h: float) -> float:
    """Return the step to take instead of `h` (s) in a workpiece whose force is a broken power of the depth.

    `slider` is its motion now, shape (9,). Near the surface such a power is smooth only over a share of the
    depth.
    """
    depth, speed = load.surface - slider[1], abs(slider[4])
    if depth < -ON_IT or load.depths.size > 0 or load.exponent == math.floor(load.exponent):
        return h
    # The time that the slider takes from the surface, or to it, also where it is about to turn.
    speed += math.sqrt(0.5 * abs(slider[7]) * max(depth, 0.0))
    longest: float = max(_SHARE * depth, _FIRST) / speed
    return min(h, longest)
