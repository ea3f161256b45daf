"""The equations of motion from the same states: what Exudyn assembles, and accelerations."""

from dataclasses import replace

import exudyn as exu
import numpy as np
import pytest
from press_states import Press, states
from reference_states import (
    JOURNAL,
    Bearing,
    by_formulation,
    friction_regime,
    masses_and_weights,
    new_modes,
)
from reference_states import rows_of as reference_rows

from exudyn_model.five_bodies import balance
from exudyn_model.five_bodies.system import build
from exudyn_model.five_bodies.system import press_system as as_lists
from exudyn_model.linkage import InitialState, driven_rod4
from exudyn_model.tree.building import build_tree
from exudyn_model.workpiece import workpiece_array, workpiece_forces
from reference_model.workpiece import load_energy, load_force

STEP = 2e-6
EACH = 5  # of each situation and slip: 60 states
DRIVER_ROW = 12
# A workpiece over most of the slider's way, which ends at -0.035 m and begins 0.19 m above
POWER = {"load.surface": 0.15, "load.force": 300.0, "load.depth": 0.1}
ROWS = [[0.0, 0.0], [0.03, 500.0], [0.05, 0.0], [0.09, 200.0]]
TABLE = {"load.surface": 0.15, "load.table": ROWS}
LOADS = {"idle": {}, "power": POWER, "table": TABLE}
CASES = {
    "hertz-corners": {},
    "paper-switching": {"contact.law": "paper-switching"},
    "adams-impact": {"contact.law": "adams-impact", "contact.damping_depth": 2e-6},
    "adams-impact, power": {"contact.law": "adams-impact", **POWER},
    "table": TABLE,
}
each_case = pytest.mark.parametrize("changes", CASES.values(), ids=CASES)


class Assembled:
    """Mass matrix, right-hand side and constraint Jacobian as Exudyn itself puts them together in a state."""

    def __init__(self, model):
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        settings.solution.sensors.active = False
        settings.timeIntegration.verboseMode = 0
        settings.linearSolver.solverType = exu.LinearSolverType.EXUdense
        console, exu.config.printToConsole = exu.config.printToConsole, False
        solver = exu.MainSolverImplicitSecondOrder()
        assert solver.InitializeSolver(model.mbs, settings)
        exu.config.printToConsole = console
        size, rows = solver.GetODE2size(), solver.GetAEsize()
        solver.ComputeMassMatrix(model.mbs)
        self.mass = np.array(solver.GetSystemMassMatrix())
        solver.ComputeODE2RHS(model.mbs)
        self.force = np.array(solver.GetSystemResidual())[:size]
        solver.SetSystemJacobian(np.zeros((size + rows, size + rows)))
        solver.ComputeJacobianAE(model.mbs)
        # The block that multiplies the Lagrange multipliers: the drive's row is of velocity level.
        self.jacobian = np.array(solver.GetSystemJacobian())[:size, size:].T
        solver.FinalizeSolver(model.mbs, settings)


def five_bodies(press, state):
    start = InitialState(state.q.reshape(5, 3), state.v.reshape(5, 3))
    model = build(as_lists(press.exudyn, start), STEP)
    model.contacts["impact_speed"][:4], model.contacts["closed"][:4] = state.speeds, state.speeds > 0.0
    return Assembled(model)


def balanced(press, q, v, loads):
    """Slider's accelerations by the Exudyn model's own balance, with loads on the bodies (15,)."""
    system = as_lists(press.exudyn, InitialState(q.reshape(5, 3), v.reshape(5, 3)))
    q = (q - system.reference)[:, None]
    computed = balance.constraints(system, np.zeros(1), q, v[:, None])
    force = np.array(loads, dtype=float)
    force[1::3] -= system.gravity * system.masses[1::3]
    return balance.accelerations(system, computed, force[:, None])[0][12:, 0]


def rows_of(press, state):
    """Phi, Phi', Phi_q and gamma of the reference."""
    return reference_rows(press.reference, state.time, state.q, state.v)


