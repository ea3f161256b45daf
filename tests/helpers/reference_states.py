"""The reference in one state: forces, rows of Eq. 16, accelerations; contacts in rows of five."""

from types import SimpleNamespace

import numpy as np

from reference_model import contact, journal, multiplier
from reference_model.chain import Chain
from reference_model.compiled import kernel
from reference_model.contact import CONTACTS, JOURNAL, no_contacts
from reference_model.dop853 import POINT, evaluate, new_nodes
from reference_model.minimal import TIP_ROWS, Minimal
from reference_model.observation import all_bodies

IDEAL, PIN = {"joints.slider": "ideal"}, {"joints.crank_pin": "clearance"}
MULTIPLIER = {"solver.reference.formulation": "multiplier"}
EACH = {
    "slider": {},
    "ideal": IDEAL,
    "pin": IDEAL | PIN,
    "both": PIN,
    "multiplier": MULTIPLIER,
    "multiplier ideal": MULTIPLIER | IDEAL,
}
"""What selects each formulation of the reference, for each of its joints with clearance."""
MEMORY, REGIME, CLIPPED, INSIDE = range(4)
"""Rows of the modes, shape (4, CONTACTS)."""
RATE, SLIP, GAP, NORMAL, FRICTION = range(5)
"""Rows of the contact states, shape (6, CONTACTS)."""


def constants(p):
    """Return the scene's numbers in the paper's symbols."""
    return SimpleNamespace(**p.mechanism._asdict(), **p.law._asdict())


def friction_regime(c, slip):
    """Return the regime of Eq. 13 that a slip (m/s) is in: 0 none, 1 on the ramp, 2 full, with its sign."""
    regime = 0 if abs(slip) < c.v0 else (1 if abs(slip) <= c.v1 else 2)
    return regime if slip >= 0.0 else -regime


def all_modes(modes):
    """Return modes as the reference keeps them; of three rows INSIDE follows the memory."""
    rows = np.zeros((4, CONTACTS))
    rows[: len(modes)] = modes
    if len(modes) <= INSIDE:
        rows[INSIDE] = rows[MEMORY] > 0.0
    return rows.ravel()


@kernel
def _slider_forces(law, pose, modes, contacts):
    return contact.slider_forces(law, pose, modes, contacts)


def slider_forces(p, pose, modes):
    """Return force and moment on the slider (3,), and the states of the contacts."""
    contacts = no_contacts()
    forces = _slider_forces(p.law, tuple(map(float, pose)), all_modes(modes), contacts)
    return np.array(forces[:3]), contacts.reshape(-1, CONTACTS)


@kernel
def _journal_motion(law, e, v, w1, w2, contacts):
    return journal.journal_motion(law, e.real, e.imag, v.real, v.imag, w1, w2, contacts)


@kernel
def _journal_force(law, modes, nx, ny, contacts):
    return journal.journal_force(law, modes, nx, ny, contacts)


class Bearing:
    """The journal's contact from the bearing's centre (m), its velocity (m/s) and rod 2's rate (rad/s)."""

    def __init__(self, p, time, centre, velocity, w2):
        self._p, self._contacts, omega = p, no_contacts(), p.mechanism.omega
        tip = p.mechanism.L1 * np.exp(1j * (p.mechanism.theta0 + omega * time))
        e, v = complex(tip - centre), complex(1j * omega * tip - velocity)
        self._normal = _journal_motion(p.law, e, v, omega, w2, self._contacts)
        self.rate, self.slip, self.gap = self._contacts.reshape(-1, CONTACTS)[: GAP + 1, JOURNAL]
        self.point = centre + p.law.bearing_radius * complex(*self._normal)

    def force(self, modes):
        """Return G on rod 2 and the normal force, N."""
        Gx, Gy, _, _ = _journal_force(self._p.law, all_modes(modes), *self._normal, self._contacts)
        return complex(Gx, Gy), float(self._contacts.reshape(-1, CONTACTS)[NORMAL, JOURNAL])


def in_state(model, p, time, head, modes):
    """Return states of the contacts, and motions of the slider (9,) and of all bodies (5, 9)."""
    nodes = new_nodes(np.asarray(head, dtype=float))
    evaluate(model, p.law, time, 0, modes, nodes)
    bodies = all_bodies(model, p.mechanism, np.array([time]), nodes.y[:1].T, nodes.dy[:1].T)[:, :, 0]
    return nodes.contacts[0], nodes.slider[0], bodies


def _multiplier(p):
    return multiplier.press(p.mechanism, p.load, ideal_slider=False, baumgarte=(p.alpha, p.beta))


def by_formulation(p, name, time, head, modes):
    """Return states of the contacts and motion of all bodies (5, 9); name: slider, pin, both, multiplier."""
    model = {
        "slider": lambda: Minimal(p.mechanism, p.load, np.empty((TIP_ROWS, int(POINT)))),
        "pin": lambda: Chain(p.mechanism, p.load, True),
        "both": lambda: Chain(p.mechanism, p.load, False),
        "multiplier": lambda: _multiplier(p),
    }[name]()
    contacts, _, bodies = in_state(model, p, time, head, all_modes(modes))
    return contacts.reshape(-1, CONTACTS), bodies


@kernel
def _constraints(model, time, q, v):
    multiplier.constraints(model, time, q, v)


def rows_of(p, time, q, v):
    """Return Phi, Phi', Phi_q and gamma of a free slider."""
    model = _multiplier(p)
    _constraints(model, time, q, v)
    return model.phi, model.rate, model.jacobian, model.gamma


def masses_and_weights(p):
    """Return the diagonal of M and the weights as generalized forces, shape (15,)."""
    model = _multiplier(p)
    return model.masses, model.weights
