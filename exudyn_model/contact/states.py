"""Names and order of the contacts, and the state of each that its damping and the invariants refer to.

The damping term of Eq. 11 needs the normal speed at the instant when the contact began. The state of a
contact therefore holds that speed, frozen, from touch to separation. It is updated from accepted states
alone: nothing that a trial state of an iteration or of a rejected step does is ever kept.
"""

import numpy as np
from numpy.typing import NDArray

# The slider's corners, lower/upper along the guide (y), left/right across it (x); the journal of the crank
# pin
CORNERS = ("ll", "lr", "ul", "ur")
CONTACTS = (*CORNERS, "pin")
PIN = 4

# Of each of CORNERS: the side of the slider along x (its wall is on the same side), the end of it along y
ACROSS = (-1.0, 1.0, -1.0, 1.0)
ALONG = (-1.0, -1.0, 1.0, 1.0)
# From the number of a side's lower corner, which is that of the side, to its upper one
UPPER = 2

# Times in s from t = 0, SI units throughout
_STATE = np.dtype(
    [
        (name, np.float64)
        for name in (
            # At the start of the current step. impact_speed 0: no contact bears this name; closed 1: inside
            # the wall. The one goes with the other but for the law "foundation": a side has one contact
            "gap",
            "rate",
            "impact_speed",
            "closed",
            "normal",
            "friction",
            "slip",
            "regime",  # of the friction: see `friction.slip_regime`
            # Accumulated over the contact in progress; left: when the corner last opened (trees)
            "start",
            "left",
            "impulse",
            "peak",
            "depth",
            # How many samples of its normal force there are: see `pulses`
            "noted",
            # Of `watch`: what it last saw, its scales, and the worst of each invariant
            "known_start",
            "known_gap",
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
            "start_gap",
            "start_gap_time",
        )
    ]
)


def contact_states() -> NDArray[np.void]:
    """Return the states of all ``CONTACTS``, shape (5,), all zero: to be updated before the first step."""
    return np.zeros(len(CONTACTS), _STATE)
