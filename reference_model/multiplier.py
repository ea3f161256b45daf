"""The paper's own form: three coordinates a body, one multiplier a constraint, Baumgarte (Eqs. 14-21).

q_i = (x_i, y_i, theta_i). With Phi(q, t) = 0 the rows of Eq. 16,

    M q'' + Phi_q^T lambda = Q,    Phi_q q'' = gamma - 2 alpha Phi' - beta^2 Phi.

`assemble` describes a planar linkage by lists: bodies, pins, guides, springs, one drive, and the pins and
guides that have clearance. A pin between bodies i and j gives the rows
r_i + R_i a - r_j - R_j b = 0 with arms a, b in the bodies' own frames (in the fixed frame, j = -1, b is a
point), a guide R_j n . (r_i - r_j) - c = 0 and theta_i - theta_j - angle = 0, a drive by a speed
theta_i - omega t - theta0 = 0. A spring has the rows of a pin, which are no constraints but its length; a
joint with clearance has its rows likewise, from which the motion and the forces of its contacts follow.
`press` lists the press with its rows in the paper's order. Rows 7-13 are corrected: as printed the rods would
not close.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_model import workpiece
from reference_model.compiled import inlined, inner, kernel
from reference_model.contact import journal_force, journal_motion, slider_forces, write_tail
from reference_model.linkage import Array, Mechanism
from reference_model.state import Nodes, Records, contact_list
from reference_model.workpiece import NO_LOAD, Load

load_force = inlined(workpiece.load_force)

FRAME = -1
"""Number that stands for the fixed frame in the place of a body."""
Point = tuple[float, float]
PinOf = tuple[int, Point, int, Point]
GuideOf = tuple[int, int, Sequence[float]]


class Linkage(NamedTuple):
    """The formulation with multipliers: a state holds x, y, theta of all bodies, their rates, integrals."""

    masses: Array
    """The diagonal of M, shape (3 n,), kg and kg m^2."""
    weights: Array
    """The bodies' weights as generalized forces, shape (3 n,)."""
    joined: NDArray[np.int64]
    """Bodies i, j of each ideal pin, of each spring, of each pin with clearance, shape (n, 2)."""
    arms: Array
    """a and b of each of these, shape (n, 4), m."""
    guided: NDArray[np.int64]
    """Bodies i, j of each ideal guide, then twice of each with clearance: across, along it; shape (n, 2)."""
    lines: Array
    """n in the frame of j, c (m), angle (rad) of each of these, shape (n, 4)."""
    springs: Array
    """Stiffness (N/m), free length (m), damping (N s/m) of each spring, shape (springs, 3)."""
    loose: NDArray[np.int64]
    """First contact, first row, place in `joined` (-1: a guide) of each clearance, shape (clearances, 3)."""
    ideal: tuple[int, int]
    """Numbers of ideal pins and guides."""
    driven: int
    """Number of the driven body."""
    slider: int
    """Number of the slider: the body that is recorded, and that a load pushes."""
    contacts: Records
    """Contacts of the clearances: four corners of a guide, one journal of a pin."""
    load: Load
    """Load of the workpiece below the slider."""
    torque: Load
    """Torque (N m) on a body that no speed drives: that of a load at the depth theta, from 0 to 2 pi rad."""
    omega: float
    """Rate of the driven body, rad/s; 0: no speed drives it."""
    theta0: float
    """Angle of the driven body at t = 0, rad."""
    alpha: float
    """Baumgarte's alpha and beta, 1/s."""
    beta: float
    phi: Array
    """Work array: Phi, then the rows that are no constraints, shape (all rows,); so are Phi' and gamma."""
    rate: Array
    gamma: Array
    lambdas: Array
    """Work array: lambda, shape (rows,)."""
    pulls: Array
    """Work array, shape (springs + 2 clearances, 2): tension (N) and length (m) of each spring; two rows of a
    pin, A - A' (m) and the force on the bearing (N), or of a guide: force along n (N) and moment (N m) on the
    slider, nothing."""
    applied: Array
    """Work array: Q, shape (3 n,)."""
    jacobian: Array
    """Work array: Phi_q, shape (all rows, 3 n); what is zero in it is so in every state."""
    matrix: Array
    """Work array: Phi_q M^-1 Phi_q^T, shape (rows, rows)."""

    @property
    def rows(self) -> int:
        """Number of constraints: pins, drive, guides."""
        return self.lambdas.size


