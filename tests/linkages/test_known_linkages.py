"""Both models on linkages whose motion is published or has a closed form, and scenes that both refuse."""

import importlib
import math

import numpy as np
import pytest
from linkage_oracle import solve
from scipy.integrate import quad
from scipy.interpolate import make_interp_spline
from scipy.special import ellipj, ellipk

from comparison.scene import load_scene
from comparison.tables.channels import expected

SETTING = {"reference_model": "solver.reference.tolerance", "exudyn_model": "solver.exudyn.step"}
EACH = pytest.mark.parametrize("model", SETTING)
G = 9.81


@pytest.fixture
def load(tmp_path):
    """Return a function that gives the mapping of a shipped linkage or of a text, with keys changed."""

    def load(source, changes=None):
        if "\n" in source:
            (tmp_path / "own.toml").write_text(source, "utf-8")
            source = tmp_path / "own.toml"
        return load_scene(source, changes).data

    return load


@pytest.fixture
def run(load):
    """Return a function that simulates a mapping of ``load`` at a setting of the model."""

    def run(model, setting, source, changes=None, status="success"):
        data = load(source, {SETTING[model]: setting} | (changes or {}))
        result = importlib.import_module(model).simulate(data)
        assert result.status == status, result.remedy
        return result

    return run


def require_second_order(model, steps, errors):
    if model == "exudyn_model":
        order = np.diff(np.log(errors)) / np.diff(np.log(steps))
        np.testing.assert_allclose(order, 2.0, atol=0.05)


# Angles of the squeezer at 0.03 s, rad: beta, theta, gamma, phi, delta, omega, epsilon
ANGLES = (15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304,
         0.5347301163226948, 1.048080741042263)  # fmt: skip
SQUEEZER = {
    "reference_model": {1e-12: 1e-8, 1e-10: 1e-7, 1e-7: 1e-4},
    "exudyn_model": {1e-6: 1e-6, 4e-6: 2e-5},
}


@EACH
def test_the_squeezer_ends_where_the_test_set_for_ivp_solvers_does(model, run):
    beta, theta, gamma, phi, delta, omega, epsilon = ANGLES
    angles = np.array([beta, beta + theta, gamma, phi + delta, delta, omega + epsilon, epsilon])
    errors = []
    for setting, bound in SQUEEZER[model].items():
        columns = run(model, setting, "squeezer", {"output.samples": 100}).columns
        first = [columns[f"K{k}.alpha"][0] for k in (1, 2)]
        np.testing.assert_allclose(
            first, [14222.4439199541, 14222.4439199541 - 10666.83293996558], rtol=1e-11
        )
        errors.append(np.abs([columns[f"K{k}.angle"][-1] for k in range(1, 8)] - angles).max())
        assert errors[-1] < bound
    require_second_order(model, [*SQUEEZER[model]], errors)


LOOSE_BOB = {
    "body.bob": {"mass": 1.0, "inertia": 0.1, "length": 1.0, "centroid": 0.5},
    "pin.P": {"joins": ["frame", "bob.start"], "point": [3.0, 0.0]},
    "clearance.P": {"size": 1e-3, "contact": {"youngs_modulus": 1e7}},
    "initial.bob": {"angle_deg": 10.0, "omega": 0.0},
}


@pytest.mark.parametrize(
    ("model", "setting", "residual", "clearance"),
    [
        ("reference_model", 1e-6, 1e-3, {}),
        ("reference_model", 1e-12, 1e-9, LOOSE_BOB),
        ("exudyn_model", 1e-3, 3e-4, {}),
        ("exudyn_model", 1e-4, 3e-4, LOOSE_BOB),
    ],
)
def test_the_double_four_bar_ends_where_its_rods_lie_down(model, setting, residual, clearance, run):
    """IFToMM's A02 moves as one body until then; its energy gives the time."""
    changes = {"output.duration": 1.0, "output.samples": 100, "output.groups": ["contacts", "energy"]}
    inertia, moment = 3.0 / 3.0 + 2.0, 3.0 / 2.0 + 2.0
    duration, _ = quad(lambda x: (1 + 2 * G * moment / inertia * (1 - math.cos(x))) ** -0.5, 0, math.pi / 2)
    result = run(model, setting, "double-four-bar", changes | clearance, "singular")
    at = float(result.remedy.split("t = ")[1].split(" s:")[0])
    assert at == pytest.approx(duration, abs=2e-4)
    assert f"{at:.3f}" == "0.714"
    assert result.columns["time"][-1] == pytest.approx(0.71)
    assert result.extrema["left.angle"]["time_of_min"] <= at + 1.1e-4
    assert np.abs(result.columns["energy_residual"]).max() < residual
    assert (len(result.events["start"]) > 3) == bool(clearance)
    assert (result.events["start"] <= at).all()


