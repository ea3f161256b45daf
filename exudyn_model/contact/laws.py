"""Normal forces of the two corners of one side of the slider, from the depths of both.

Four laws, by their number in ``LAWS``:

- "hertz-corners": each corner follows Eqs. 9-11 by itself.
- "paper-switching": the same until both corners of a side are in contact. Then, literally Eqs. 7-8: the
  surface's force K_s (d1 + d2) / 2 without damping, in the centroid of the penetrated trapezoid, as the two
  forces in the corners that have this resultant. The force jumps at the switch, and with it what is stored:
  the audit of the energy shows what the jumps bring in.
- "strip": the elastic forces derive from a potential, K d1^(n+1) / (n+1) + K d2^(n+1) / (n+1) + 2 K_s h^2
  with h = d1 d2 / (d1 + d2), continuous where the second corner touches; damped in each corner as Eq. 11.
  Equal depths d give the last term K_s d^2 / 2, that of the surface.
- "foundation": the surface of Eqs. 7-8 also where a part of the side alone is inside. An elastic layer along
  the side stores K_s (d1^2 + d1 d2 + d2^2) / 6, and K_s d1^3 / (6 (d1 - d2)) where d2 < 0 < d1, which is
  continuous there up to its second derivatives. The forces in the corners are statically equivalent to the
  layer's pressure: the corner that is outside bears its part too. Damping and friction are the side's, not
  the corners' (``foundation``).
"""

from typing import Any

from exudyn_model.compiled import kernel
from exudyn_model.contact.point import damped

LAWS = ("hertz-corners", "paper-switching", "strip", "foundation")
_SWITCHING, _STRIP, FOUNDATION = 1, 2, 3


@kernel
def foundation_normals(lower: float, upper: float, stiffness: float) -> tuple[float, float]:
    """Return the elastic normal forces (N) of both corners of a side on an elastic foundation.

    ``lower`` and ``upper`` are depths (m), ``stiffness`` is K_s (N/m).
    """
    sixth = stiffness / 6.0
    if lower > 0.0 and upper > 0.0:
        return sixth * (2.0 * lower + upper), sixth * (lower + 2.0 * upper)
    depth, other = max(lower, upper), min(lower, upper)
    if not depth > 0.0:
        return 0.0, 0.0
    share = depth / (depth - other)  # of the side, that is inside
    inside, outside = sixth * depth * share * (3.0 - share), sixth * depth * share * share
    return (inside, outside) if lower > upper else (outside, inside)


@kernel
def elastic_normals(lower: float, upper: float, both: bool, law: Any) -> tuple[float, float]:
    """Return the elastic normal forces (N) of both corners from their depths (m; not positive: open).

    ``both``: whether both are in contact. Steps that end at each touch and leaving have trial states a
    little past it, where a corner in contact has a negative depth: the surface's force goes on smoothly.
    The law "foundation" goes by the depths alone.
    """
    if law.kind == FOUNDATION:
        return foundation_normals(lower, upper, law.side_stiffness)
    if both and law.kind == _SWITCHING:
        sixth = law.side_stiffness / 6.0
        return max(sixth * (2.0 * lower + upper), 0.0), max(sixth * (lower + 2.0 * upper), 0.0)
    first = law.stiffness * lower**law.exponent if lower > 0.0 else 0.0
    second = law.stiffness * upper**law.exponent if upper > 0.0 else 0.0
    if both and law.kind == _STRIP and lower > 0.0 and upper > 0.0:
        # 4 K_s h dh/dd, where dh/dd of one corner is the square of the other's share of the sum
        total = lower + upper
        factor = 4.0 * law.side_stiffness * lower * upper / total**3
        first, second = first + factor * upper * upper, second + factor * lower * lower
    return first, second


@kernel
def side_normals(
    lower: float,
    lower_rate: float,
    lower_speed: float,
    upper: float,
    upper_rate: float,
    upper_speed: float,
    law: Any,
) -> tuple[float, float]:
    """Return the normal forces (N) of the lower and the upper corner of a side, each at least 0.

    Not of the law "foundation", whose damping is that of the side: see ``foundation``.

    Parameters
    ----------
    lower, upper : float
        Depths, m.
    lower_rate, upper_rate : float
        Their rates, m/s.
    lower_speed, upper_speed : float
        Impact speeds, m/s; 0: this corner is open, whatever its depth.
    law : record
        From ``gaps.contact_law``.
    """
    both = lower_speed > 0.0 and upper_speed > 0.0
    first, second = elastic_normals(
        lower if lower_speed > 0.0 else 0.0, upper if upper_speed > 0.0 else 0.0, both, law
    )
    if both and law.kind == _SWITCHING:
        return first, second
    if first > 0.0:
        first = damped(first, lower_rate, lower_speed, law)
    if second > 0.0:
        second = damped(second, upper_rate, upper_speed, law)
    return first, second


@kernel
def side_energy(lower: float, upper: float, law: Any) -> float:
    """Return the energy (J) that a side stores at these depths (m; not positive: open)."""
    both = lower > 0.0 and upper > 0.0
    if law.kind == FOUNDATION and not both:
        depth = max(lower, upper)
        if not depth > 0.0:
            return 0.0
        partial: float = law.side_stiffness * depth**3 / (6.0 * (depth - min(lower, upper)))
        return partial
    if both and (law.kind == _SWITCHING or law.kind == FOUNDATION):
        surface: float = law.side_stiffness * (lower * lower + lower * upper + upper * upper) / 6.0
        return surface
    stored = 0.0
    for depth in (lower, upper):
        if depth > 0.0:
            stored += law.stiffness * depth ** (law.exponent + 1.0) / (law.exponent + 1.0)
    if both and law.kind == _STRIP:
        stored += 2.0 * law.side_stiffness * (lower * upper / (lower + upper)) ** 2
    return stored
