"""Clearance of the crank pin: its force alone, its bodies' accelerations, and the press with it."""

import cmath
import math

import exudyn as exu
import numpy as np
import pytest
from exudyn.itemInterface import NodeRigidBody2D, ObjectGenericODE2, ObjectRigidBody2D

from exudyn_model import plain_journal, simulate
from exudyn_model.accelerations import linkage_record
from exudyn_model.assembly import pins
from exudyn_model.contact_memory import EVENT
from exudyn_model.journal import force_user_function, journal_force, journal_law, renew_pin
from exudyn_model.loose_pin import loose_pin_acceleration
from exudyn_model.point_contact import PIN, contact_states, slip_regime
from exudyn_model.scene_reading import read_scene
from exudyn_model.solver import Steps, settings

CRANK_PIN = {"joints.crank_pin": "clearance", "joints.slider": "ideal"}
BOTH = {"joints.crank_pin": "clearance"}
STEP = 2e-6


def pin_parameters(make_scene, changes=None):
    return read_scene(make_scene(CRANK_PIN | (changes or {})))


def pin_state(parameters, direction, distance, angles):
    """Coordinates of crank and rod 2 whose pin is ``distance`` off centre, journal from bearing."""
    mechanism = parameters.mechanism
    crank, rod2 = 0.3 + 0.1j, 0.0
    rod2 = crank + mechanism.crank.to_tip * cmath.exp(1j * angles[0])
    rod2 -= distance * cmath.exp(1j * direction) - mechanism.rod2.centroid * cmath.exp(1j * angles[1])
    return [crank.real, crank.imag, angles[0], rod2.real, rod2.imag, angles[1]]


def closed_pins(parameters, count, seed):
    """Random states in contact: coordinates, velocities, memory whose regime fits the slip."""
    random, mechanism = np.random.default_rng(seed), parameters.mechanism
    radius = parameters.journal.radius + parameters.journal.clearance
    for _ in range(count):
        direction, angles = random.uniform(0, 2 * np.pi), random.uniform(0, 2 * np.pi, 2)
        distance = parameters.journal.clearance + random.uniform(1e-7, 3e-6)
        q = pin_state(parameters, direction, distance, angles)
        v = [*random.normal(0, 0.05, 2), random.normal(0, 1), *random.normal(0, 0.05, 2), random.normal(0, 1)]
        # Velocity of both materials in the same point, on the bearing's surface
        point = radius * cmath.exp(1j * direction)
        arm2 = point - mechanism.rod2.centroid * cmath.exp(1j * angles[1])
        arm1 = (
            point - distance * cmath.exp(1j * direction) + mechanism.crank.to_tip * cmath.exp(1j * angles[0])
        )
        relative = complex(*v[3:5]) + 1j * v[5] * arm2 - complex(*v[:2]) - 1j * v[2] * arm1
        slip = (relative * cmath.exp(-1j * direction)).imag
        contacts = contact_states()
        contacts[PIN]["impact_speed"] = 0.2
        contacts[PIN]["regime"] = slip_regime(slip, journal_law(parameters, STEP)[0])
        yield q, v, contacts, slip


def test_compiled_and_plain_form_agree(make_scene):
    parameters = pin_parameters(make_scene)
    law, seen = journal_law(parameters, STEP), 0
    for number, (q, v, contacts, _) in enumerate(closed_pins(parameters, 200, 3)):
        if number % 2:  # touched within the step
            contacts["impact_speed"], contacts["gap"], contacts["rate"] = 0.0, 1e-6, -0.2
        compiled = journal_force(*q, *v, law, contacts)
        plain = plain_journal.journal_force(q, v, parameters.journal, parameters.mechanism, STEP, contacts)
        # Depths down to 1e-7 m from coordinates of 0.3 m, rounded at 5e-17 m
        np.testing.assert_allclose(compiled, plain, rtol=1e-7, atol=1e-9)
        seen += compiled[3] != 0
    assert seen > 150  # the others part so fast that the force is clipped


def test_force_is_the_negative_gradient_of_the_elastic_energy(make_scene):
    elastic = {"contact.restitution": 1.0, "friction.coefficient": 0.0}
    parameters = pin_parameters(make_scene, elastic)
    law, journal, mechanism = journal_law(parameters, STEP), parameters.journal, parameters.mechanism

    def energy(q):
        crank_tip = complex(q[0], q[1]) + mechanism.crank.to_tip * cmath.exp(1j * q[2])
        bearing = complex(q[3], q[4]) - mechanism.rod2.centroid * cmath.exp(1j * q[5])
        depth = max(abs(crank_tip - bearing) - journal.clearance, 0)
        return journal.stiffness * depth**2.5 / 2.5

    for q, v, contacts, _ in closed_pins(parameters, 10, 5):
        force = np.array(journal_force(*q, *v, law, contacts))
        for number in range(6):
            dq = 1e-9 if number % 3 < 2 else 1e-8
            ends = [energy([*q[:number], q[number] + s * dq, *q[number + 1 :]]) for s in (-1, 1)]
            # Differences over 1e-9 m of depths from 1e-7 m on; round-off of 5e-17 m times forces of 1000 N
            # over 1e-9
            assert force[number] == pytest.approx(-(ends[1] - ends[0]) / (2 * dq), rel=1e-3, abs=2e-4)


