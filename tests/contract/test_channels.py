"""Results have the requested channels, at exact multiples of the sample interval, and extrema."""

from itertools import pairwise

import numpy as np
import pytest

from comparison.tables.channels import channels, expected

GROUPS = ("accelerations", "corners", "joints", "energy")
SHORT = {"drive.cycles": 0.005}
PARTS = ("min", "time_of_min", "max", "time_of_max")


def test_exactly_the_channels_of_each_group_are_there_in_one_order(run, variant):
    """Time, motion, then group after group, also where the groups are named in another order."""
    columns = run("reference-minimal", "150rpm-0.2mm", SHORT).columns
    group_of = {name: channel.group for name, channel in channels().items()}
    groups = [group_of[name] for name in columns if name != "time"]
    assert [later for earlier, later in pairwise(groups) if earlier != later] == list(GROUPS)
    names = run(variant, "150rpm-0.2mm", SHORT).variant.groups
    for groups in ([], *([group] for group in names), list(names), list(reversed(names))):
        simulation = run(variant, "150rpm-0.2mm", {**SHORT, "output.groups": groups})
        assert sorted(simulation.columns) == sorted(["time", *expected(simulation.scene)]), groups
        assert list(simulation.columns) == [name for name in columns if name in simulation.columns]
        assert set(simulation.result.extrema) == set(simulation.columns) - {"time"}


@pytest.mark.parametrize(("rpm", "per_cycle"), [(150.0, 1000), (90.0, 700), (-150.0, 1000)])
def test_samples_are_exact_multiples_of_the_interval_and_include_the_end(run, variant, rpm, per_cycle):
    changes = {"drive.speed_rpm": rpm, "output.samples_per_cycle": per_cycle, "drive.cycles": 0.02}
    columns = run(variant, "150rpm-0.2mm", changes).columns
    times = np.arange(round(0.02 * per_cycle) + 1) * (60.0 / abs(rpm) / per_cycle)
    np.testing.assert_array_equal(columns["time"], times, strict=True)
    for name, values in columns.items():
        assert values.shape == times.shape, name
        assert np.isfinite(values).all(), name


def assert_enclosed(simulation, name, extremes, within=slice(None)):
    """Require extrema (least, its time, most, its time) of samples, and within their time."""
    least, at_least, most, at_most = extremes
    time, values = simulation.columns["time"][within], simulation.columns[name][within]
    # Extrema are taken from other states than the samples. These states are a thousandth of a cycle
    # apart, in a contact a sixteenth of its half wave: 1 - cos(pi / 32) = 5e-3. The residual has no range, it
    # is an error.
    reach = np.inf if name == "energy_residual" else 5e-3 * np.ptp(simulation.columns[name])
    assert least <= values.min() + reach, name
    assert most >= values.max() - reach, name
    # The last state may lie a rounding of the sum of the steps beyond the last sample.
    for at in (at_least, at_most):
        assert time[0] * (1 - 1e-9) <= at <= time[-1] * (1 + 1e-9), name


def test_extrema_enclose_all_samples_and_lie_within_the_run(short_run):
    for name, extremum in short_run.result.extrema.items():
        assert_enclosed(short_run, name, [extremum[part] for part in PARTS])
        # A motion cannot leave its samples by more than its rate lets it within one interval: an extremum
        # is one of this run, not of another. Forces in hits of steel may.
        if channels()[name].rate is not None:
            rates, values = short_run.result.extrema[channels()[name].rate], short_run.columns[name]
            reach = max(abs(rates["min"]), abs(rates["max"])) * short_run.columns["time"][1]
            assert values.min() - reach <= extremum["min"] <= extremum["max"] <= values.max() + reach, name


def test_a_turning_point_inside_a_step_is_an_extremum(run, variant):
    """The slider turns at the top, 2.449 ms from the start, in a flight where five bodies step 0.1 ms."""
    flight = {"mechanism.crank_angle_deg": 113.5, "drive.speed_rpm": -150.0, "drive.cycles": 0.02}
    extremum, other = (
        run(name, "150rpm-0.2mm", flight | {"solver.exudyn.step": 2e-5}).result.extrema["slider_y"]
        for name in (variant, "reference-multiplier")
    )
    # Measured: five bodies 1e-9 s, by index 2 2e-10 m; without the turning points 3e-5 s and 2e-8 m.
    assert abs(extremum["time_of_max"] - other["time_of_max"]) < 1e-7
    assert abs(extremum["max"] - other["max"]) < 1e-9


def test_extrema_of_each_cycle_lie_in_it_and_those_of_the_run_follow_from_them(run, variant):
    """The run is a cycle and a fifth, fast, so that models take steps for a few milliseconds of each."""
    changes = {"drive.speed_rpm": 1500.0, "drive.cycles": 1.2, "initial.slider_omega": 0.2}
    simulation = run(variant, "150rpm-0.2mm", {**changes, "output.samples_per_cycle": 1000})
    by_cycle = simulation.result.cycle_extrema
    assert set(by_cycle) == {f"{name}_{part}" for name in simulation.result.extrema for part in PARTS}
    for name, whole in simulation.result.extrema.items():
        least, at_least, most, at_most = each = np.array([by_cycle[f"{name}_{part}"] for part in PARTS])
        assert each.shape == (4, 2)
        assert (whole["min"], whole["time_of_min"]) == (least.min(), at_least[least.argmin()])
        assert (whole["max"], whole["time_of_max"]) == (most.max(), at_most[most.argmax()])
        for cycle in range(2):  # both ends of a cycle belong to it
            assert_enclosed(simulation, name, each[:, cycle], slice(1000 * cycle, 1000 * cycle + 1001))


def test_who_listens_does_not_change_the_run_which_leaves_nothing(run, variant, tmp_path, monkeypatch, capfd):
    """Reports of progress stop an integrator more often; its steps are the same."""
    monkeypatch.chdir(tmp_path)
    simulation, shares = run(variant, "150rpm-0.2mm", {"drive.cycles": 0.1}), []
    result = simulation.variant.model.simulate(simulation.scene, progress=shares.append)
    assert shares[:-1] == sorted(shares[:-1])
    assert shares[-1] == 1.0
    for name in ("columns", "events", "cycle_extrema", "pulses"):
        for key, values in getattr(simulation.result, name).items():
            np.testing.assert_array_equal(getattr(result, name)[key], values)
    assert result.provenance["counters"] == simulation.result.provenance["counters"]
    assert capfd.readouterr() == ("", "")
    assert not list(tmp_path.iterdir())