PENDULUM = """
body.arm = { mass = 2.0, inertia = 0.1, centroid = [-0.24, 0.32], points = { O = [0, 0] } }
pin.O = { joins = ["frame", "arm.O"], point = [0.3, -0.2] }
drive.free = true
environment.gravity = 9.81
output = { groups = [], duration = 5.0, samples = 100 }
"""


@pytest.mark.parametrize(
    ("model", "settings", "bound"),
    [("reference_model", [1e-10, 1e-6], 2e-7), ("exudyn_model", [1e-4, 2e-4, 4e-4], 1e-6)],
)
def test_a_pendulum_swings_by_the_elliptic_functions(model, settings, bound, run):
    amplitude, inertia, offset = 2.0, 0.1 + 2.0 * 0.4**2, math.atan2(0.32, -0.24) + math.pi / 2
    k, w = math.sin(amplitude / 2.0), math.sqrt(2.0 * G * 0.4 / inertia)
    errors = []
    for setting in reversed(settings):
        start = {"initial.arm": {"angle_deg": math.degrees(amplitude - offset)}}
        result = run(model, setting, PENDULUM, start)
        columns = result.columns
        sn, *_ = ellipj(w * columns["time"] + ellipk(k * k), k * k)
        angle = 2.0 * np.arcsin(k * sn)
        errors.append(np.abs(columns["arm.angle"] - angle + offset).max())
    require_second_order(model, settings[::-1], errors)
    assert errors[-1] < bound
    # The largest rate and angle lie between the samples
    assert abs(result.extrema["arm.omega"]["max"] - 2.0 * k * w) < 2e-6 + 10.0 * bound
    assert abs(result.extrema["arm.angle"]["min"] + amplitude + offset) < 1e-6 + bound


DOUBLE_PENDULUM = """
body.up = { length = 0.3, mass = 1.0, inertia = 7.5e-3, centroid = [0.14, 0.01] }
body.low = { length = 0.2, mass = 0.5, inertia = 1.7e-3, centroid = 0.1, points = { E = [0.15, 0.05] } }
pin.O = { joins = ["frame", "up.start"], point = [0.1, 0.2] }
pin.A = { joins = ["up.end", "low.start"] }
spring.S = { joins = ["frame", "low.E"], point = [0.5, 0.3], stiffness = 40.0, length = 0.1, damping = 0.2 }
initial.low = { angle_deg = -60.0, omega = 2.0, vy = 0.1 }
initial.up = { x = 0.2 }
guess.up = { angle_deg = -40.0 }
drive.free = true
environment.gravity = 9.81
output = { groups = ["accelerations", "joints", "energy"], duration = 0.5, samples = 50 }
"""


def test_a_start_with_two_freedoms_is_completed_from_values_of_any_body(run, load):
    """The minimal program is exact; the spring pulls beside a centroid."""
    exact, *_ = solve(load(DOUBLE_PENDULUM))
    for model, setting, bound in (("reference_model", 1e-10, 1e-7), ("exudyn_model", 1e-4, 1e-5)):
        columns = run(model, setting, DOUBLE_PENDULUM).columns
        first = [columns[name][0] for name in ("low.angle", "low.omega", "low.vy", "up.x")]
        assert first == pytest.approx([-math.pi / 3, 2.0, 0.1, 0.2], abs=1e-12)
        for name, values in exact.items():
            scale = max(1.0, np.abs(values).max())
            np.testing.assert_allclose(columns[name], values, atol=bound * scale, rtol=0, err_msg=name)


