"""All bodies but the crank as a tree: five bodies' limit, balance of forces, the ideal slider's line."""

import numpy as np
import pytest

from exudyn_model import simulate
from exudyn_model.parameters import read_scene

SCENES = {
    "crank pin": {"joints.crank_pin": "clearance", "joints.slider": "ideal"},
    "both": {"joints.crank_pin": "clearance"},
}
# The journal's second contact ends at 7.415 ms (pin) and 7.416 ms (both)
TWO_BOUNCES = {"drive.cycles": 0.0186, "output.samples_per_cycle": 10_000}


@pytest.fixture(params=SCENES)
def joints(request):
    """Which joints have clearance."""
    return SCENES[request.param]


def test_is_what_five_bodies_converge_to(make_scene, tree_scene, joints, error):
    tree = simulate(tree_scene(1e-11, joints | TWO_BOUNCES))
    full = simulate(make_scene(joints | TWO_BOUNCES | {"solver.exudyn.step": 5e-7}))
    assert list(tree.events["corner"]) == list(full.events["corner"]) == ["pin", "pin"]
    # The five bodies' own error at this step, with twelve clearances tried: 1.6e-8 m and 9e-5 m/s at most, of
    # the contacts 2e-8 s, 7e-8 s, 2e-5 m/s, 7e-5 N s, 0.6 N of 1.6 kN and 1.6e-9 m
    assert error(full, tree) < 3e-8
    assert error(full, tree, "slider_vy") < 2e-4
    for name, tolerance in {
        "start": 5e-8,
        "end": 1.5e-7,
        "normal_speed": 4e-5,
        "impulse": 1.5e-4,
        "peak_force": 1.2,
        "largest_depth": 3e-9,
    }.items():
        np.testing.assert_allclose(full.events[name], tree.events[name], rtol=0, atol=tolerance, err_msg=name)


@pytest.mark.slow
def test_five_bodies_converge_to_it_at_second_order(make_scene, tree_scene, joints, error):
    """Where in a step a touch falls scatters the errors: root mean squares of six clearances."""
    steps, errors = [2e-6, 1e-6, 5e-7, 2.5e-7], []
    for k in range(6):
        changes = joints | TWO_BOUNCES | {"clearance.crank_pin": 2e-4 * (1 + 0.003 * k)}
        tree = simulate(tree_scene(1e-11, changes))
        errors.append([error(simulate(make_scene(changes | {"solver.exudyn.step": h})), tree) for h in steps])
    order = np.polyfit(np.log(steps), np.log(np.sqrt(np.mean(np.square(errors), axis=0))), 1)[0]
    # 2.18 and 1.98 measured
    assert order == pytest.approx(2.0, abs=0.3), errors


def test_errors_follow_the_tolerance(tree_scene, joints, error):
    """Over the shipped scenes' span, five bounces of the journal.

    Where friction reverses inside a step scatters the errors by a factor of up to 40: root mean squares of
    three runs that differ in the largest step.
    """
    changes = joints | {"drive.cycles": 0.06, "output.samples_per_cycle": 10_000}
    tight = simulate(tree_scene(1e-12, changes))
    steps = (1e-4, 1.014e-4, 1.027e-4)
    usual, loose = (
        [simulate(tree_scene(tolerance, changes | {"solver.exudyn.step": step})) for step in steps]
        for tolerance in (1e-10, 1e-7)
    )
    fine, coarse = (np.sqrt(np.mean([error(run, tight) ** 2 for run in runs])) for runs in (usual, loose))
    # 2.4e-10 m and 2.3e-11 m measured, 2.1e-7 m/s
    assert fine < 1.5e-9
    assert max(error(run, tight, "slider_vy") for run in usual) < 2e-6
    # 1000 times the tolerance; 583 and 13,715 measured
    assert 50 < coarse / fine < 20_000
    for run in usual:
        # The work: some 50 steps in a contact, at most 2302 in all measured
        counters = run.provenance["counters"]
        assert counters["steps"] < 4000
        assert counters["rejected"] < 0.15 * counters["steps"]
        assert counters["located"] < 6 * len(run.events["start"])
        assert sorted(run.events["corner"]) == sorted(tight.events["corner"])
        # 2e-9 s measured
        assert np.max(np.abs(run.events["start"] - tight.events["start"])) < 1e-8