def assemble(
    bodies: Sequence[tuple[float, float]],
    pins: Sequence[PinOf],
    guides: Sequence[GuideOf],
    drive: tuple[int, float, float],
    *,
    gravity: float = 0.0,
    baumgarte: tuple[float, float] = (0.0, 0.0),
    springs: Sequence[tuple[float, float, float]] = (),
    loose: Sequence[PinOf | GuideOf] = (),
) -> Linkage:
    """Describe a planar linkage.

    Parameters
    ----------
    bodies
        Mass (kg) and inertia about the centroid (kg m^2) of each body.
    pins
        Body i, its point (m, from the centroid, in its own frame), body j or FRAME, its point; the ends of
        springs follow.
    guides
        Body i, body j or FRAME, and the guide's `lines`.
    drive
        Body whose angle grows uniformly, its rate (rad/s; 0: it does not), its angle at t = 0 (rad).
    gravity
        Acceleration of gravity along -y, m/s^2.
    baumgarte
        alpha and beta, 1/s.
    springs
        `springs` of the last pins.
    loose
        Pins (the bearing is on body i, the journal on j) and guides with clearance.

    Returns
    -------
    Linkage
        Without contacts, load and torque.
    """
    ideal, size = (len(pins) - len(springs), len(guides)), 3 * len(bodies)
    rows = 2 * sum(ideal) + (drive[1] != 0.0)
    pins, guides, places, contact = [*pins], [*guides], [], 0
    guide_row = rows + 2 * (len(springs) + sum(len(joint) == 4 for joint in loose))
    for joint in loose:
        if len(joint) == 4:
            places.append((contact, rows + 2 * (len(pins) - ideal[0]), len(pins)))
            pins, contact = [*pins, joint], contact + 1
        else:
            places.append((contact, guide_row + 2 * (len(guides) - ideal[1]), -1))
            i, j, (nx, ny, _, angle) = joint
            guides, contact = [*guides, joint, (i, j, (ny, -nx, 0.0, angle))], contact + 4
    n_rows = rows + 2 * (len(pins) + len(guides) - sum(ideal))
    weights = np.zeros(size)
    weights[1::3] = [-gravity * mass for mass, _ in bodies]
    return Linkage(
        masses=np.array([value for mass, inertia in bodies for value in (mass, mass, inertia)]),
        weights=weights,
        joined=np.array([(i, j) for i, _, j, _ in pins], dtype=np.int64).reshape(-1, 2),
        arms=np.array([(*a, *b) for _, a, _, b in pins], dtype=np.float64).reshape(-1, 4),
        guided=np.array([(i, j) for i, j, _ in guides], dtype=np.int64).reshape(-1, 2),
        lines=np.array([line for _, _, line in guides], dtype=np.float64).reshape(-1, 4),
        springs=np.array(springs, dtype=np.float64).reshape(-1, 3),
        loose=np.array(places, dtype=np.int64).reshape(-1, 3),
        ideal=ideal,
        driven=drive[0],
        slider=0,
        contacts=contact_list(()),
        load=NO_LOAD,
        torque=NO_LOAD,
        omega=drive[1],
        theta0=drive[2],
        alpha=baumgarte[0],
        beta=baumgarte[1],
        phi=np.empty(n_rows),
        rate=np.empty(n_rows),
        gamma=np.empty(n_rows),
        lambdas=np.empty(rows),
        pulls=np.zeros((len(springs) + 2 * len(loose), 2)),
        applied=np.empty(size),
        jacobian=np.zeros((n_rows, size)),
        matrix=np.empty((rows, rows)),
    )


