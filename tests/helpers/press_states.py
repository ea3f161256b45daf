"""States of the press for both models: all that each needs, from the closed form of docs/model.md.

A state is the crank's time, the slider's x, angle and their rates, and the impact speeds of the corners in
contact.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from page_engine import at_time
from page_formulas import Numbers, corner_load, friction
from reference_states import constants, friction_regime, new_modes

from comparison.scene import load_scene
from exudyn_model.clearances import new_contacts
from exudyn_model.parameters import read_scene
from reference_model.parameters import read_parameters

BARRED = {"solver.reference.baumgarte_alpha": 0.0, "solver.reference.baumgarte_beta": 0.0}
"""Baumgarte's terms would add the constraints' rounding times beta^2 to the accelerations."""


@dataclass(frozen=True)
class State:
    """One state of the whole press."""

    time: float
    """s."""
    q: np.ndarray
    """x, y, angle of the five bodies (15,), m and rad; fixed frame."""
    v: np.ndarray
    """Their rates."""
    speeds: np.ndarray
    """Impact speeds of the four corners, m/s; 0: open."""

    @property
    def slider(self):
        """x, y, angle of the slider and their rates."""
        return (*self.q[12:], *self.v[12:])


class Press:
    """A scene as both models and the page read it."""

    def __init__(self, changes=None):
        self.data = load_scene("150rpm-0.2mm", {**BARRED, **(changes or {})}).data
        self.reference = read_parameters(self.data)
        self.numbers = constants(self.reference)
        self.page = Numbers(self.data)
        self.exudyn = read_scene(self.data)

    def state(self, time, x, angle, vx, w, speeds):
        """Close the linkage at ``time`` with the slider at ``x`` (m, fixed frame), turned by ``angle``."""
        joints = {"joints": {"slider": "clearance", "crank_pin": "ideal"}}
        q, v = at_time(self.data | joints, time, x, angle, vx, w).start()[:30].reshape(2, 15)
        return State(time, q, v, np.asarray(speeds, dtype=float))

    def corner(self, state, number):
        """Gap (m), its rate, slip (m/s), and arm x, y (m) of a corner."""
        x, _, angle, vx, vy, w = state.slider
        depth, rate, *others = self.page.corner(number, x, angle, vx, vy, w)
        return -depth, -rate, *others

    def pulls(self, stiffness, gap, rate, speed):
        """Whether a wall in contact would have to pull; N/m^n, m, m/s, m/s."""
        return (
            gap < 0.0
            and self.page.damped(stiffness, stiffness * (-gap) ** self.page.n, -gap, -rate, speed) == 0.0
        )

    def modes(self, state):
        """Modes of the contacts as the reference keeps them."""
        modes = new_modes()
        for number in np.flatnonzero(state.speeds):
            (gap, rate, slip, _, _), speed = self.corner(state, int(number)), state.speeds[number]
            pulls = self.pulls(self.page.K, gap, rate, speed)
            modes[number] = speed, friction_regime(self.numbers, slip), pulls, True
        return modes

    def memory(self, state):
        """Memory of the corners as the Exudyn model keeps it, shape (4,)."""
        contacts = new_contacts(4)
        contacts["impact_speed"], contacts["closed"] = state.speeds, state.speeds > 0.0
        return contacts

    def page_force(self, state):
        """Force (N) and moment (N m) of all corners on the slider by the formulas of docs/model.md."""
        motion, force = [self.corner(state, number) for number in range(4)], np.zeros(3)
        for number in np.flatnonzero(state.speeds):
            (gap, rate, slip, *arm), other = motion[number], (number + 2) % 4
            beside = -motion[other][0] if state.speeds[other] > 0.0 else 0.0
            normal = self.page.normal(-gap, beside, -rate, state.speeds[number])
            force += corner_load(1 - 2 * (number % 2), normal, friction(*self.page.rub, normal, slip), *arm)
        return force

    def steepness(self, stiffness, depth, rate, speed):
        """Most that a contact's force grows by its depth (N/m) and by the rate (N s/m), and its size (N)."""
        c = self.numbers
        elastic, slope = stiffness * depth**c.n, c.n * stiffness * depth ** (c.n - 1.0)
        if self.page.law == "adams-impact":
            # The cubic's slope is 1.5 in the middle.
            return slope + 1.5 * c.c_max / c.d_max * abs(rate), c.c_max, elastic + c.c_max * abs(rate)
        damping = max(1.0, 1.0 - c.C * rate / speed)
        return slope * damping, elastic * c.C / speed, elastic * damping

    def force_bound(self, state):
        """How far the contact forces (N) of two models may be apart, all corners together.

        Gaps are differences of coordinates of 0.55 m and round at 1e-16 m: 1e-15 m after some operations.
        They count with the slope of the force, and with Eq. 11 where the approach exceeds the impact speed;
        rates, that round at 1e-15 m/s, with that of the damping. Friction on its ramp counts slips, rounded
        likewise, with its slope.
        """
        c = self.numbers
        bound = 0.0
        for number in np.flatnonzero(state.speeds):
            gap, rate, _, _, _ = self.corner(state, int(number))
            slope, damping, force = self.steepness(c.K, -gap, rate, state.speeds[number])
            if state.speeds[(int(number) + 2) % 4] > 0.0 and self.page.law == "paper-switching":
                # The surface's slopes by both depths: 2/6 + 1/6 of K_s.
                slope += 0.5 * c.Ks
                force = slope * -gap
            bound += (slope + damping) * 1e-15 + 1e-12 * force + force * 1e-15 / (c.v1 - c.v0)
        return bound


