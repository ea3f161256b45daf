"""What a result holds: the channels asked for, in SI units, at exact multiples of the sample interval."""

from itertools import pairwise

import numpy as np
import pytest

from comparison.tables.channels import channels, expected

GROUPS = ("accelerations", "corners", "joints", "energy")
SHORT = {"drive.cycles": 0.005}
# Powers of the units of mass, length and time in a unit of channels.toml; angles have none.
DIMENSIONS = {"m": (0, 1, 0), "s": (0, 0, 1), "N": (1, 1, -2), "J": (1, 2, -2), "rad": (0, 0, 0)}
KEYS = {
    "length centroid width thickness rocker_pivot guide_x reference_offset slider_offset slider crank_pin "
    "journal_radius corner_radius damping_depth surface depth": (0, 1, 0),
    "slider_vx impact_speed_floor static_speed transition_speed": (0, 1, -1),
    "mass": (1, 0, 0),
    "inertia": (1, 2, 0),
    "speed_rpm slider_omega": (0, 0, -1),
    "youngs_modulus": (1, -1, -2),
    "gravity": (0, 1, -2),
    "step": (0, 0, 1),
    "damping": (1, 0, -1),
    "force": (1, 1, -2),
}
EVENTS = {
    "start": "s",
    "end": "s",
    "normal_speed": "m/s",
    "largest_depth": "m",
    "impulse": "N s",
    "peak_force": "N",
}


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


LOOSE = ("reference-minimal", "exudyn-full", "exudyn-index2", "exudyn-tree")
RIGID = ("reference-minimal", "reference-multiplier", "exudyn-index2")
JOINTS = [(name, "ideal") for name in RIGID] + [
    (variant, name) for variant in LOOSE for name in ("crank-pin", "both-clearances")
]


@pytest.mark.parametrize(("variant", "name"), JOINTS)
def test_joints_with_and_without_clearance_have_channels_of_their_own(run, variant, name):
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
        run(variant, "150rpm-0.2mm", {**changes, "output.samples_per_cycle": n}) for n in (1000, 4000)
    )
    assert few.result.events["start"].size > 0
    assert np.abs(many.columns["slider_x"][::4] - few.columns["slider_x"]).max() <= few.variant.error
    assert np.array_equal(few.result.events["corner"], many.result.events["corner"])


def test_extrema_enclose_all_samples_and_lie_within_the_run(short):
    end = short.columns["time"][-1]
    for name, simulated in short.result.extrema.items():
        values, least, most = short.columns[name], simulated["min"], simulated["max"]
        # The samples are others than the states that extrema are taken from. These are a thousandth of a
        # cycle apart, in a contact a sixteenth of its half wave: 1 - cos(pi / 32) = 5e-3. The residual has no
        # range, it is an error.
        reach = np.inf if name == "energy_residual" else 5e-3 * np.ptp(values)
        assert least <= values.min() + reach, name
        assert most >= values.max() - reach, name
        # The last state of a run may lie a rounding of the sum of its steps beyond the last sample.
        for at in ("min", "max"):
            assert 0.0 <= simulated[f"time_of_{at}"] <= end * (1 + 1e-12), name
        # A motion cannot leave its samples by more than its rate lets it within one interval: an extremum
        # is one of this run, not of another. Forces in hits of steel may.
        if channels()[name].rate is not None:
            rates = short.result.extrema[channels()[name].rate]
            reach = max(abs(rates["min"]), abs(rates["max"])) * short.columns["time"][1]
            assert values.min() - reach <= least <= most <= values.max() + reach, name


def powers(unit):
    """Powers of mass, length and time of a unit such as "N m" or "m/s^2"."""
    above, _, below = unit.partition("/")
    total = np.zeros(3)
    for part, sign in [*((p, 1) for p in above.split()), *((p, -1) for p in below.split())]:
        symbol, _, power = part.partition("^")
        total += sign * int(power or 1) * np.array(DIMENSIONS[symbol])
    return total


def in_other_units(scene, factors):
    """Dotted keys of the same press, counted in units of mass, length, time smaller by factors."""
    units = {key: powers for keys, powers in KEYS.items() for key in keys.split()}
    changes = {}

    def walk(section, path):
        for key, value in section.items():
            if isinstance(value, dict):
                walk(value, f"{path}{key}.")
            elif key in units and not isinstance(value, str):
                changes[path + key] = (np.array(value) * np.prod(factors ** units[key])).tolist()

    walk({part: scene[part] for part in scene if part not in ("scene", "output", "joints")}, "")
    return changes