def test_friction_takes_power_from_the_slip_of_both_materials(make_scene):
    """Arms and signs at once: the generalized forces' power is that of friction on the slip."""
    parameters = pin_parameters(make_scene)
    smooth = pin_parameters(make_scene, {"friction.coefficient": 0.0})
    law, without = journal_law(parameters, STEP), journal_law(smooth, STEP)
    seen = set()
    for q, v, contacts, slip in closed_pins(parameters, 100, 7):
        force, normal = (np.array(journal_force(*q, *v, each, contacts)) for each in (law, without))
        share = min(max((abs(slip) - 1e-4) / 9e-4, 0), 1)
        lost = 0.15 * share * np.hypot(*normal[3:5]) * abs(slip)
        assert (force - normal) @ v == pytest.approx(-lost, rel=1e-8, abs=1e-10)
        # Action and reaction, and no moment about any point
        np.testing.assert_allclose(force[:2], -force[3:5], rtol=1e-14)
        moments = [
            f[2] + c.real * f[1] - c.imag * f[0]
            for f, c in ((force[:3], complex(*q[:2])), (force[3:], complex(*q[3:5])))
        ]
        assert sum(moments) == pytest.approx(0.0, abs=1e-11 * np.hypot(*force[:2]))
        seen.add(np.sign(slip))
    assert seen == {-1.0, 1.0}


def full_accelerations(parameters, q, v, pin_force, slider_force):
    """Accelerations of the slider from all 15 equations of motion, without the rows of joint A."""
    mechanism = parameters.mechanism
    mass, applied = np.zeros((15, 15)), np.zeros(15)
    bodies = [mechanism.crank, mechanism.rod2, mechanism.rocker, mechanism.rod4, mechanism.slider]
    for k, body in enumerate(bodies):
        mass[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = np.diag([body.mass, body.mass, body.inertia])
        applied[3 * k + 1] = -body.mass * mechanism.gravity
    applied[3:6] += pin_force
    applied[12:] += slider_force
    rows, gamma = [], []
    for pin in pins(mechanism):
        if pin.name == "A":
            continue
        block, right = np.zeros((2, 15)), np.zeros(2)
        for sign, body, point in ((1, pin.second, pin.second_point), (-1, pin.first, pin.first_point)):
            if body >= 0:
                angle, speed = q[3 * body + 2], v[3 * body + 2]
                arm = point[0] * np.array([math.cos(angle), math.sin(angle)])
                block[:, 3 * body : 3 * body + 3] += sign * np.array([[1, 0, -arm[1]], [0, 1, arm[0]]])
                right += sign * speed**2 * arm
        rows.append(block)
        gamma.append(right)
    fixed = [2, 12, 14] if mechanism.ideal_slider else [2]
    jacobian = np.vstack([*rows, np.eye(15)[fixed]])
    count = len(jacobian)
    matrix = np.block([[mass, jacobian.T], [jacobian, np.zeros((count, count))]])
    return np.linalg.solve(matrix, np.concatenate([applied, *gamma, np.zeros(len(fixed))]))[12:15]


@pytest.mark.parametrize("joints", [CRANK_PIN, BOTH])
def test_accelerations_satisfy_the_full_equations_of_motion(make_scene, joints):
    parameters = read_scene(make_scene(joints))
    linkage, random = linkage_record(parameters)[0], np.random.default_rng(11)
    for _ in range(20):
        # Angles and their rates alone enter
        q, v = random.uniform(0, 6, 15), random.normal(0, 10, 15)
        pin_force, force = random.normal(0, 100, 3), random.normal(0, 30, 3)
        if parameters.mechanism.ideal_slider:
            force[:] = 0.0
        found = loose_pin_acceleration(q, v, *pin_force, *force, linkage)
        expected = full_accelerations(parameters, q, v, pin_force, force)
        # Round-off of two systems with masses down to 1e-5 kg m^2
        np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8 * np.max(np.abs(expected)))


