"""The audit: work of the motor and of gravity against what is stored and lost.

    residual = drive + gravity - (kinetic - kinetic_0) - (contact - contact_0) - damping - friction

kinetic and contact are the energies stored now, the others accumulate from t = 0. Damping and friction are
integrated with the motion (power of the force's excess over its potential, N - dU/dd, times d'; friction
force times slip); gravity is the bodies' change of height.
"""

from reference_model.compiled import kernel
from reference_model.constants import Constants
from reference_model.contact import point_force, stored_energy
from reference_model.forces import GAP, MEMORY, Array, touches_with_sides
from reference_model.foundation import foundation_energy
from reference_model.journal import JOURNAL

ENERGIES = tuple(
    f"energy_{part}" for part in ("drive", "gravity", "kinetic", "contact", "damping", "friction", "residual")
)


@kernel
def kinetic_energy(c: Constants, bodies: Array, first: int, last: int) -> float:
    """Return the kinetic energy of bodies `first` .. `last` - 1 (0-based), J."""
    m, J = (c.m1, c.m2, c.m3, c.m4, c.m5), (c.J1, c.J2, c.J3, c.J4, c.J5)
    energy = 0.0
    for i in range(first, last):
        energy += 0.5 * m[i] * (bodies[i, 3] ** 2 + bodies[i, 4] ** 2) + 0.5 * J[i] * bodies[i, 5] ** 2
    return energy


@kernel
def height_energy(c: Constants, bodies: Array, first: int, last: int) -> float:
    """Return the potential of weight of bodies `first` .. `last` - 1, J."""
    m = (c.m1, c.m2, c.m3, c.m4, c.m5)
    energy = 0.0
    for i in range(first, last):
        energy += c.gravity * m[i] * bodies[i, 1]
    return energy


@kernel
def contact_energy(c: Constants, modes: Array, contacts: Array) -> float:
    """Return what the contacts store, J, from modes (MODES, CONTACTS) and contact states (5, CONTACTS)."""
    energy = 0.0
    for side in range(2):
        if touches_with_sides(c):
            energy += foundation_energy(c, -contacts[GAP, side], -contacts[GAP, side + 2])
            continue
        d1 = -contacts[GAP, side] if modes[MEMORY, side] > 0.0 else 0.0
        d2 = -contacts[GAP, side + 2] if modes[MEMORY, side + 2] > 0.0 else 0.0
        both = modes[MEMORY, side] > 0.0 and modes[MEMORY, side + 2] > 0.0
        energy += stored_energy(c, d1, d2, both)
    if modes[MEMORY, JOURNAL] > 0.0:
        depth = -contacts[GAP, JOURNAL]
        energy += point_force(c.Kj, c.n, depth) * depth / (c.n + 1.0)
    return energy


@kernel
def balance(
    c: Constants,
    bodies: Array,
    modes: Array,
    contacts: Array,
    works: Array,
    driven: int,
    start: Array,
    out: Array,
) -> None:
    """Write the energies in the order of `ENERGIES`.

    Parameters
    ----------
    c, bodies, modes, contacts
        Constants; motion of all bodies; modes and states of the contacts.
    works
        Work of the drive, losses by damping and by friction so far, J, shape (3,).
    driven
        Number of bodies (from the crank) whose motion is prescribed: the drive's work as integrated is then
        what they pass on at the pin C, and what they take up themselves is added here.
    start
        Kinetic, contact and height energy at t = 0, and kinetic and height of the driven ones, J, shape (5,).
    out
        Shape (7,).
    """
    kinetic, contact = kinetic_energy(c, bodies, 0, 5), contact_energy(c, modes, contacts)
    gravity = start[2] - height_energy(c, bodies, 0, 5)
    drive = works[0]
    drive += kinetic_energy(c, bodies, 0, driven) - start[3] + height_energy(c, bodies, 0, driven) - start[4]
    out[0], out[1], out[2], out[3], out[4], out[5] = drive, gravity, kinetic, contact, works[1], works[2]
    out[6] = drive + gravity - (kinetic - start[0]) - (contact - start[1]) - works[1] - works[2]


@kernel
def starting_energies(
    c: Constants, bodies: Array, modes: Array, contacts: Array, driven: int, out: Array
) -> None:
    """Write what `balance` needs of t = 0, shape (5,)."""
    out[0], out[1] = kinetic_energy(c, bodies, 0, 5), contact_energy(c, modes, contacts)
    out[2] = height_energy(c, bodies, 0, 5)
    out[3], out[4] = kinetic_energy(c, bodies, 0, driven), height_energy(c, bodies, 0, driven)