SITUATIONS = ("free", "corner", "adjacent", "opposite")
SLIPS = ("none", "ramp", "full")


def draw(press, rng, situation, slip):
    """Draw a state with this contact situation whose first touching corner slips in this regime of Eq. 13."""
    data = press.data
    c, length = data["clearance"]["slider"], data["mechanism"]["slider"]["length"]
    width = data["mechanism"]["slider"]["width"]
    v0, v1 = data["friction"]["static_speed"], data["friction"]["transition_speed"]
    side, end = rng.choice([-1, 1], 2)
    depth = rng.uniform(1e-8, 5e-6)
    if situation == "free":
        offset, angle = rng.uniform(-0.5 * c, 0.5 * c), rng.uniform(-0.5, 0.5) * c / length
    elif situation == "corner":
        angle = -side * end * rng.uniform(0.2, 0.8) * 2.0 * c / length
        offset = side * (c + depth) + end * angle * length / 2.0 + side * width / 2.0 * angle**2 / 2.0
    elif situation == "adjacent":
        angle = rng.uniform(-1.0, 1.0) * depth / length
        offset = side * (c + depth)
    else:
        angle = -side * end * 2.0 * (c + 3e-6 + depth) / length
        offset = rng.uniform(-1e-6, 1e-6)
    number = (0 if end < 0 else 2) + (0 if side < 0 else 1)
    speeds = np.zeros(4)
    other = {"adjacent": [(number + 2) % 4], "opposite": [3 - number]}
    touching = [number, *other.get(situation, [])] if situation != "free" else []
    speeds[touching] = rng.uniform(1e-4, 0.05, len(touching))
    # Rates of both signs up to some impact speeds: the damping factor is also clipped.
    vx, w = rng.normal(0.0, 0.1), rng.normal(0.0, 1.0)
    wanted = {"none": rng.uniform(-v0, v0), "ramp": rng.choice([-1, 1]) * rng.uniform(v0, v1), "full": None}
    time = rng.uniform(0.0, 0.4)
    x = data["mechanism"]["guide_x"] + offset
    state = press.state(time, x, angle, vx, w, speeds)
    if wanted[slip] is not None:
        # A spin moves the corner along the guide by w r_x.
        rx = press.corner(state, number)[3]
        w = (wanted[slip] - state.v[13]) / rx
        state = press.state(time, x, angle, vx, w, speeds)
    return state


def states(press, count):
    """Draw so many states of each contact situation and friction regime."""
    rng = np.random.default_rng(3)
    for situation, slip in product(SITUATIONS, SLIPS):
        for _ in range(count):
            yield draw(press, rng, situation, slip)