ROTOR = """
body.rotor = { mass = 1.0, inertia = 0.2, points = { O = [0, 0] } }
pin.O = { joins = ["frame", "rotor.O"] }
initial.rotor = { angle_deg = 15.0, omega = %s }
drive = { body = "rotor", torque_table = [[0.0, 0.2], [90.0, 1.0], %s [200.0, -0.3], [360.0, 0.2]] }
output = { groups = ["energy"], duration = 6.0, samples = 100 }
"""


@pytest.mark.parametrize("omega", [3.0, -3.0])
@pytest.mark.parametrize(
    ("model", "setting", "jump", "bound"),
    [("reference_model", 1e-11, "[90.001, -0.3],", 1e-9), ("exudyn_model", 1e-4, "", 1e-6)],
)
def test_a_table_of_torque_does_the_work_under_it(model, setting, jump, bound, omega, run):
    """The kinetic energy is that work and the start's, over several turns, corners and perhaps a jump."""
    degrees, torques = np.array(
        [[0.0, 0.2], [90.0, 1.0], *[[90.001, -0.3]] * bool(jump), [200.0, -0.3], [360.0, 0.2]]
    ).T
    columns = run(model, setting, ROTOR % (omega, jump)).columns
    grid = np.radians(np.concatenate([degrees[:-1] + 360.0 * turn for turn in range(-8, 8)]))
    work = make_interp_spline(grid, np.tile(torques[:-1], 16), k=1).antiderivative()
    angle = columns["rotor.angle"]
    assert np.ptp(angle) > 2.0 * math.pi
    energy = work(angle) - work(angle[:1])
    np.testing.assert_allclose(columns["energy_drive"], energy, atol=bound, rtol=0)
    np.testing.assert_allclose(0.5 * 0.2 * columns["rotor.omega"] ** 2, 0.9 + energy, atol=bound, rtol=0)


QUICK_RETURN = """
body.crank = { length = 0.08, mass = 0.4, inertia = 2e-4, centroid = 0.04 }
body.block = { mass = 0.2, inertia = 3e-4 }
body.rocker = { mass = 1.1, inertia = 0.02, centroid = [0.12, 0.0], points = { pivot = [0.0, 0.0] } }
pin.O = { joins = ["frame", "crank.start"] }
pin.A = { joins = ["crank.end", "block.centroid"] }
pin.H = { joins = ["frame", "rocker.pivot"], point = [0.0, -0.085] }
guide.G = { body = "block", on = "rocker", point = [0.1, 0.0], direction_deg = 0.0, angle_deg = 25.0 }
initial.crank = { angle_deg = 10.0 }
guess = { rocker = { angle_deg = 70.0 }, block = { angle_deg = 95.0 } }
drive = { body = "crank", speed_rpm = -90.0, cycles = 0.35 }
environment.gravity = 9.81
output = { groups = ["accelerations", "joints", "energy"], samples_per_cycle = 100 }
"""


@pytest.mark.parametrize(("model", "setting"), [("reference_model", 1e-10), ("exudyn_model", 4e-6)])
def test_a_block_is_followed_5_mm_beside_its_rocker_s_pivot(model, setting, run):
    """The start tells nothing of the forces on the way."""
    columns = run(model, setting, QUICK_RETURN).columns
    crank = math.radians(10.0) - 3 * math.pi * columns["time"]
    rocker = np.unwrap(np.arctan2(0.08 * np.sin(crank) + 0.085, 0.08 * np.cos(crank)))
    np.testing.assert_allclose(columns["rocker.angle"], rocker, atol=2e-6)
    assert np.abs(columns["G.force"]).max() > 5e4


def test_a_block_that_meets_its_rocker_s_pivot_in_long_steps_is_refused(run):
    changes = {"pin.H.point": [0.0, -0.0815]}
    result = run("exudyn_model", 4e-5, QUICK_RETURN, changes, "invariant-violated")
    assert result.remedy.startswith("constraint-position: ")


def test_a_prescribed_motion_knows_its_work_past_a_sharp_force(run):
    """The end of a spring passes its anchor at half a millimetre: no error of the motion shows that."""
    text = """
    body.crank = { length = 0.1, mass = 1.0, inertia = 8.3e-4, centroid = 0.05 }
    pin.O = { joins = ["frame", "crank.start"] }
    spring.S = { joins = ["frame", "crank.end"], point = [0.0, 0.1005], stiffness = 500.0, length = 0.05 }
    drive = { body = "crank", speed_rpm = 60.0, cycles = 1.0 }
    environment.gravity = 9.81
    output = { groups = ["energy"], samples_per_cycle = 100 }
    """
    assert np.abs(run("reference_model", 1e-11, text).columns["energy_residual"]).max() < 1e-8


