"""The audit: work of the motor and of gravity against what is stored and lost.

    residual = drive + gravity - damping - friction
               - (kinetic - kinetic_0) - (contact - contact_0) - (load - load_0)

kinetic, contact and load (of a workpiece) are the energies stored now, the others accumulate from t = 0.
Damping and friction are integrated with the motion (power of the force's excess over its potential, N -
dU/dd, times d'; friction force times slip); gravity is the bodies' change of height. Motions of the bodies
have the shape (5, 9, n).
"""

import numpy as np

from reference_model.linkage import Array, Mechanism
from reference_model.workpiece import Load, load_energy

ENERGIES = tuple(
    f"energy_{part}"
    for part in ("drive", "gravity", "kinetic", "contact", "load", "damping", "friction", "residual")
)


def kinetic_energy(m: Mechanism, bodies: Array) -> Array:
    """Return the kinetic energy of each body, J, shape (5, n)."""
    mass, inertia = np.array(m.masses)[:, None], np.array(m.inertias)[:, None]
    return np.asarray(
        0.5 * mass * (bodies[:, 3] ** 2 + bodies[:, 4] ** 2) + 0.5 * inertia * bodies[:, 5] ** 2
    )


def height_energy(m: Mechanism, bodies: Array) -> Array:
    """Return the potential of each body's weight, J, shape (5, n)."""
    return np.asarray(m.gravity * np.array(m.masses)[:, None] * bodies[:, 1])


def balance(
    m: Mechanism,
    load: Load,
    bodies: Array,
    start: Array,
    stored: Array,
    stored_at_start: float,
    works: Array,
    driven: int,
) -> Array:
    """Return the energies in the order of `ENERGIES`, shape (8, n).

    Parameters
    ----------
    m, load, bodies, start
        Mechanism; workpiece; motion of all bodies, (5, 9, n), and at t = 0, (5, 9, 1).
    stored, stored_at_start
        Energy of the contacts (n,) and at t = 0, J.
    works
        Work of the drive, losses by damping and by friction so far, J, shape (3, n).
    driven
        Number of bodies (from the crank) whose motion is prescribed: the drive's work as integrated is then
        what they pass on at the pin C, and what they take up themselves is added here.
    """
    kinetic, height = kinetic_energy(m, bodies), height_energy(m, bodies)
    kinetic0, height0 = kinetic_energy(m, start), height_energy(m, start)
    drive = works[0] + (kinetic - kinetic0 + height - height0)[:driven].sum(0)
    gravity, moving = (height0 - height).sum(0), kinetic.sum(0)
    pressed, pressed0 = (load_energy(load, motion[4, 1]) for motion in (bodies, start))
    residual = drive + gravity - (moving - kinetic0.sum()) - (stored - stored_at_start) - (pressed - pressed0)
    residual = residual - works[1] - works[2]
    return np.stack([drive, gravity, moving, stored, pressed, works[1], works[2], residual])