def press(m: Mechanism, contacts: Records, load: Load, baumgarte: tuple[float, float]) -> Linkage:
    """Describe the press, its joints in the order of the paper's rows: O, A, H, B, C, F, drive, guide.

    Without contacts the slider is on an ideal guide.
    """
    return assemble(
        bodies=list(zip(m.masses, m.inertias, strict=True)),
        pins=[
            (0, (-m.Ls1, 0.0), FRAME, (0.0, 0.0)),
            (1, (-m.Ls2, 0.0), 0, (m.L1 - m.Ls1, 0.0)),
            (2, (-m.Ls3, 0.0), FRAME, (m.Hx, m.Hy)),
            (2, (0.0, 0.0), 1, (m.L2 - m.Ls2, 0.0)),
            (3, (-m.Ls4, 0.0), 2, (m.L3 - m.Ls3, 0.0)),
            (4, (0.0, 0.0), 3, (m.L4 - m.Ls4, 0.0)),
        ],
        guides=[] if contacts.size else [(4, FRAME, (1.0, 0.0, m.line_x, 0.0))],
        drive=(0, m.omega, m.theta0),
        gravity=m.gravity,
        baumgarte=baumgarte,
        loose=[(4, FRAME, (-1.0, 0.0, 0.0, 0.0))] if contacts.size else [],
    )._replace(contacts=contacts, load=load, slider=4)


@inlined
def add_pin_end(model: Linkage, pin: int, row: int, end: int, q: Array, v: Array) -> None:
    """Add one end (0 or 1) of one of `joined` to Phi, Phi_q and gamma from a row on."""
    body, ax, ay = model.joined[pin, end], model.arms[pin, 2 * end], model.arms[pin, 2 * end + 1]
    sign = 1.0 - 2.0 * end
    if body == FRAME:
        model.phi[row] -= ax
        model.phi[row + 1] -= ay
        return
    x, y, turn = 3 * body, 3 * body + 1, 3 * body + 2
    c, s = math.cos(q[turn]), math.sin(q[turn])
    rx, ry = sign * (c * ax - s * ay), sign * (s * ax + c * ay)
    model.phi[row] += sign * q[x] + rx
    model.phi[row + 1] += sign * q[y] + ry
    model.jacobian[row, x] = model.jacobian[row + 1, y] = sign
    model.jacobian[row, turn], model.jacobian[row + 1, turn] = -ry, rx
    model.gamma[row] += rx * v[turn] * v[turn]
    model.gamma[row + 1] += ry * v[turn] * v[turn]


@inlined
def add_guide(model: Linkage, guide: int, row: int, q: Array, v: Array) -> None:
    """Write the two rows of a guide in Phi, Phi_q and gamma."""
    nx, ny, turn = model.lines[guide, 0], model.lines[guide, 1], -model.lines[guide, 3]
    x, on = 3 * model.guided[guide, 0], 3 * model.guided[guide, 1]
    ex, ey, turn = q[x], q[x + 1], turn + q[x + 2]
    if on >= 0:
        c, s, spin = math.cos(q[on + 2]), math.sin(q[on + 2]), v[on + 2]
        nx, ny = c * nx - s * ny, s * nx + c * ny
        ex, ey, turn = ex - q[on], ey - q[on + 1], turn - q[on + 2]
        slip = nx * (v[x + 1] - v[on + 1]) - ny * (v[x] - v[on])
        model.gamma[row] = spin * (spin * (nx * ex + ny * ey) - 2.0 * slip)
        model.jacobian[row, on], model.jacobian[row, on + 1] = -nx, -ny
        model.jacobian[row, on + 2], model.jacobian[row + 1, on + 2] = nx * ey - ny * ex, -1.0
    model.phi[row], model.phi[row + 1] = nx * ex + ny * ey - model.lines[guide, 2], turn
    model.jacobian[row, x], model.jacobian[row, x + 1], model.jacobian[row + 1, x + 2] = nx, ny, 1.0


@inner
def constraints(model: Linkage, t: float, q: Array, v: Array) -> None:
    """Write Phi of Eq. 16, Phi' = Phi_q v + Phi_t, gamma of Phi_q q'' = gamma, and Phi_q.

    They go to the model's arrays; `q` and `v` are coordinates and velocities at `t` (s), shape (3 n,).
    """
    phi, rate, gamma, jacobian = model.phi, model.rate, model.gamma, model.jacobian
    for i in range(phi.size):
        phi[i] = gamma[i] = 0.0
    (pins, guides), rows = model.ideal, model.lambdas.size
    for pin in range(model.joined.shape[0]):
        row = 2 * pin if pin < pins else rows + 2 * (pin - pins)
        add_pin_end(model, pin, row, 0, q, v)
        add_pin_end(model, pin, row, 1, q, v)
    row = 2 * pins
    if model.omega != 0.0:
        phi[row] = q[3 * model.driven + 2] - model.omega * t - model.theta0
        jacobian[row, 3 * model.driven + 2] = 1.0
        row += 1
    for guide in range(model.guided.shape[0]):
        if guide == guides:  # those with clearance come after springs and pins
            row = rows + 2 * (model.joined.shape[0] - pins - guides)
        add_guide(model, guide, row + 2 * guide, q, v)
    for i in range(phi.size):
        total = 0.0
        for k in range(q.size):
            total += jacobian[i, k] * v[k]
        rate[i] = total
    if model.omega != 0.0:
        rate[2 * pins] -= model.omega


