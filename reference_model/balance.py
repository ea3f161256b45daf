"""Joint reactions and energies of the whole press, from the motion of its bodies, shape (5, 9, n).

The reaction of a joint acts on its higher-numbered body and is in the fixed frame. From the slider
inwards each body's balance of forces and moments gives the next joint; rod 2 and the rocker share the two
unknowns at B. The energies balance:

    residual = drive + gravity - damping - friction
               - (kinetic - kinetic_0) - (contact - contact_0) - (load - load_0)

Kinetic, contact and load (of a workpiece) energy are stored now; the others accumulate from t = 0. Damping
and friction are integrated with the motion (power of the force's excess over its potential, N - dU/dd,
times d'; friction force times slip); gravity is the bodies' change of height.
"""

from typing import Any

import numpy as np

from reference_model.linkage import Array, Mechanism
from reference_model.workpiece import Load, load_energy

REACTIONS = (
    *(f"reaction_{joint}_{axis}" for joint in "OABHCF" for axis in "xy"),
    "crank_torque",
    "guide_force",
    "guide_moment",
)
"""Channels of the reactions, N and N m. The two of the guide exist only for an ideal slider."""
ENERGIES = tuple(
    f"energy_{part}"
    for part in ("drive", "gravity", "kinetic", "contact", "load", "damping", "friction", "residual")
)


def reactions(
    m: Mechanism, bodies: Array, Fx: Any, Fy: Any, *, ideal_slider: bool, journal: tuple[Any, ...] | None
) -> Array:
    """Return the reactions in the order of `REACTIONS`, shape (15, n).

    Fx, Fy is the force of contacts and workpiece on the slider, N; of an ideal one Fx is 0. With clearance at
    A `journal` is the force of the journal on rod 2 (N) and its point of application (m), x and y each.
    """
    (f1x, f1y), (f2x, f2y), (f3x, f3y), (f4x, f4y), (f5x, f5y) = (
        (mass * body[6], mass * (body[7] + m.gravity)) for mass, body in zip(m.masses, bodies, strict=True)
    )  # sum of all forces on a body except its weight
    Bx, By = bodies[2, 0], bodies[2, 1]
    Cx, Cy = m.Hx + (Bx - m.Hx) * (m.L3 / m.Ls3), m.Hy + (By - m.Hy) * (m.L3 / m.Ls3)
    Dx, Dy = bodies[4, 0], bodies[4, 1]  # the pin F
    # Moment about C of all forces on rod 4: the reaction at C has none.
    spin4 = m.J4 * bodies[3, 8] + (bodies[3, 0] - Cx) * f4y - (bodies[3, 1] - Cy) * f4x
    guide = np.zeros_like(Bx)
    RFx, RFy = f5x - Fx, f5y - Fy
    if ideal_slider:
        # (F - C) x (-R_F) = spin4 with R_Fy known; the guide takes the rest of the slider's balance in x.
        RFx = (spin4 + (Dx - Cx) * RFy) / (Dy - Cy)
        guide = f5x - RFx
    RCx, RCy = f4x + RFx, f4y + RFy
    # Moments: rod 2 about B, with R_A = R_B + f2; rocker about H.
    spin2 = m.J2 * bodies[1, 8] + (bodies[1, 0] - Bx) * f2y - (bodies[1, 1] - By) * f2x
    spin3 = m.J3 * bodies[2, 8] + (bodies[2, 0] - m.Hx) * f3y - (bodies[2, 1] - m.Hy) * f3x
    spin3 += (Cx - m.Hx) * RCy - (Cy - m.Hy) * RCx
    if journal is None:
        Ax, Ay = m.L1 * np.cos(bodies[0, 2]), m.L1 * np.sin(bodies[0, 2])
        ax, ay, bx, by = Ax - Bx, Ay - By, Bx - m.Hx, By - m.Hy
        right = spin2 - ax * f2y + ay * f2x
        # ax R_By - ay R_Bx = right; bx R_By - by R_Bx = spin3
        determinant = ax * by - ay * bx
        RBx, RBy = (right * bx - spin3 * ax) / determinant, (right * by - spin3 * ay) / determinant
        RAx, RAy = RBx + f2x, RBy + f2y
    else:
        RAx, RAy, Ax, Ay = journal
        RBx, RBy = RAx - f2x, RAy - f2y
    RHx, RHy = f3x - RBx + RCx, f3y - RBy + RCy
    ROx, ROy = f1x + RAx, f1y + RAy
    # Crank about O: its weight and inertia act at the centroid, -R_A at A.
    torque = m.J1 * bodies[0, 8] + bodies[0, 0] * f1y - bodies[0, 1] * f1x + Ax * RAy - Ay * RAx
    # All other forces on an ideal slider pass through its centre.
    moment = m.J5 * bodies[4, 8] if ideal_slider else guide
    return np.stack([ROx, ROy, RAx, RAy, RBx, RBy, RHx, RHy, RCx, RCy, RFx, RFy, torque, guide, moment])


def kinetic_energy(m: Mechanism, bodies: Array) -> Array:
    """Return the kinetic energy of each body, J, shape (5, n)."""
    mass, inertia = np.array(m.masses)[:, None], np.array(m.inertias)[:, None]
    return np.asarray(
        0.5 * mass * (bodies[:, 3] ** 2 + bodies[:, 4] ** 2) + 0.5 * inertia * bodies[:, 5] ** 2
    )


def energies(
    m: Mechanism, load: Load, bodies: Array, start: Array, contact: tuple[Array, float], works: Array,
    n_driven: int,
) -> Array:  # fmt: skip
    """Return the energies in the order of `ENERGIES`, shape (8, n).

    `start` is the motion of all bodies at t = 0, (5, 9, 1); `contact` the energy of the contacts, (n,), and
    at t = 0, J; `works` the work of the drive, the losses by damping and by friction so far, J, shape (3, n).
    Of `n_driven` bodies, from the crank, the motion is prescribed: the integrated work of the drive is then
    the work that they pass on at the pin C, and the energy that they take up is added here.
    """
    kinetic, kinetic0 = kinetic_energy(m, bodies), kinetic_energy(m, start)
    height, height0 = (m.gravity * np.array(m.masses)[:, None] * motion[:, 1] for motion in (bodies, start))
    drive = works[0] + (kinetic - kinetic0 + height - height0)[:n_driven].sum(0)
    gravity, total = (height0 - height).sum(0), kinetic.sum(0)
    loads, loads0 = (load_energy(load, motion[4, 1]) for motion in (bodies, start))
    residual = drive + gravity - (total - kinetic0.sum()) - (contact[0] - contact[1]) - (loads - loads0)
    residual = residual - works[1] - works[2]
    return np.stack([drive, gravity, total, contact[0], loads, works[1], works[2], residual])