@pytest.mark.parametrize(("model", "setting"), [("reference_model", 1e-10), ("exudyn_model", 1e-6)])
def test_contacts_that_are_closed_at_the_start_begin_there(model, setting, run):
    """Two corners at once and a journal start on their walls and move in."""
    changes = {
        "clearance.G.offset": 1e-3, "clearance.G.offset_rate": 0.4, "output.duration": 5e-4,
        "clearance.A": {"size": 2e-4, "offset": [0.0, 2e-4], "offset_rate": [0.0, 0.3]},
        "output.samples": 5,
    }  # fmt: skip
    result = run(model, setting, "slider-crank", changes)
    for name, speed in (("G.ll", 0.4), ("G.ul", 0.4), ("A", 0.3)):
        row = result.events["corner"].tolist().index(name)
        assert result.events["start"][row] == 0.0
        assert result.events["normal_speed"][row] == pytest.approx(speed, rel=1e-9)
    first = [result.columns[name][0] for name in ("slider.y", "A.x", "A.y")]
    assert first == pytest.approx([1e-3, 0.0, 2e-4], abs=1e-15)


ADRIFT = """
body.a = { mass = 0.5, inertia = 2e-3 }
body.b = { mass = 0.2, inertia = 3e-4 }
guide.L = { body = "b", on = "a", point = [0.05, 0.04], direction_deg = 20.0, angle_deg = 65.0 }
initial.a = { x = 0.1, y = 0.2, angle_deg = 30.0, vx = 0.3, vy = -0.2, omega = 5.0 }
initial.b = { x = 0.13, vx = 0.5 }
guess.b = { y = 0.26, angle_deg = 95.0 }
contact = { restitution = 0.7, damping_model = "lankarani-nikravesh", impact_speed_floor = 1e-3 }
friction.coefficient = 0.4
drive.free = true
output = { groups = ["contacts", "energy"], duration = 0.06, samples = 300 }

[clearance.L]
size = 2e-4
length = 0.06
width = 0.04
offset = 5e-5
offset_rate = 0.1
tilt_deg = 0.02
tilt_rate = 1.0
"""


@pytest.mark.parametrize(("model", "setting"), [("reference_model", 1e-10), ("exudyn_model", 1e-6)])
def test_two_free_bodies_in_contact_keep_their_momenta_and_their_energy(model, setting, run):
    """There is no constraint at all; the slot turns."""
    result = run(model, setting, ADRIFT)
    columns, spin, total = result.columns, 0.0, 0.0
    for name, mass, inertia in (("a", 0.5, 2e-3), ("b", 0.2, 3e-4)):
        x, y, vx, vy, omega = (columns[f"{name}.{part}"] for part in ("x", "y", "vx", "vy", "omega"))
        spin = spin + mass * (x * vy - y * vx) + inertia * omega
        total = total + mass * np.array([vx, vy])
    assert len(result.events["corner"]) >= 7
    np.testing.assert_allclose(total, total[:, :1] + 0.0 * total, rtol=0, atol=1e-12)
    # The trapezoidal rule keeps a moment of momentum to second order in the step
    np.testing.assert_allclose(spin, spin[0], rtol=0, atol=1e-9)
    energy = columns["energy_kinetic"]
    loss = columns["energy_damping"] + columns["energy_friction"]
    np.testing.assert_allclose(energy[0] - energy - columns["energy_contact"], loss, atol=1e-5 * energy[0])
    assert columns["energy_friction"][-1] > 1e-3 * energy[0]


@EACH
def test_without_rates_what_is_given_rests_and_the_rates_of_clearances_count(model, run):
    text = ADRIFT.replace(", vx = 0.3, vy = -0.2, omega = 5.0", "").replace(", vx = 0.5", "")
    columns = run(model, 1e-6, text, {"output.duration": 1e-4, "output.samples": 2}).columns
    start = {name: columns[name][0] for name in ("a.vx", "a.vy", "a.omega", "b.vx", "b.omega")}
    assert start == pytest.approx({"a.vx": 0, "a.vy": 0, "a.omega": 0, "b.vx": 0, "b.omega": 1}, abs=1e-12)
    assert columns["b.vy"][0] > 0.05