def by_reference(press, state, formulation, head):
    """Contacts (6, 5), motion of all bodies (5, 9) of one formulation in one state."""
    return by_formulation(press.reference, formulation, state.time, head, press.modes(state))


def minimal_head(state):
    return state.q[[11, 14]].tolist() + state.v[[11, 14]].tolist()


def contact_force(press, state, contacts):
    """Fx, Fy (N) and moment (N m) on the slider from contact states."""
    force = np.zeros(3)
    for number in range(4):
        _, _, _, rx, ry = press.corner(state, number)
        fx = (1 if number % 2 == 0 else -1) * contacts["normal"][number]
        force += [fx, contacts["friction"][number], rx * contacts["friction"][number] - ry * fx]
    return force


@pytest.mark.parametrize("changes", [POWER, *(POWER | {"load.exponent": q} for q in (1.0, 400.0)), TABLE])
def test_the_load_is_that_of_the_page(changes):
    """Force and energy of both models at heights above, in and below each row of the table."""
    press = Press(changes)
    depths = np.concatenate([np.linspace(-0.05, 0.19, 481), [row[0] for row in ROWS]])
    heights = 0.15 - depths
    page = np.array([press.page.pressed(y) for y in heights]).T
    workpiece = workpiece_array(press.exudyn.load)
    load = press.reference.load
    for of in (
        workpiece_forces(heights, workpiece),
        (load_force(load, heights), load_energy(load, heights)),
    ):
        # Heights round at 3e-17 m, with slopes up to 25 kN/m; sums of the table's ramps at 1e-16 of 2 kN.
        # A power multiplies the rounding of a relative depth by its exponent; 0.1^400 is no number.
        rtol = 1e-16 * max(100.0, changes.get("load.exponent", 1.0))
        np.testing.assert_allclose(of, page, rtol=rtol, atol=3e-12)
    # Beyond its last row a table keeps that row's force, which stores force times way.
    assert page[0, 480] > 190.0
    assert (page[0] == 0.0).sum() >= 100


@each_case
def test_mass_matrix_jacobian_and_forces_act_alike(changes):
    """What Exudyn assembles from bodies and joints against M, Phi_q and Q of Eqs. 15-16, to 1e-12."""
    press = Press(changes)
    mass, weights = masses_and_weights(press.reference)
    rng = np.random.default_rng(11)
    for state in states(press, EACH):
        assembled = five_bodies(press, state)
        phi, rate, jacobian, _ = rows_of(press, state)
        # Else all that follows would compare two models outside of what either is written for.
        assert np.abs(phi).max() <= 1e-14  # lengths near 1 m, some operations
        assert np.abs(rate).max() <= 1e-13  # times 16 rad/s
        np.testing.assert_allclose(assembled.mass, np.diag(mass), rtol=1e-12)
        for own, theirs in ((jacobian, assembled.jacobian), (jacobian.T, assembled.jacobian.T)):
            some = rng.normal(size=(own.shape[1], 3))
            action = own @ some
            assert np.all(np.abs(theirs @ some - action) <= 1e-12 * np.abs(action).max(axis=0))
        contacts, _ = by_reference(press, state, "slider", minimal_head(state))
        expected = weights.copy()
        expected[12:] += contact_force(press, state, contacts)
        expected[13] += press.page.pressed(state.q[13])[0]
        # And of the weights; of the load by its slope of 25 kN/m.
        bound = press.force_bound(state) + (1e-11 if press.exudyn.load else 1e-15)
        np.testing.assert_allclose(assembled.force, expected, rtol=0, atol=bound)


