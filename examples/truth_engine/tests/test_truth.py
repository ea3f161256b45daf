"""The engine by itself: an exact bounce, the energy, its own precision, and the reference from outside."""

import json

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

pytest.importorskip("heyoka", reason="heyoka has no wheel for this Python and platform, or is not installed")

from truth_press import simulate
from truth_press.arithmetic import Arithmetic
from truth_press.motion import Motion, evaluate
from truth_press.press import Press
from truth_press.simulation import Recording

from comparison.cli import main
from comparison.scene import load_scene
from comparison.tables.channels import expected

ENERGY = {"output.groups": ["accelerations", "corners", "energy"]}
MOTION = ("slider_x", "slider_y", "slider_angle", "slider_vx")
# Runs by the switch that each of them passes: tests that run all of them in double precision.
RUNS = {
    "tie": ("150rpm-0.2mm", {"drive.cycles": 0.1}),
    "inside at the start": ("wedge", {}),
    "load": ("workpiece", {"drive.cycles": 0.12}),
    "rows of a load": ("workpiece", {"drive.cycles": 0.2, "load.force": 0.0, "load.table": [
        [0.0, 0.0], [1e-3, 100.0], [1.000000001e-3, 50.0], [2e-3, 300.0]]}),
    "jump of a load": ("workpiece", {"drive.cycles": 0.12, "load.force": 0.0, "load.table": [
        [0.0, 0.0], [1e-30, 20.0]]}),
    "damping depth": ("adams-impact", {"drive.cycles": 0.1, "contact.damping_depth": 1e-6}),
    "no static speed": ("150rpm-0.2mm", {"drive.cycles": 0.2, "friction.static_speed": 0.0}),
    "clipped": ("150rpm-0.2mm", {"drive.cycles": 0.2, "contact.restitution": 0.05,
                                 "contact.damping_model": "flores"}),
}  # fmt: skip


@pytest.mark.parametrize("name", RUNS)
def test_energy_is_balanced(run, name):
    """The motor's power is that of the driven bodies' balance, which the equations of motion do not use."""
    scene, changes = RUNS[name]
    result = run(scene, changes | ENERGY)
    assert len(result.events["start"]) > 1
    # Measured at most 1e-13 J, where the losses are 1e-5 to 1e-2 J.
    assert np.abs(result.columns["energy_residual"]).max() < 2e-12
    assert min(result.columns[f"energy_{loss}"][-1] for loss in ("damping", "friction")) > 1e-7
    if "load" in name:
        assert result.columns["energy_load"].max() > 1e-3
    assert {"time", *result.columns} == {"time", *expected(load_scene(scene, changes | ENERGY).data)}


def test_a_run_ends_at_its_last_sample(run):
    """At this speed end * 100 / 100 is less than the end, as in quadruple at 90 rpm."""
    result = run("wedge", {"drive.speed_rpm": 154.0, "drive.cycles": 0.02})
    assert len(result.columns["time"]) == 201
    assert np.diff(result.columns["time"]).min() > 0.0
    assert result.events["end"].max() <= result.columns["time"][-1]


def test_both_corners_of_an_upright_slider_touch_at_one_instant(run):
    events = run("150rpm-0.2mm", {"drive.cycles": 0.1} | ENERGY).events
    assert list(events["corner"][:2]) == ["ll", "ul"]
    assert events["start"][0] == events["start"][1] < events["start"][2]
    assert len(events["start"]) == 7


def test_extrema_are_those_of_a_fine_sampling(run):
    changes = {"output.samples_per_cycle": 200_000}
    fine, coarse = run("wedge", changes), run("wedge", {})
    for name, extreme in coarse.extrema.items():
        values = fine.columns[name]
        span = np.ptp(values) + 1e-12
        for end, best in (("min", values.min()), ("max", values.max())):
            assert (extreme[end] - best) * (1 if end == "max" else -1) > -1e-10 * span, (name, end)
            # A sample is up to 2.5 us from the extreme, in contacts of 1 ms; friction turns within less.
            if "friction" not in name:
                assert abs(extreme[end] - best) < 2e-5 * span, (name, end)