@EACH
def test_channels_come_by_groups_and_the_plan_is_of_the_run(model, load):
    simulate = importlib.import_module(model).simulate
    span = {"drive.cycles": 0.02, "output.samples_per_cycle": 500}
    for group in ("accelerations", "contacts", "joints", "energy"):
        data = load("slider-crank-driven", span | {"output.groups": [group]})
        result = simulate(data)
        assert next(iter(result.columns)) == "time"
        assert {*result.columns} == {"time", *expected(data)}
        assert {*result.extrema} == {*expected(data)}
        assert "energy" in result.provenance["invariants"]
    plan = simulate.plan(data)
    assert plan.pop("formulation") == result.provenance["formulation"]
    start = plan.pop("start")
    assert plan == {
        "bodies": ["crank", "rod", "slider"], "coordinates": 9, "constraints": 5, "freedom": 4,
        "contacts": ["A", "G.ll", "G.lr", "G.ul", "G.ur"],
    }  # fmt: skip
    for body, place in start.items():
        assert place == pytest.approx([result.columns[f"{body}.{word}"][0] for word in ("x", "y", "angle")])


FREE = {"drive": {"free": True}, "output": {"groups": [], "duration": 1.0, "samples": 10}}
BAR, CRANK = "four-bar", "slider-crank-driven"
REFUSALS = [
    # A shipped linkage, changes of keys, tables in the place of its own, and both models' message
    (BAR, {}, {"initial": {"crank": {"angle_deg": 60.0, "omega": 1.0}}},
     r"^initial: .*needs 1 position and 0 rates.* 1 position and 1 rate"),
    (BAR, {}, {"initial": {"coupler": {"angle_deg": 20.0}}}, r"^initial: .* 2 positions and 0 rates"),
    (BAR, {}, FREE | {"initial": {}},
     r"^initial: .* 1 position and 1 rate, or no rate at rest.* 0 positions and 0 rates"),
    (BAR, {"pin.C.point": [0.9, 0.0]}, {}, r"^guess: the linkage cannot be assembled"),
    (BAR, {}, FREE | {"initial": {"rocker": {"angle_deg": 0.0}}}, r"^guess: the linkage cannot be assembled"),
    (BAR, {"pin.Z": {"joins": ["frame", "crank.start"]}}, {},
     r"^pin: too many constraints, or a singular position: 2 of 11 rows"),
    (BAR, {"spring.S": {"joins": ["frame", "crank.start"], "stiffness": 1.0, "length": 0.1}}, {},
     r"^spring\.S: its (ends|points) coincide"),
    (CRANK, {}, FREE | {"clearance": {}, "initial": {"slider": {"angle_deg": 0.0}}},
     r"^initial: the .* do not determine"),
]  # fmt: skip
REFERENCE = {"tolerance": 1e-9, "method": "dop853"}
KEYS = [
    ("reference_model", REFERENCE | {"tolerance": 1e-15}, "must be at least"),
    ("reference_model", REFERENCE | {"method": "BDF"}, "method = 'BDF'"),
    ("reference_model", REFERENCE | {"formulation": "minimal"}, "formulation = 'minimal'"),
    ("exudyn_model", {"formulation": "tree"}, "formulation = 'tree' is the press's"),
    ("exudyn_model", {"method": "dopri5"}, "method = 'dopri5' is the press's"),
]


@pytest.mark.parametrize(
    ("model", "source", "changes", "tables", "words"),
    [
        *((model, *case) for case in REFUSALS for model in SETTING),
        *((model, BAR, {}, {"solver": {model.partition("_")[0]: keys}}, text) for model, keys, text in KEYS),
    ],
)
def test_a_linkage_is_refused_in_one_line_by_run_check_and_plan(model, source, changes, tables, words, load):
    data, simulate = load(source, changes) | tables, importlib.import_module(model).simulate
    for call in (simulate, simulate.check, simulate.plan):
        with pytest.raises(ValueError, match=words) as refusal:
            call(data)
        assert "\n" not in str(refusal.value)