def test_no_bounce_is_stepped_over(tree_scene, joints):
    """At a loose tolerance, and with steps up to ten times as long as a contact lasts."""
    changes = joints | {"drive.cycles": 0.06}
    tight = simulate(tree_scene(1e-10, changes))
    for step in (1e-3, 9.7e-4, 9.1e-4):  # which bounce is near a step's end is rounding's choice
        long = simulate(tree_scene(1e-6, changes | {"solver.exudyn.step": step}))
        assert long.status == "success"
        assert long.provenance["counters"]["steps"] < 1000
        pins = [result.events["start"][result.events["corner"] == "pin"] for result in (tight, long)]
        assert len(pins[0]) >= 4
        # 1.3e-5 s measured; a contact lasts 1e-4 s
        np.testing.assert_allclose(*pins, rtol=0, atol=5e-5)
        # None is made up by a trial of a step that went astray
        assert (long.events["largest_depth"] > 0.0).all()


@pytest.mark.parametrize("step", [1e-2, 5e-3])
def test_steps_far_too_long_are_reported_and_nothing_is_made_up(tree_scene, joints, step):
    """The first trial after a touch may err by more than error control comes back from."""
    changes = joints | {"drive.cycles": 0.06}
    tight = simulate(tree_scene(1e-10, changes))
    long = simulate(tree_scene(1e-6, changes | {"solver.exudyn.step": step}))
    exact, found = (result.events["start"][result.events["corner"] == "pin"] for result in (tight, long))
    # As above
    np.testing.assert_allclose(found, exact[: found.size], rtol=0, atol=5e-5)
    assert found.size >= 1
    if long.status == "success":
        assert found.size == exact.size
    else:
        assert "solver.exudyn.step" in long.remedy


def test_balance_of_forces_is_the_derivative_of_what_exudyn_integrates(tree_scene, joints):
    """Through bounces: mass matrix, generalized forces and guide's force against the recorder's balance."""
    changes = joints | {"drive.cycles": 0.0186, "output.samples_per_cycle": 1_000_000}
    columns = simulate(tree_scene(1e-12, changes)).columns
    interval = columns["time"][1]
    names = {"slider_vy": "slider_ay"}
    if "joints.slider" not in joints:
        names |= {"slider_vx": "slider_ax"}
    for rate, acceleration in names.items():
        found = (columns[rate][2:] - columns[rate][:-2]) / (2 * interval)
        scale = np.max(np.abs(columns[acceleration]))
        assert scale > 50
        difference = np.abs(found - columns[acceleration][1:-1])
        # Differences over 0.8 us: 3e-6 measured; more where a contact begins, and where friction reverses
        # within some microseconds: 1e-3
        assert np.quantile(difference, 0.98) < 2e-5 * scale
        assert np.max(difference) < 5e-3 * scale


def test_an_ideal_slider_stays_on_its_line(tree_scene):
    """The guide's force follows from the balance of forces, the motion from Exudyn's own mass matrix."""
    for tolerance, bound in ((1e-7, 2e-11), (1e-10, 2e-13)):
        columns = simulate(tree_scene(tolerance, SCENES["crank pin"] | {"drive.cycles": 0.5})).columns
        # Errors of the rates summed up over 0.2 s: 2e-12 and 2e-14 m measured
        assert np.max(np.abs(columns["slider_x"] + 0.55 - 5e-5)) < bound
        for name in ("slider_angle", "slider_omega", "slider_ax", "slider_alpha"):
            assert np.max(np.abs(columns[name])) < 1e-11, name