def fly(make_scene, restitution, steps):
    """Relative speed after an impact of two free bodies through the journal, over that before."""
    changes = {
        "contact.restitution": restitution,
        "friction.coefficient": 0.0,
        "clearance.crank_pin": 1.0437e-5,
    }
    for rod in ("crank", "rod2"):
        changes[f"mechanism.{rod}.length"] = changes[f"mechanism.{rod}.centroid"] = 0.0
    speed, duration = 0.05, 4e-4
    parameters = pin_parameters(make_scene, changes)
    law, contacts, events = journal_law(parameters, duration / steps), contact_states(), np.zeros(4, EVENT)
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    nodes = []
    # Obliquely, at no special angle
    for sign, mass in ((0.5, 0.02), (-0.5, 0.1)):
        velocity = sign * speed * cmath.exp(0.7j)
        nodes.append(mbs.AddNode(NodeRigidBody2D(initialVelocities=[velocity.real, velocity.imag, 0.0])))
        mbs.AddObject(ObjectRigidBody2D(mass=mass, inertia=1e-5, nodeNumber=nodes[-1]))
    mbs.AddObject(
        ObjectGenericODE2(
            nodeNumbers=nodes,
            massMatrix=np.zeros((6, 6)),
            forceUserFunction=force_user_function(law, contacts),
        )
    )
    mbs.Assemble()
    count, done = 0, 0

    def before_step(mbs, _):
        nonlocal count, done
        q, v = mbs.systemData.GetODE2Coordinates(), mbs.systemData.GetODE2Coordinates_t()
        count = renew_pin(done, q, v, law, contacts, events, count)[0]
        done += 1
        return True

    mbs.SetPreStepUserFunction(before_step)
    mbs.SolveDynamic(settings(Steps(duration, 1, steps), "generalized-alpha", 1e-9, 8))
    v = mbs.systemData.GetODE2Coordinates_t()
    assert count == 1
    return np.hypot(v[0] - v[3], v[1] - v[4]) / speed


# ln[(1+C)/(1-C e)] = C(1+e) with C = 3(1-c_e^2)/4, solved to ten digits
@pytest.mark.parametrize(("coefficient", "exact"), [(0.9, 0.9131766778), (0.1, 0.6652654068)])
def test_restitution_converges_to_the_exact_value_at_second_order(make_scene, coefficient, exact):
    counts = [200, 400, 800, 1600, 3200]
    errors = [abs(fly(make_scene, coefficient, n) - exact) for n in counts]
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    # Where in its step the touch falls differs from step to step: the errors scatter about the line
    assert order == pytest.approx(2.0, abs=0.3), errors
    # 24 us of contact in 195 steps: (pi / 195)^2 / 12 = 2e-5 for a half-wave
    assert errors[-1] < 3e-5


def test_residual_of_the_energy_is_of_second_order(make_scene):
    """The first 9 ms with two impacts of up to 1.6 kN; the second one's friction reverses and holds."""
    changes = CRANK_PIN | {
        "drive.cycles": 0.0225,
        "output.groups": ["energy"],
        "output.samples_per_cycle": 10_000,
    }
    steps = [2e-6, 1e-6, 5e-7]
    runs = [
        simulate(make_scene(changes | {"solver.exudyn.step": h, "solver.exudyn.method": "auto"})).columns
        for h in steps
    ]
    errors = [np.max(np.abs(columns["energy_residual"])) for columns in runs]
    # Where friction reaches its pieces falls somewhere into a step; 2.0 measured
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.3), errors
    for name in ("damping", "friction"):
        lost = runs[-1][f"energy_{name}"]
        assert np.all(np.diff(lost) >= 0)
        assert lost[-1] > 100 * errors[-1]
    assert np.max(runs[-1]["energy_contact"]) > 1e-3


def test_slider_strays_as_far_as_the_pin_s_play_lets_it(make_scene, ideal_y):
    scene = make_scene(CRANK_PIN | {"drive.cycles": 1.0, "solver.exudyn.step": 4e-6})
    angles = np.radians(111.36 + np.linspace(0, 360, 721))
    shifts = 2e-4 * np.exp(1j * np.linspace(0, 2 * np.pi, 181))
    rigid = np.array([np.max(np.abs(ideal_y(scene, angles, s) - ideal_y(scene, angles, 0))) for s in shifts])
    # Of the identified geometry: at most 5.67e-4 m
    assert np.max(rigid) == pytest.approx(5.67e-4, abs=1e-6)
    result = simulate(scene)
    assert result.status == "success"
    time = result.columns["time"]
    ideal = ideal_y(scene, np.radians(111.36) + 5 * np.pi * time, 0)
    error = np.max(np.abs(result.columns["slider_y"] - ideal))
    deepest = np.max(result.events["largest_depth"])
    assert error <= np.max(rigid) * (2e-4 + deepest) / 2e-4
    assert error > 0.8 * np.max(rigid)
    assert set(result.events["corner"]) == {"pin"}