@pytest.mark.parametrize("bits", [53, 113])
def test_bounce_is_exact(bits):
    """A slider that spins in a guide at rest: both corners of a diagonal hit, on springs of the power 1.5.

    One degree of freedom without loss: depth by the energy, duration and impulse by quadrature.
    """
    scene = load_scene("wedge", {"initial.slider_angle": 5e-3, "contact.restitution": 1.0}).data
    scene["drive"]["speed_rpm"], scene["environment"]["gravity"] = 1e-60, 0.0
    scene["friction"]["coefficient"] = 0.0
    arithmetic = Arithmetic.of(bits)
    depth, tolerance = (1e-13, 1e-15) if bits == 53 else (1e-24, 1e-30)
    motion = Motion(Press(scene, arithmetic, depth), arithmetic, tolerance)
    record = Recording(motion, arithmetic.array([0.0]))
    for segment in motion.run(arithmetic.number(0.02)):
        record.add(segment)
    assert [contact["corner"] for contact in motion.contacts[:2]] == ["lr", "ul"]

    slider, contact = scene["mechanism"]["slider"], scene["contact"]
    J, W, L, c = slider["inertia"], slider["width"], slider["length"], scene["clearance"]["slider"]
    compliance = 2 * (1 - contact["poisson"] ** 2) / contact["youngs_modulus"]
    K = 4 / (3 * compliance) * contact["corner_radius"] ** 0.5

    def inside(angle):
        # W (cos - 1) without cancellation.
        return -W * np.sin(angle / 2) ** 2 + L / 2 * np.sin(angle) - c

    def square(angle):  # of the rate
        return 1.0 - 2 * 2 * K * max(inside(angle), 0.0) ** 2.5 / 2.5 / J

    touch, top = brentq(inside, 5e-3, 7e-3, xtol=1e-17), brentq(square, 5.5e-3, 3e-2, xtol=1e-17)

    def integral(of):  # over the time from touch to top; angle = top - (top - touch) s^2
        return quad(lambda s: of(a := top - (top - touch) * s * s) * 2 * (top - touch) * s / square(a) ** 0.5,
                    0, 1, epsabs=0, epsrel=1e-12, limit=500)[0]  # fmt: skip

    first = motion.contacts[0]
    duration = float(first["end"] - first["start"])
    assert float(first["largest_depth"]) == pytest.approx(inside(top), rel=1e-10)
    assert float(first["peak_force"]) == pytest.approx(K * inside(top) ** 1.5, rel=1e-10)
    # Both ends of the contact are cut by the starting depth.
    rest = 2 * depth / float(first["normal_speed"])
    assert duration + rest == pytest.approx(2 * integral(lambda _: 1.0), rel=1e-11 if bits == 113 else 1e-10)
    assert float(first["impulse"]) == pytest.approx(
        2 * integral(lambda a: K * max(inside(a), 0.0) ** 1.5), rel=1e-9
    )
    # Without loss every bounce is like the first: the loss is an error of the arithmetic's size.
    assert abs(float(abs(motion.state["omega5"]) - 1)) < (1e-9 if bits == 53 else 1e-22)


def states(changes, bits, depth, tolerance):
    """Return positions and the velocity at the samples, in the arithmetic of a run."""
    scene = load_scene("150rpm-0.2mm", changes).data
    arithmetic = Arithmetic.of(bits)
    motion = Motion(Press(scene, arithmetic, depth), arithmetic, tolerance)
    count = round(1000 * scene["drive"]["cycles"])
    times = arithmetic.array([motion.cycle * k / 1000 for k in range(count)])
    result, first = [], 0
    for segment in motion.run(motion.cycle * count / 1000):
        until = int(np.searchsorted(times, segment.times[-1]))
        if until > first:
            at = times[first:until]
            values = evaluate(segment.phase.outputs, segment.solution(at), segment.pars, at)
            result.append(np.stack([values[segment.phase.rows[name]] for name in MOTION]))
        first = until
    return np.concatenate(result, axis=1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("cycles", "one", "other", "distance"),
    [
        (1.0, (113, 1e-24, 1e-30), (113, 1e-22, 1e-30), 1e-16),
        # Over the first seven contacts; a whole cycle of 166 bits takes five times longer than quadruple.
        (0.1, (113, 1e-24, 1e-33), (166, 1e-24, 1e-45), 1e-24),
    ],
    ids=["starting depths", "wider numbers"],
)
def test_depth_and_arithmetic_make_the_errors_that_were_measured(cycles, one, other, distance):
    """See README."""
    a, b = (states({"drive.cycles": cycles}, *setting) for setting in (one, other))
    difference = np.abs((Arithmetic.of(other[0]).array(a) - b).astype(float))
    assert difference[0].max() < distance


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["wedge", "workpiece"])
def test_strict_reference_is_within_its_uncertainty(run, scene, tmp_path, monkeypatch):
    """The command from outside: the error that it states, against the truth, at its predictable samples."""
    monkeypatch.chdir(tmp_path)
    main(["run", scene, "--model", "reference", "--accuracy", "strict", "--check", "--out", "a.csv"])
    table = pd.read_csv("a.csv")
    truth = run(scene, {}, 113)
    error = np.abs(table["slider_x"] - truth.columns["slider_x"])
    predictable = np.isfinite(table["slider_x_u"])
    assert predictable.mean() > 0.9
    assert (error <= table["slider_x_u"])[predictable].all()
    events = pd.read_csv("a.events.csv")
    assert len(events) == len(truth.events["start"])


@pytest.mark.parametrize(
    ("scene", "changes", "rule"),
    [
        ("crank-pin", {}, "joints.crank_pin = 'clearance' must be 'ideal'"),
        ("ideal", {}, "joints.slider = 'ideal' must be 'clearance'"),
        ("surface", {}, "contact.law = 'foundation' must be one of hertz-corners, adams-impact"),
        ("wedge", {"output.groups": ["joints"]}, "output.groups: 'joints' is refused"),
        ("wedge", {"solver": {"bits": 24}}, "solver.truth.bits = 24 must be an integer"),
        ("wedge", {"solver": {"tolerance": "fine"}}, "solver.truth.tolerance = 'fine' must be real"),
        ("wedge", {"solver": {"step": 1e-3}}, "solver.truth: step must be one of bits"),
        ("wedge", {"mechanism.rod2.length": 0.1}, "rod 2 does not reach the rocker"),
        ("wedge", {"mechanism.guide_x": -0.9}, "rod 4 does not reach the slider"),
    ],
)
def test_what_is_outside_the_model_is_one_line(scene, changes, rule):
    solver = changes.get("solver", {})  # no scene has them where the engine is not installed
    data = load_scene(scene, {key: value for key, value in changes.items() if key != "solver"}).data
    data["solver"]["truth"] = solver
    with pytest.raises(ValueError, match=rule) as error:
        simulate(data)
    assert "\n" not in str(error.value)


def test_provenance_is_json(run):
    assert json.loads(json.dumps(run("wedge", {}).provenance))["counters"]["contacts"] == 13