@inner
def solve_definite(matrix: Array, right: Array) -> None:
    """Solve a symmetric positive definite system by Cholesky's factorization; an indefinite one gives nan.

    The factor overwrites the lower triangle of the matrix, (n, n), which alone is read, and the solution
    overwrites `right`, (n,). With numba's call of LAPACK a run takes 1.8 times as long, the first 5 s more.
    """
    n = right.size
    for i in range(n):
        for j in range(i):
            for k in range(j):
                matrix[i, j] -= matrix[i, k] * matrix[j, k]
            matrix[i, j] /= matrix[j, j]
            matrix[i, i] -= matrix[i, j] * matrix[i, j]
            right[i] -= matrix[i, j] * right[j]
        matrix[i, i] = math.sqrt(matrix[i, i])
        right[i] /= matrix[i, i]
    for i in range(n - 1, -1, -1):
        right[i] /= matrix[i, i]
        for j in range(i):
            right[j] -= matrix[i, j] * right[i]


@inner
def solve(model: Linkage, acceleration: Array) -> None:
    """Solve M q'' + Phi_q^T lambda = Q, Phi_q q'' = -r for q'' and lambda.

    Of the model's arrays `applied` holds Q (N and N m), `lambdas` r, and in the end lambda: a joint exerts
    -lambda on the first body of its pin. `acceleration` is q'', shape (3 n,).
    """
    lambdas, matrix, jacobian = model.lambdas, model.matrix, model.jacobian
    applied, mass = model.applied, model.masses
    for i in range(lambdas.size):
        right = lambdas[i]
        for j in range(i + 1):
            matrix[i, j] = 0.0
        for k in range(mass.size):
            if jacobian[i, k] != 0.0:
                weighted = jacobian[i, k] / mass[k]
                right += weighted * applied[k]
                for j in range(i + 1):
                    matrix[i, j] += weighted * jacobian[j, k]
        lambdas[i] = right
    solve_definite(matrix, lambdas)
    for k in range(mass.size):
        force = applied[k]
        for i in range(lambdas.size):
            force -= jacobian[i, k] * lambdas[i]
        acceleration[k] = force / mass[k]


@inlined
def pull_springs(model: Linkage) -> float:
    """Add the forces of the springs, whose rows are evaluated, to Q; return the power that they lose, W."""
    loss = 0.0
    for k in range(model.springs.shape[0]):
        row, pull = model.lambdas.size + 2 * k, model.pulls[k]
        x, y, damping = model.phi[row], model.phi[row + 1], model.springs[k, 2]
        length = math.sqrt(x * x + y * y)
        ux, uy = (x / length, y / length) if length > 0.0 else (0.0, 0.0)
        rate = ux * model.rate[row] + uy * model.rate[row + 1]
        pull[0], pull[1] = model.springs[k, 0] * (length - model.springs[k, 1]) + damping * rate, length
        loss += damping * rate * rate
        for i in range(model.applied.size):
            model.applied[i] -= pull[0] * (ux * model.jacobian[row, i] + uy * model.jacobian[row + 1, i])
    return loss