@each_case
def test_accelerations_agree(changes):
    """Reference by two formulations; the Exudyn model's own balance, its tree, and its assembled five bodies.

    Within the force's bound over the effective mass, 0.0195 kg for a corner, plus 1e-11 of scale.
    """
    press = Press(changes)
    inertia, arm = press.exudyn.mechanism.slider.inertia, press.exudyn.mechanism.slider.length / 2.0
    touched = loaded = 0
    for state in states(press, EACH):
        contacts, few = by_reference(press, state, "slider", minimal_head(state))
        force = contact_force(press, state, contacts)
        touched += force.any()
        load = press.page.pressed(state.q[13])[0]
        force[1] += load
        loaded += load > 50.0
        computed = {
            "multiplier": by_reference(press, state, "multiplier", [*state.q, *state.v])[1][4, 6:],
            "balance": balanced(press, state.q, state.v, [*np.zeros(12), *force]),
            "five bodies": saddle_point(press, state)[12:15],
            "tree": tree_acceleration(press, state),
        }
        bound = press.force_bound(state) + 1e-13 * load
        scale = np.abs(few[4, 6:8]).max() + 50.0  # of C, 50 m/s^2 and more
        turning = arm * 1.3 * bound / inertia + 1e-11 * (abs(few[4, 8]) + scale / arm)
        for name, value in computed.items():
            error = np.abs(np.asarray(value) - few[4, 6:])
            assert error[:2].max() <= bound / 0.0195 + 1e-11 * scale, name
            assert error[2] <= turning, name
    assert touched >= 30  # of 45; some are clipped
    assert loaded >= 20 or press.exudyn.load is None


def saddle_point(press, state):
    """Accelerations and multipliers of what Exudyn assembles, with the reference's gamma."""
    assembled, (_, _, _, gamma) = five_bodies(press, state), rows_of(press, state)
    matrix = np.block([[assembled.mass, assembled.jacobian.T], [assembled.jacobian, np.zeros((13, 13))]])
    return np.linalg.solve(matrix, np.concatenate([assembled.force, gamma]))


def tree_acceleration(press, state):
    """Slider's accelerations from what Exudyn assembles for rod 4 and slider alone, in the frame of C."""
    start = InitialState(state.q.reshape(5, 3), state.v.reshape(5, 3))
    mechanism = press.exudyn.mechanism
    # The tree's time is that of its solver, which starts at 0: the crank starts where it is by then.
    mechanism = mechanism._replace(crank_angle=mechanism.crank_angle + mechanism.omega * state.time)
    model = build_tree(replace(press.exudyn, mechanism=mechanism), start)
    model.contacts["impact_speed"][:4] = state.speeds
    assembled = Assembled(model)
    ahead, alpha5 = np.linalg.solve(assembled.mass, assembled.force)
    *_, ideal = driven_rod4(0.0, model.press_record[0]["mechanism"])
    alpha4 = ideal + ahead
    # Acceleration of C: the rocker turns as the reference's four-bar has it; here by the closed chain H-C.
    w3, angle3 = state.v[8], state.q[8]
    _, _, jacobian, gamma = rows_of(press, state)
    # Rows of O, A, H, B and the drive fix the first three bodies alone.
    rows = [0, 1, 2, 3, 4, 5, 6, 7, DRIVER_ROW]
    alpha3 = np.linalg.solve(jacobian[rows][:, :9], gamma[rows])[8]
    length3, length4 = (press.data["mechanism"][k]["length"] for k in ("rocker", "rod4"))
    w4, angle4 = state.v[11], state.q[11]
    a = length3 * (1j * alpha3 - w3 * w3) * np.exp(1j * angle3)
    a += length4 * (1j * alpha4 - w4 * w4) * np.exp(1j * angle4)
    return a.real, a.imag, alpha5


def chain_acceleration(press, time, bodies, speed):
    """Slider's accelerations from what Exudyn assembles for the tree that hangs from H, from those angles.

    Without contacts at the slider; `speed` is that of the journal's impact, m/s.
    """
    mechanism, ideal = press.exudyn.mechanism, press.exudyn.guide is None
    mechanism = mechanism._replace(crank_angle=mechanism.crank_angle + mechanism.omega * time)
    start = InitialState(bodies[:, :3].copy(), bodies[:, 3:6].copy())
    model = build_tree(replace(press.exudyn, mechanism=mechanism), start)
    model.contacts["impact_speed"][JOURNAL] = speed
    assembled = Assembled(model)
    # Of rocker, rod 2 and rod 4 against the rocker, slider against rod 4.
    ahead = np.linalg.solve(assembled.mass, assembled.force)
    alpha3, alpha4 = ahead[0], ahead[0] + ahead[2]
    a, at = 0j, ((2, "rocker", alpha3), (3, "rod4", alpha4))
    for body, name, alpha in at:
        w, angle = bodies[body, 5], bodies[body, 2]
        a += press.data["mechanism"][name]["length"] * (1j * alpha - w * w) * np.exp(1j * angle)
    return a.real, a.imag, 0.0 if ideal else alpha4 + ahead[3]