def test_mirrored_scene_gives_mirrored_motion(tree_scene, joints, mirrored):
    common = joints | {"drive.cycles": 0.05}
    there, back = (simulate(tree_scene(1e-12, changes)) for changes in (common, common | mirrored))
    swap = {"ll": "lr", "lr": "ll", "ul": "ur", "ur": "ul", "pin": "pin"}
    assert sorted(swap[k] for k in there.events["corner"]) == sorted(back.events["corner"])
    np.testing.assert_allclose(back.events["start"], there.events["start"], rtol=0, atol=1e-9)
    for name, sign in {"slider_x": -1, "slider_y": 1, "slider_angle": -1, "slider_vy": 1}.items():
        # Angles are rounded differently, which impacts magnify: 8e-10 m/s measured
        np.testing.assert_allclose(
            back.columns[name], sign * there.columns[name], rtol=0, atol=1e-8, err_msg=name
        )


def test_contacts_and_extrema_agree_with_dense_samples(tree_scene):
    """Some hundred samples in a contact; corners and journal in one table."""
    changes = {"drive.cycles": 0.06, "output.samples_per_cycle": 400_000}
    result = simulate(tree_scene(1e-10, SCENES["both"] | changes))
    time, events = result.columns["time"], result.events
    assert np.all(np.diff(events["start"]) >= 0)
    assert {"pin", "lr", "ur"} <= set(events["corner"])
    for name, extreme in result.extrema.items():
        values = result.columns[name]
        scale = max(abs(extreme["min"]), abs(extreme["max"]))
        assert extreme["min"] <= values.min()
        assert extreme["max"] >= values.max()
        assert extreme["max"] - values.max() <= 2e-4 * scale, name
        assert values.min() - extreme["min"] <= 2e-4 * scale, name
    for corner in ("ll", "lr", "ul", "ur"):
        own = events["corner"] == corner
        normal = result.columns[f"corner_{corner}_normal"]
        if own.any():
            # A trapezoid rule in some hundred intervals; 7e-5 of the peak lies between two samples
            assert events["impulse"][own].sum() == pytest.approx(np.trapezoid(normal, time), rel=5e-6)
            assert events["peak_force"][own].max() == pytest.approx(normal.max(), rel=2e-4)
    # Out of contact the slider's acceleration is moderate: bounces are what raises it
    in_contact = np.zeros(len(time), bool)
    for start, end in zip(events["start"], events["end"], strict=True):
        in_contact |= (time > start) & (time < end)
    calm, rough = (np.max(np.abs(result.columns["slider_ay"][part])) for part in (~in_contact, in_contact))
    assert rough > 50 * calm  # 1557 and 12 m/s^2


def test_impulse_of_the_journal_is_its_force_over_time(tree_scene, joints):
    """A half-wave to the power 1.5, whose mean is 0.56 of its peak, a little less where it is damped."""
    events = simulate(tree_scene(1e-10, joints | TWO_BOUNCES)).events
    full = events["peak_force"] * (events["end"] - events["start"])
    assert np.all(events["impulse"] > 0.48 * full)
    assert np.all(events["impulse"] < 0.56 * full)
    depth = (events["peak_force"] / read_scene(tree_scene(1e-10, joints)).journal.stiffness) ** (2 / 3)
    # The damping is small by then: 1 % measured
    np.testing.assert_allclose(events["largest_depth"], depth, rtol=0.02)


def test_failures_are_reported(tree_scene, capfd):
    result = simulate(tree_scene(1e-17, SCENES["crank pin"] | {"drive.cycles": 0.01}))
    assert result.status == "step-too-small"
    assert "solver.exudyn.tolerance" in result.remedy
    overflow = SCENES["both"] | {"drive.cycles": 0.01, "initial.slider_omega": 1e308}
    result = simulate(tree_scene(1e-10, overflow))
    assert result.status == "non-finite"
    assert result.remedy
    assert len(result.columns["time"]) == 1
    assert capfd.readouterr() == ("", "")


def test_what_is_recorded(tree_scene):
    for name, corners in (("crank pin", False), ("both", True)):
        result = simulate(tree_scene(1e-8, SCENES[name] | {"drive.cycles": 0.01}))
        assert result.provenance["formulation"] == "rocker, rods and slider tree"
        assert ("corner_ll_gap" in result.columns) == corners
        assert {"slider_ay", "slider_alpha"} < set(result.columns)
        assert set(result.columns) - {"time"} == set(result.extrema)
        assert {"steps", "rejected", "located", "rhs"} == set(result.provenance["counters"])
