"""What a result holds: the channels asked for, in SI units, at exact multiples of the sample interval."""

from itertools import pairwise

import numpy as np
import pytest

from comparison.tables.channels import channels, expected

GROUPS = ("accelerations", "corners", "joints", "energy")
SHORT = {"drive.cycles": 0.005}
PARTS = ("min", "time_of_min", "max", "time_of_max")


def test_exactly_the_channels_of_each_group_are_there_in_one_order(run, variant):
    """Time, motion, then group after group, also where the groups are named in another order."""
    everything = run("reference-minimal", "150rpm-0.2mm", SHORT).columns
    of = {name: channel.group for name, channel in channels().items()}
    groups = [of[name] for name in everything if name != "time"]
    assert [later for earlier, later in pairwise(groups) if earlier != later] == list(GROUPS)
    names = run(variant, "150rpm-0.2mm", SHORT).variant.groups
    for groups in ([], *([group] for group in names), list(names), list(reversed(names))):
        simulated = run(variant, "150rpm-0.2mm", {**SHORT, "output.groups": groups})
        assert sorted(simulated.columns) == sorted(["time", *expected(simulated.scene)]), groups
        assert list(simulated.columns) == [name for name in everything if name in simulated.columns]
        assert set(simulated.result.extrema) == set(simulated.columns) - {"time"}


@pytest.mark.parametrize("name", ["ideal", "crank-pin", "both-clearances"])
def test_joints_with_and_without_clearance_have_channels_of_their_own(run, variant, name):
    if variant in {"ideal": ("exudyn-full", "exudyn-tree")}.get(name, ("reference-multiplier",)):
        pytest.skip("refused, or without the channels")
    simulated = run(variant, name, SHORT)
    assert sorted(simulated.columns) == sorted(["time", *expected(simulated.scene)])
    kinds, joints = {name.partition("_")[0] for name in simulated.columns}, simulated.scene["joints"]
    assert ("corner" in kinds) == (joints["slider"] == "clearance")
    assert ("journal" in kinds) == (joints["crank_pin"] == "clearance")
    assert ("guide" in kinds) == (joints["slider"] == "ideal" and "joints" in simulated.variant.groups)


@pytest.mark.parametrize(("rpm", "per_cycle"), [(150.0, 1000), (90.0, 700), (-150.0, 1000)])
def test_samples_are_exact_multiples_of_the_interval_and_include_the_end(run, variant, rpm, per_cycle):
    changes = {"drive.speed_rpm": rpm, "output.samples_per_cycle": per_cycle, "drive.cycles": 0.02}
    columns = run(variant, "150rpm-0.2mm", changes).columns
    times = np.arange(round(0.02 * per_cycle) + 1) * (60.0 / abs(rpm) / per_cycle)
    np.testing.assert_array_equal(columns["time"], times, strict=True)
    for name, values in columns.items():
        assert values.shape == times.shape, name
        assert np.isfinite(values).all(), name


def test_more_samples_are_samples_of_the_same_motion(run, variant):
    """Samples in between change nothing at those that both have: where a sample is says nothing."""
    changes = {"drive.cycles": 0.05, "initial.slider_omega": 0.2}
    few, many = (
        run(variant, "150rpm-0.2mm", {**changes, "output.samples_per_cycle": n}) for n in (1000, 10_000)
    )
    assert few.result.events["start"].size > 0
    assert np.abs(many.columns["slider_x"][::10] - few.columns["slider_x"]).max() <= few.variant.error
    assert np.array_equal(few.result.events["corner"], many.result.events["corner"])
    steps = [simulated.result.provenance["counters"]["steps"] for simulated in (few, many)]
    assert variant not in ("exudyn-full", "exudyn-tree") or steps[0] == steps[1]


def assert_enclosed(simulated, name, extremes, within=slice(None)):
    """Require extrema (least, its time, most, its time) of samples, and within their time."""
    least, at_least, most, at_most = extremes
    time, values = simulated.columns["time"][within], simulated.columns[name][within]
    # The samples are others than the states that extrema are taken from. These are a thousandth of a cycle
    # apart, in a contact a sixteenth of its half wave: 1 - cos(pi / 32) = 5e-3. The residual has no range, it
    # is an error.
    reach = np.inf if name == "energy_residual" else 5e-3 * np.ptp(simulated.columns[name])
    assert least <= values.min() + reach, name
    assert most >= values.max() - reach, name
    # The last state may lie a rounding of the sum of the steps beyond the last sample.
    for at in (at_least, at_most):
        assert time[0] * (1 - 1e-9) <= at <= time[-1] * (1 + 1e-9), name


def test_extrema_enclose_all_samples_and_lie_within_the_run(short):
    for name, own in short.result.extrema.items():
        assert_enclosed(short, name, [own[part] for part in PARTS])
        # A motion cannot leave its samples by more than its rate lets it within one interval: an extremum
        # is one of this run, not of another. Forces in hits of steel may.
        if channels()[name].rate is not None:
            rates, values = short.result.extrema[channels()[name].rate], short.columns[name]
            reach = max(abs(rates["min"]), abs(rates["max"])) * short.columns["time"][1]
            assert values.min() - reach <= own["min"] <= own["max"] <= values.max() + reach, name


@pytest.fixture
def turning(run, variant):
    """A cycle and a fifth, fast, so that they take steps for a few milliseconds of each."""
    changes = {"drive.speed_rpm": 1500.0, "drive.cycles": 1.2, "initial.slider_omega": 0.2}
    return lambda samples: run(variant, "150rpm-0.2mm", {**changes, "output.samples_per_cycle": samples})


def test_extrema_of_each_cycle_lie_in_it_and_those_of_the_run_follow_from_them(turning):
    simulated = turning(1000)
    by_cycle = simulated.result.cycle_extrema
    assert set(by_cycle) == {f"{name}_{part}" for name in simulated.result.extrema for part in PARTS}
    for name, whole in simulated.result.extrema.items():
        least, at_least, most, at_most = each = np.array([by_cycle[f"{name}_{part}"] for part in PARTS])
        assert each.shape == (4, 2)
        assert (whole["min"], whole["time_of_min"]) == (least.min(), at_least[least.argmin()])
        assert (whole["max"], whole["time_of_max"]) == (most.max(), at_most[most.argmax()])
        for cycle in range(2):  # both ends of a cycle belong to it
            assert_enclosed(simulated, name, each[:, cycle], slice(1000 * cycle, 1000 * cycle + 1001))


@pytest.mark.parametrize("variant", ["reference-minimal", "reference-multiplier"])
def test_extrema_do_not_depend_on_the_samples(turning):
    few, usual, many = (turning(samples).result for samples in (100, 1000, 10_000))
    for name, column in usual.cycle_extrema.items():
        if not name.startswith("energy_residual"):  # an error of rounding
            for other in (few, many):
                # Times of samples and states that coincide are rounded differently.
                np.testing.assert_allclose(other.cycle_extrema[name], column, rtol=1e-9, atol=1e-12)
