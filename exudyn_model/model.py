"""An assembled system of Exudyn, of any formulation, with what its contact forces read."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.constants import Constants


@dataclass(frozen=True)
class Model:
    """An assembled Exudyn system with the memory that its contact forces read.

    Attributes
    ----------
    mbs : exudyn.MainSystem
    container : exudyn.SystemContainer
        Owner of ``mbs``; held so that it outlives it.
    constants : Constants
    contacts : ndarray, shape (5,)
        See ``contact.states``.
    multipliers : tuple of str
        Channel of each Lagrange multiplier; none of a tree. Exudyn writes M a + (dc/dq)^T lambda = f, with c
        the second body's end less the first's: the channel, the constraint's force or moment on the second
        body (the motor's on the crank, the guide's on the slider), is -lambda.
    read_corners : callable or None
        See ``five_bodies.native_contact``; None where the contact is the user function.
    after_newton : callable or None
        Exudyn's post-Newton function of a crank pin with clearance: see ``contact.journal``.
    """

    mbs: Any
    container: Any
    constants: Constants
    contacts: NDArray[np.void]
    multipliers: tuple[str, ...] = ()
    read_corners: Callable[[], NDArray[np.float64]] | None = None
    after_newton: Callable[[Any, float], list[float]] | None = None
