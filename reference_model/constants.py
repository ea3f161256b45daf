"""What the compiled kernels read: the flat record of floats that `Parameters.constants` makes of a scene."""

from collections.abc import Iterable
from enum import StrEnum
from typing import NamedTuple, cast

import numpy as np

PAPER_SWITCHING, STRIP, FOUNDATION = 1.0, 2.0, 3.0
"""Values of `Constants.law`; 0: hertz-corners."""


class Constants(NamedTuple):
    """What the kernels read: floats only, so that one compiled version serves every scene.

    The kernels take it as a record (`as_record`).
    """

    omega: float
    """Crank speed, rad/s, counter-clockwise positive."""
    theta0: float
    """Crank angle at t = 0, rad."""
    m1: float
    """Masses, kg."""
    m2: float
    m3: float
    m4: float
    m5: float
    J1: float
    """Inertias about the centroids, kg m^2."""
    J2: float
    J3: float
    J4: float
    J5: float
    Ls1: float
    """Centroids from the first pin, m."""
    Ls2: float
    Ls3: float
    """Also the distance from the rocker's pivot H to B, where rod 2 is pinned."""
    Ls4: float
    L1: float
    """Crank length, m."""
    L2: float
    """Length of rod 2, m."""
    L3: float
    """Rocker length, m."""
    Hx: float
    """Rocker pivot, x, m."""
    Hy: float
    """Rocker pivot, y, m."""
    rocker_branch: float
    """+1: B lies left of the line from A to H; -1: right."""
    L4: float
    """Length of rod 4, m."""
    slider_branch: float
    """-1: the slider hangs below the rocker's tip; +1: it stands above."""
    first_moment: float
    """m4 Ls4 + m5 L4 of rod 4 with the slider's mass at its end, about the tip C, kg m."""
    moving_mass: float
    """m4 + m5, kg."""
    I4: float
    """J4 + m4 Ls4^2 + m5 L4^2, the inertia that goes with it, kg m^2."""
    gravity: float
    """Along -y, m/s^2."""
    line_x: float
    """The ideal slider's line: guide_x + reference_offset, m."""
    wall_left: float
    """x of the guide's left wall, m."""
    wall_right: float
    """x of the guide's right wall, m."""
    half_width: float
    """W_T / 2, m."""
    half_length: float
    """L / 2, m."""
    law: float
    """Number of the contact law of the slider (`reference_model.contact`)."""
    memoryless: float
    """1: the damping refers to the present depth rate; 0: to the impact speed frozen at the touch."""
    K: float
    """Contact stiffness of a corner, Eq. 10, N/m^n."""
    Ks: float
    """Stiffness of a whole side, Eq. 8, N/m."""
    n: float
    """Exponent of the contact law."""
    C: float
    """3 (1 - c_e^2) / 4 of Eq. 11."""
    speed_floor: float
    """Smallest impact speed in the damping term, m/s."""
    c_f: float
    """Friction coefficient."""
    v0: float
    """Speed below which friction is zero, Eq. 13, m/s."""
    v1: float
    """Speed above which friction is full, Eq. 13, m/s."""
    pin_clearance: float
    """Radial clearance at the crank pin A, m."""
    bearing_radius: float
    """R_b of the bearing in rod 2, m."""
    Kj: float
    """Contact stiffness of journal and bearing, Eq. 10 with R = R_j R_b / (R_b - R_j), N/m^n."""
    alpha: float
    """Baumgarte's alpha and beta of the multiplier form, 1/s (Eq. 21)."""
    beta: float


class Formulation(StrEnum):
    """What the equations of motion are written in."""

    IDEAL = "for_ideal"
    """No freedom left: closed form."""
    SLIDER = "for_slider_clearance"
    """theta_4 and theta_5 behind the driven four-bar."""
    PIN = "for_pin_clearance"
    """theta_2 and theta_3: clearance at the crank pin A, ideal slider."""
    BOTH = "for_both_clearances"
    """theta_2 .. theta_5: clearance at A and at the slider."""
    MULTIPLIER = "for_multiplier"
    """The paper's: 15 coordinates, 13 multipliers, clearance at the slider."""
    MULTIPLIER_IDEAL = "for_multiplier_ideal_slider"
    """15 coordinates, 15 multipliers."""


_SIDES = "with_contacts_of_sides"
"""Mark of the records under the law foundation: other laws do not pay for what it asks."""
_ANY = "for_any"
"""In place of the formulation, or of the law's mark, for kernels whose code is the same for all of them."""


def as_record(constants: Constants, formulation: Formulation) -> Constants:
    """Return the constants as the kernels take them: one record, passed by reference.

    An extra field named after the formulation makes its type another one, so that numba compiles the
    integrator once for each formulation in use (`reference_model.formulations`), and once more for the law
    foundation. It is one field: numba takes a record with further fields for one without.
    """
    mark = f"{formulation.value}+{_SIDES}" if constants.law == FOUNDATION else formulation.value
    dtype = np.dtype([(name, np.float64) for name in (*Constants._fields, mark)])
    record = np.array([(*constants, 0.0)], dtype=dtype).view(np.recarray)[0]
    return cast(Constants, record)


def formulation_of(fields: Iterable[str]) -> Formulation:
    """Return the formulation that a record is marked with, from the names of its fields."""
    return Formulation(list(fields)[-1].split("+")[0])


def has_sides(fields: Iterable[str]) -> bool:
    """Return whether a record is marked with the law foundation, from the names of its fields.

    Raises
    ------
    ValueError
        If the mark was left out.
    """
    marks = list(fields)[-1].split("+")[1:]
    if _ANY in marks:
        raise ValueError("the contact law is not known here")
    return _SIDES in marks


def less_marked(fields: Iterable[str], *, with_law: bool) -> list[str]:
    """Return the names of a record's fields without its formulation, and without its law if not asked for."""
    names = list(fields)
    return [*names[:-1], "+".join([_ANY, *(names[-1].split("+")[1:] if with_law else [_ANY])])]