@pytest.mark.parametrize("load", LOADS)
@pytest.mark.parametrize("law", ["hertz-corners", "adams-impact"])
@pytest.mark.parametrize("slider", ["clearance", "ideal"])
def test_accelerations_behind_a_crank_pin_with_clearance_agree(slider, law, load):
    """Chain of four or two angles (reference) against four equations with the guide's (Exudyn model).

    And against what Exudyn assembles for its tree, which has the journal's force and the load from the model.
    """
    joints = {"joints.crank_pin": "clearance", "joints.slider": slider}
    press = Press({**joints, "contact.law": law, "contact.damping": 3e4, **LOADS[load]})
    kind, c = "both" if slider == "clearance" else "pin", press.numbers
    rng = np.random.default_rng(4)
    shift = np.array([1e-3, 1e-3, 1e-3, 1e-3, 1.0, 1.0, 1.0, 1.0])
    pressed = loaded = 0
    for _ in range(100):
        time = rng.uniform(0.0, 0.4)
        x = press.data["mechanism"]["guide_x"] + (5e-5 if slider == "ideal" else rng.uniform(-1e-4, 1e-4))
        state = press.state(time, x, 0.0, 0.0, 0.0, np.zeros(4))
        head = np.concatenate([state.q[[5, 8, 11, 14]], state.v[[5, 8, 11, 14]]])
        if slider == "ideal":
            head = head[[0, 1, 4, 5]] + shift[[0, 1, 4, 5]] * rng.normal(size=4)
        else:
            head += shift * rng.normal(size=8)
        modes = new_modes()
        contacts, bodies = by_formulation(press.reference, kind, time, head, modes)
        pin = contacts[JOURNAL]
        if pin["gap"] < 0.0:  # a force only where the pin touches
            pulls = press.pulls(c.Kj, pin["gap"], pin["rate"], 10.0)
            modes[JOURNAL] = 10.0, friction_regime(c, pin["slip"]), pulls, True
            contacts, bodies = by_formulation(press.reference, kind, time, head, modes)
        # The pin's force on rod 2 and the point where it acts, as the reference has them.
        ends = [press.data["mechanism"]["rod2"][k] for k in ("centroid", "length")]
        u2 = np.exp(1j * bodies[1, 2])
        start = complex(*bodies[1, :2]) - ends[0] * u2
        velocity = complex(*bodies[1, 3:5]) - 1j * bodies[1, 5] * ends[0] * u2
        at = Bearing(press.reference, time, start, velocity, bodies[1, 5])
        G, normal = at.force(modes)
        pin = (G.real, G.imag, at.point.real, at.point.imag)
        pressed += normal > 0.0
        arm = (pin[2] - bodies[1, 0], pin[3] - bodies[1, 1])
        moment = arm[0] * pin[1] - arm[1] * pin[0]
        q, v = bodies[:, :3].ravel(), bodies[:, 3:6].ravel()
        push = press.page.pressed(bodies[4, 1])[0]
        loaded += push > 50.0
        loads = [0.0, 0.0, 0.0, pin[0], pin[1], moment, *np.zeros(7), push, 0.0]
        computed = balanced(press, q, v, loads)
        scale = np.abs(bodies[:, 6:8]).max() + 50.0
        tree = chain_acceleration(press, time, bodies, 10.0 * (normal > 0.0))
        for value in (computed, tree):
            assert np.abs(np.array(value[:2]) - bodies[4, 6:8]).max() <= 1e-11 * scale
            assert abs(value[2]) <= 1e-11 * scale / 0.04  # of rounding
        assert bodies[4, 8] == 0.0
    assert pressed >= 30
    assert loaded >= 40 or load == "idle"