@inlined
def push_contacts(model: Linkage, v: Array, modes: Records, touches: Records) -> tuple[float, float]:
    """Add the forces of all clearances, whose rows are evaluated, to Q.

    Write the states of their contacts; return the power lost by damping and by friction, W.
    """
    phi, rate, applied, jacobian = model.phi, model.rate, model.applied, model.jacobian
    damping = friction = 0.0
    for k in range(model.loose.shape[0]):
        (first, row, pin), pulls = model.loose[k], model.pulls[model.springs.shape[0] + 2 * k :]
        if pin < 0:
            ks = slice(first, first + 4)
            # In a frame of the guide with y along it.
            pose = -phi[row], phi[row + 2], phi[row + 1], -rate[row], rate[row + 2], rate[row + 1]
            Fx, Fy, M, loss, friction_loss = slider_forces(model.contacts[ks], pose, modes[ks], touches[ks])
            pulls[0, 0], pulls[0, 1] = -Fx, M
            for i in range(applied.size):
                applied[i] += Fy * jacobian[row + 2, i] - Fx * jacobian[row, i] + M * jacobian[row + 1, i]
        else:
            contact, touch, (bearing, journal) = model.contacts[first], touches[first], model.joined[pin]
            w = v[3 * journal + 2] if journal != FRAME else 0.0, v[3 * bearing + 2]
            ex, ey, de = -phi[row], -phi[row + 1], (-rate[row], -rate[row + 1])
            nx, ny = journal_motion(contact, (ex, ey), de, w, touch)
            Gx, Gy, loss, friction_loss = journal_force(contact, modes[first], nx, ny, touch)
            pulls[0, 0], pulls[0, 1], pulls[1, 0], pulls[1, 1] = ex, ey, Gx, Gy
            for i in range(applied.size):
                applied[i] += Gx * jacobian[row, i] + Gy * jacobian[row + 1, i]
            # The rows' forces act at A' and A, but friction at the surface of the bearing.
            applied[3 * bearing + 2] -= contact.radius * touch.friction
            if journal != FRAME:
                applied[3 * journal + 2] += (contact.radius - contact.clearance + touch.gap) * touch.friction
        damping += loss
        friction += friction_loss
    return damping, friction


def motion(model: Linkage, t: float, i: int, modes: Records, nodes: Nodes) -> None:
    """Write gaps, rates and slips of a state."""
    v = nodes.y[i, model.masses.size : 2 * model.masses.size]
    constraints(model, t, nodes.y[i, : model.masses.size], v)
    push_contacts(model, v, modes, nodes.touches[i])


def tabulate(model: Linkage, t: float, h: float, shares: Array) -> None:
    """Do nothing: no part of this motion is a function of time alone."""


def derivative(model: Linkage, t: float, i: int, modes: Records, nodes: Nodes) -> None:
    """Write the derivatives of coordinates and rates; see `formulations.derivative`."""
    size, x, y, dy, slider = model.masses.size, 3 * model.slider, nodes.y[i], nodes.dy[i], nodes.slider[i]
    q, v, acceleration = y[:size], y[size : 2 * size], dy[size : 2 * size]
    applied, turn, torque = model.applied, 3 * model.driven + 2, 0.0
    for k in range(size):
        applied[k] = model.weights[k]
        dy[k] = v[k]
    constraints(model, t, q, v)
    damping, friction = push_contacts(model, v, modes, nodes.touches[i])
    if q[x + 1] < model.load.surface:
        applied[x + 1] += load_force(model.load, q[x + 1])
    damping += pull_springs(model)
    if model.omega == 0.0 and model.driven != FRAME:
        torque = load_force(model.torque, -(q[turn] % (2.0 * math.pi)))
        applied[turn] += torque
    for row in range(model.lambdas.size):
        right = -model.gamma[row] + 2.0 * model.alpha * model.rate[row]
        model.lambdas[row] = right + model.beta * model.beta * model.phi[row]
    solve(model, acceleration)
    slider.x, slider.y, slider.angle = q[x], q[x + 1], q[x + 2]
    slider.vx, slider.vy, slider.omega = v[x], v[x + 1], v[x + 2]
    slider.ax, slider.ay, slider.alpha = acceleration[x], acceleration[x + 1], acceleration[x + 2]
    drive = 2 * model.ideal[0]
    power = torque * v[turn] if model.omega == 0.0 else -model.lambdas[drive] * model.omega
    write_tail(dy, nodes.touches[i], power, damping, friction)


@kernel
def drift(model: Linkage, times: Array, states: Array, out: Array) -> None:
    """Write the largest |Phi| (m, rad) and |Phi'| (m/s, rad/s) of each state into `out`, shape (2, n).

    A state at one of the times (s), (n,), is a row of `states`, (n, size), that begins with q and v.
    """
    size = model.masses.size
    for i in range(times.size):
        constraints(model, times[i], states[i, :size], states[i, size : 2 * size])
        out[0, i] = out[1, i] = 0.0
        for row in range(model.lambdas.size):
            out[0, i] = max(out[0, i], abs(model.phi[row]))
            out[1, i] = max(out[1, i], abs(model.rate[row]))