def test_no_clearance_is_the_ideal_pin(make_scene, ideal_y):
    """Down to 1 um, where the pin's elastic play is of the same size."""
    scene = make_scene(CRANK_PIN)
    errors = []
    for clearance in (1e-4, 1e-5, 1e-6):
        changes = CRANK_PIN | {"clearance.crank_pin": clearance, "drive.cycles": 0.1}
        result = simulate(make_scene(changes))
        ideal = ideal_y(scene, np.radians(111.36) + 5 * np.pi * result.columns["time"], 0)
        errors.append(np.max(np.abs(result.columns["slider_y"] - ideal)))
        assert errors[-1] < 2.84 * (clearance + np.max(result.events["largest_depth"]))
    assert errors[0] > 5 * errors[1] > 10 * errors[2]


def test_pin_settles_into_static_equilibrium(make_scene):
    """At creep speed and with the strongest damping: joint A bears what it bears without clearance."""
    changes = {
        "joints.slider": "ideal",
        "drive.speed_rpm": 0.1,
        "drive.cycles": 5e-5,
        "mechanism.crank_angle_deg": 60.0,
        "contact.restitution": 0.0,
        "friction.coefficient": 0.0,
        "clearance.crank_pin": 1e-6,
        "output.groups": ["joints"],
        "solver.exudyn.method": "auto",
        "solver.exudyn.step": 1e-6,
        "output.samples_per_cycle": 200_000,
    }
    loose = simulate(make_scene(changes | {"joints.crank_pin": "clearance"}))
    ideal = simulate(make_scene(changes)).columns
    for name in ("reaction_A_x", "reaction_A_y", "reaction_H_y", "crank_torque", "guide_force"):
        scale = 1.0 if name != "crank_torque" else 0.045
        # Of forces of some 10 N; the bounces of some 1e-8 m have not quite died away
        assert loose.columns[name][-1] == pytest.approx(ideal[name][-1], abs=1e-2 * scale), name
    assert loose.events["end"][-1] == pytest.approx(0.03)
    force = np.hypot(ideal["reaction_A_x"][-1], ideal["reaction_A_y"][-1])
    assert force > 1


def test_channels_and_events(make_scene):
    short = {
        "drive.cycles": 0.05,
        "output.groups": ["accelerations", "corners", "joints", "energy"],
        "solver.exudyn.method": "auto",
    }
    pin = simulate(make_scene(CRANK_PIN | short))
    assert not [name for name in pin.columns if name.startswith("corner")]
    assert {"reaction_A_x", "reaction_A_y", "guide_force", "guide_moment"} < set(pin.columns)
    assert set(pin.columns) - {"time"} == set(pin.extrema)
    both = simulate(make_scene(BOTH | short))
    assert {"corner_ll_gap", "reaction_A_x", "energy_residual"} < set(both.columns)
    assert "guide_force" not in both.columns
    assert {"pin"} < set(both.events["corner"]) <= {"pin", "ll", "lr", "ul", "ur"}
    for result in (pin, both):
        force = np.hypot(result.columns["reaction_A_x"], result.columns["reaction_A_y"])
        time, events = result.columns["time"], result.events
        closed = np.zeros(len(time), bool)
        for start, end in zip(events["start"], events["end"], strict=True):
            if events["corner"][events["start"] == start][0] == "pin":
                closed |= (time > start) & (time < end)
        # Force exactly while the pin's journal is in contact
        assert np.array_equal(force > 0, closed)
        # of normal force N and friction up to 0.15 N
        peak = np.max(events["peak_force"][events["corner"] == "pin"])
        assert peak <= np.hypot(
            max(
                abs(v) for v in (result.extrema["reaction_A_x"]["min"], result.extrema["reaction_A_x"]["max"])
            ),
            max(
                abs(v) for v in (result.extrema["reaction_A_y"]["min"], result.extrema["reaction_A_y"]["max"])
            ),
        )
        assert np.max(force) <= peak * math.hypot(1, 0.15)


def test_mirrored_scene_gives_mirrored_motion(make_scene, mirrored):
    """Both clearances; friction and its arms change their side."""
    common = BOTH | {"drive.cycles": 0.03, "solver.exudyn.step": 1e-6}
    there, back = simulate(make_scene(common)), simulate(make_scene(common | mirrored))
    assert len(there.events["start"]) == len(back.events["start"]) >= 2
    for name, sign in {"slider_x": -1, "slider_y": 1, "slider_angle": -1, "slider_vy": 1}.items():
        scale = np.max(np.abs(there.columns[name]))
        # Rounded differently; impacts of kN magnify what Newton's iteration leaves
        np.testing.assert_allclose(back.columns[name], sign * there.columns[name], rtol=0, atol=1e-6 * scale)
