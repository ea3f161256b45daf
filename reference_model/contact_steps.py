"""Steps at a touch and before a separation, where the force is not smooth."""

import math

from reference_model.compiled import inlined, kernel
from reference_model.constants import Constants
from reference_model.forces import CLIPPED, CONTACTS, GAP, INSIDE, RATE, Array, of_side, other_corner
from reference_model.journal import JOURNAL

# A 32nd of an elastic contact; rules at loose tolerances: at 1e-7 0.05 costs 14 % more evaluations.
_FIRST_SHARE = 0.1
# All that the force moves in the first step is 2^3.5 / (2.5 * 3.5) = 1.3 tolerances; 4.0 fails more often.
_FIRST_ERROR = 2.0
# Short of the opening, where the force is not smooth; 0.5 costs 4 to 16 % more evaluations (1e-10 to 1e-7).
_EXIT_SHARE = 0.8
# While the wall does not pull nothing moves the state by the depth, so no error controls the steps over which
# the loss of what is stored, K d^1.5 d', is integrated: of that, 2e-4 is missing with 0.8, 3e-9 with 0.3.
_CLIPPED_SHARE = 0.3


@kernel
def first_step_in_contact(
    c: Constants, contact: int, speed: float, contacts: Array, tolerance: float
) -> float:
    """Return a first step (s) after a touch at `speed` (m/s), for the lightest mass m that it can hit.

    The force K (v t)^1.5 is not smooth at its start, and an estimate of eighth order knows nothing of it: the
    motion errs by about K v^1.5 h^3.5 / m in the first step, which is held against the tolerance. And no more
    than a share of (m^2 / (K^2 v))^0.2, of which an elastic contact lasts 3.2.

    The force of a foundation is smooth, so only such a share counts: of (m / K_s)^0.5, or where the other
    corner in `contacts`, shape (5, CONTACTS), is a gap g away and the force K_s (v t)^2 / 2 g, of
    (2 m g / (K_s v))^1/3.
    """
    if contact == JOURNAL:
        mass, stiffness, arm = c.m2, c.Kj, c.L2
    else:
        mass, stiffness, arm = c.J5 / (c.half_length * c.half_length), c.K, c.half_length
        if of_side(c, contact):
            gap = max(0.0, contacts[GAP, other_corner(contact)])
            longest = max(math.sqrt(mass / c.Ks), math.pow(2.0 * mass * gap / (c.Ks * speed), 1.0 / 3.0))
            return _FIRST_SHARE * longest
    longest = math.pow(mass * mass / (stiffness * stiffness * speed), 0.2)
    resolved = math.pow(tolerance * arm * mass / (stiffness * speed * math.sqrt(speed)), 1.0 / 3.5)
    return min(_FIRST_SHARE * longest, _FIRST_ERROR * resolved)


@inlined
def step_before_separation(c: Constants, modes: Array, contacts: Array, h: float, tolerance: float) -> float:
    """Return the step to take instead of `h` (s) where a contact will open within it.

    The force K d^1.5 is not smooth where it ends either; a step across that instant fails, and again when it
    is shortened. The instant is foreseen from depth and rate: the steps towards it shorten in proportion to
    what is left, until what is left is as short as a first step.
    """
    for k in range(CONTACTS):
        if of_side(c, k) and modes[INSIDE, other_corner(k)] > 0.0:
            continue
        if modes[INSIDE, k] > 0.0 and contacts[RATE, k] > 0.0 and contacts[GAP, k] < 0.0:
            left = -contacts[GAP, k] / contacts[RATE, k]
            share = _EXIT_SHARE if modes[CLIPPED, k] == 0.0 else _CLIPPED_SHARE
            if h > share * left:
                last = first_step_in_contact(c, k, contacts[RATE, k], contacts, tolerance)
                h = min(h, max(share * left, last))
    return h