@pytest.mark.parametrize(
    "more",
    [{}, {"contact.law": "adams-impact", "load.surface": 0.189, "load.force": 50.0}],
    ids=["usual", "load"],
)
def test_every_channel_has_the_dimension_of_its_unit(run, variant, more):
    """Counted in other units of mass, length and time, each channel changes as channels.toml says.

    The factors are powers of four: squares and square roots (K of Eq. 10) are exact, so is all arithmetic
    that has no length or time of its own. The setting's error is another one, its tolerances being numbers:
    a wrong power is a factor of four.
    """
    factors = np.array([4.0, 0.25, 4.0])
    changes = {"drive.cycles": 0.03, "initial.slider_omega": 0.4, "initial.slider_angle": 3e-4, **more}
    original = run(variant, "150rpm-0.2mm", changes)
    other = run(variant, "150rpm-0.2mm", {**changes, **in_other_units(original.scene, factors)})
    a, b = original.result.events, other.result.events
    assert a["start"].size > 0
    assert np.array_equal(a["corner"], b["corner"])
    for name, values in original.columns.items():
        if name not in ("time", "energy_residual"):  # that is error alone
            factor = np.prod(factors ** powers(channels()[name].unit))
            difference = np.abs(other.columns[name] / factor - values).max()
            assert difference <= 0.05 * np.abs(values).max(), name
    for name, unit in EVENTS.items():
        factor = np.prod(factors ** powers(unit))
        np.testing.assert_allclose(b[name] / factor, a[name], rtol=0.05, err_msg=name)


@pytest.fixture
def turning(run, variant):
    """Two cycles and a fifth, fast, so that they take steps for a few milliseconds of each."""
    changes = {"drive.speed_rpm": 1500.0, "drive.cycles": 2.2, "initial.slider_omega": 0.2}
    return lambda samples: run(variant, "150rpm-0.2mm", {**changes, "output.samples_per_cycle": samples})


def test_extrema_of_each_cycle_lie_in_it_and_those_of_the_run_follow_from_them(turning):
    simulated, period = turning(1000), 0.04
    time, by_cycle = simulated.columns["time"], simulated.result.cycle_extrema
    parts = ("min", "time_of_min", "max", "time_of_max")
    assert set(by_cycle) == {f"{name}_{part}" for name in simulated.result.extrema for part in parts}
    for name, whole in simulated.result.extrema.items():
        least, at_least, most, at_most = (by_cycle[f"{name}_{part}"] for part in parts)
        assert least.shape == at_least.shape == most.shape == at_most.shape == (3,)
        assert (whole["min"], whole["time_of_min"]) == (least.min(), at_least[least.argmin()])
        assert (whole["max"], whole["time_of_max"]) == (most.max(), at_most[most.argmax()])
        # As above; both ends of a cycle belong to it.
        reach = np.inf if name == "energy_residual" else 5e-3 * np.ptp(simulated.columns[name])
        for cycle in range(3):
            within = (time >= period * cycle * (1 - 1e-9)) & (time <= period * (cycle + 1) * (1 + 1e-9))
            for at in (at_least[cycle], at_most[cycle]):
                assert period * cycle * (1 - 1e-9) <= at <= time[within][-1] * (1 + 1e-9), (name, cycle)
            values = simulated.columns[name][within]
            assert least[cycle] <= values.min() + reach, (name, cycle)
            assert most[cycle] >= values.max() - reach, (name, cycle)


@pytest.mark.parametrize("variant", ["reference-minimal", "reference-multiplier"])
def test_extrema_do_not_depend_on_the_samples(turning):
    """Of Exudyn, of runs with the very same steps: `tests/exudyn_model`."""
    few, usual, many = (turning(samples).result for samples in (100, 1000, 10_000))
    for name, column in usual.cycle_extrema.items():
        if not name.startswith("energy_residual"):  # an error of rounding
            for other in (few, many):
                # Times of samples and states that coincide are rounded differently.
                np.testing.assert_allclose(other.cycle_extrema[name], column, rtol=1e-9, atol=1e-12)
