"""The reference in one state: forces, rows of Eq. 16, accelerations; its records of five contacts."""

from types import SimpleNamespace

import numpy as np

from reference_model import chain, contact, multiplier
from reference_model.compiled import kernel
from reference_model.dop853 import evaluate
from reference_model.formulations import all_bodies
from reference_model.minimal import minimal
from reference_model.state import Mode, Touch, contact_list, new_nodes, records

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
CORNERS, JOURNAL = slice(4), 4
"""Places among five contacts."""


def constants(p):
    """Return the scene's numbers in the paper's symbols."""
    corner, journal = p.corners[0], p.journal
    pin = {"Kj": journal.K, "pin_clearance": journal.clearance, "bearing_radius": journal.radius}
    return SimpleNamespace(**p.mechanism._asdict(), **corner._asdict(), **pin)


def friction_regime(c, slip):
    """Return the regime of Eq. 13 that a slip (m/s) is in: 0 none, 1 on the ramp, 2 full, with its sign."""
    regime = 0 if abs(slip) < c.v0 else (1 if abs(slip) <= c.v1 else 2)
    return regime if slip >= 0.0 else -regime


def new_modes():
    """Return the modes of five open contacts."""
    return records(Mode, 5)


@kernel
def _slider_forces(contacts, pose, modes, touches):
    return contact.slider_forces(contacts, pose, modes, touches)


def slider_forces(p, pose, modes):
    """Return force and moment on the slider (3,), and the states of the contacts."""
    touches = records(Touch, 4)
    forces = _slider_forces(contact_list(p.corners), tuple(map(float, pose)), modes[CORNERS], touches)
    return np.array(forces[:3]), touches


@kernel
def _journal_motion(contacts, e, v, w, touches):
    return chain.journal_motion(contacts[0], (e.real, e.imag), (v.real, v.imag), w, touches[0])


@kernel
def _journal_force(contacts, modes, nx, ny, touches):
    return chain.journal_force(contacts[0], modes[0], nx, ny, touches[0])


class Bearing:
    """The journal's contact from the bearing's centre (m), its velocity (m/s) and rod 2's rate (rad/s)."""

    def __init__(self, p, time, centre, velocity, w2):
        self._contacts, self._touches = contact_list((p.journal,)), records(Touch, 1)
        omega = p.mechanism.omega
        tip = p.mechanism.L1 * np.exp(1j * (p.mechanism.theta0 + omega * time))
        e, v = complex(tip - centre), complex(1j * omega * tip - velocity)
        self._normal = _journal_motion(self._contacts, e, v, (omega, float(w2)), self._touches)
        self.rate, self.slip, self.gap = (self._touches[name][0] for name in ("rate", "slip", "gap"))
        self.point = centre + p.journal.radius * complex(*self._normal)

    def force(self, modes):
        """Return G on rod 2 and the normal force, N."""
        Gx, Gy, _, _ = _journal_force(self._contacts, modes[[JOURNAL]], *self._normal, self._touches)
        return complex(Gx, Gy), float(self._touches["normal"][0])


def _multiplier(p):
    return multiplier.press(p.mechanism, contact_list(p.corners), p.load, (p.alpha, p.beta))


def by_formulation(p, name, time, head, modes):
    """Return states of the contacts and motion of all bodies (5, 9); name: slider, pin, both, multiplier."""
    m, load, every = p.mechanism, p.load, (*p.corners, p.journal)
    places, model = {
        "slider": lambda: (CORNERS, minimal(m, contact_list(p.corners), load)),
        "pin": lambda: ([JOURNAL], chain.Chain(m, contact_list((p.journal,)), load, True)),
        "both": lambda: (slice(None), chain.Chain(m, contact_list(every), load, False)),
        "multiplier": lambda: (CORNERS, _multiplier(p)),
    }[name]()
    nodes, touches = new_nodes(np.asarray(head, dtype=float), model.contacts.size), records(Touch, 5)
    evaluate(model, time, 0, modes[places], nodes)
    touches["gap"] = np.inf  # a contact that there is not is open
    touches[places] = nodes.touches[0]
    return touches, all_bodies(model, m, np.array([time]), nodes.y[:1].T, nodes.dy[:1].T)[:, :, 0]


@kernel
def _constraints(model, time, q, v):
    multiplier.constraints(model, time, q, v)


def rows_of(p, time, q, v):
    """Return Phi, Phi', Phi_q and gamma of a free slider."""
    model = _multiplier(p)
    _constraints(model, time, q, v)
    return tuple(part[: model.rows] for part in (model.phi, model.rate, model.jacobian, model.gamma))


def masses_and_weights(p):
    """Return the diagonal of M and the weights as generalized forces, shape (15,)."""
    model = _multiplier(p)
    return model.masses, model.weights
