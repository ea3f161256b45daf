"""Contacts: their table beside samples and pulses, grazing ones, those of a whole side, the journal's."""

from itertools import pairwise

import numpy as np
import pytest
from page_formulas import CORNERS, Numbers
from scipy.integrate import trapezoid


def test_table_of_contacts_is_that_of_the_samples(short_run):
    """Rows are in order; a corner is open outside its contacts, in the wall inside them; peaks, impulses."""
    events, time = short_run.result.events, short_run.columns["time"]
    assert events["start"].size >= 10
    assert set(events["corner"]) <= set(CORNERS)
    assert np.all(np.diff(events["start"]) >= 0.0)
    assert np.all(events["end"] > events["start"])
    assert events["start"].min() >= 0.0
    # The last state may lie a rounding of the sum of the steps beyond the last sample.
    assert events["end"].max() <= time[-1] * (1 + 1e-12)
    assert events["normal_speed"].min() >= short_run.scene["contact"]["impact_speed_floor"]
    assert events["peak_force"].min() > 0.0
    motion = [short_run.columns[f"slider_{name}"] for name in ("x", "angle", "vx", "vy", "omega")]
    for number, corner in enumerate(CORNERS):
        gap, normal = (short_run.columns[f"corner_{corner}_{part}"] for part in ("gap", "normal"))
        rate = Numbers(short_run.scene).corner(number, *motion)[1]
        inside, near = np.zeros(time.size, bool), np.zeros(time.size, bool)
        for earlier, later in pairwise(short_run.contacts(corner)):
            assert earlier["end"] <= later["start"]
        for contact in short_run.contacts(corner):
            inside |= (contact["start"] < time) & (time < contact["end"])
            # Starts and ends are known to the interpolation within a step or to the location's rounding.
            for edge in (contact["start"], contact["end"]):
                near |= np.abs(time - edge) < 1e-8
            at = (contact["start"] <= time) & (time <= contact["end"])
            assert at.sum() > 20
            # Fifty samples a contact miss the top of an arch by some (pi / 50)^2 / 8 of it; the trapezoidal
            # rule is right to some 1 / n^2, here with what lies between the outer samples and the ends.
            assert contact["peak_force"] == pytest.approx(normal[at].max(), rel=2e-3)
            assert contact["largest_depth"] == pytest.approx(-gap[at].min(), rel=2e-3)
            assert contact["impulse"] == pytest.approx(trapezoid(normal[at], time[at]), rel=2e-3)
            if contact["start"] > 0.0:
                # The rate is straight to (4e-6 s)^2 / 8 times its curvature: below 1e-5 m/s.
                touch = np.interp(contact["start"], time, rate)
                assert contact["normal_speed"] == pytest.approx(max(touch, 1e-4), abs=2e-5)
        assert np.all(gap[~inside & ~near] >= 0.0), corner
        assert np.all(normal[~inside & ~near] == 0.0), corner
        assert np.all(gap[inside & ~near] <= 0.0), corner


def assert_pulses(simulation):
    """Require sorted pulses within their contacts, up to the peak; those of Exudyn have the impulse, too."""
    events, pulses = simulation.result.events, simulation.result.pulses
    row, time, force = (pulses[name] for name in ("row", "time", "force"))
    assert np.all(np.diff(row) >= 0)
    assert np.all(np.diff(time)[np.diff(row) == 0] > 0.0)
    assert np.all((time >= events["start"][row]) & (time <= events["end"][row]))
    assert np.all((force >= 0.0) & (force <= events["peak_force"][row] * (1.0 + 1e-12)))
    each = [np.flatnonzero(row == i) for i in range(events["start"].size)]
    shares = np.array([force[samples].max(initial=0.0) for samples in each]) / events["peak_force"]
    assert np.median(shares) > 0.95
    if not simulation.reference:
        # The pulse has states at the ends of steps, forty in the shortest contact: 1 - cos(pi / 80) = 8e-4.
        assert shares.min() >= 1.0 - 1e-3
        for samples, start, end, impulse in zip(
            each, *(events[k] for k in ("start", "end", "impulse")), strict=True
        ):
            first, last = (
                force[k] if edge == time[k] else 0.0 for k, edge in ((samples[0], start), (samples[-1], end))
            )
            area = np.trapezoid([first, *force[samples], last], [start, *time[samples], end])
            # Of a half sine the trapezoids of ten samples miss (pi / 10)^2 / 12 = 0.8 %, unequal ones more.
            assert area == pytest.approx(impulse, rel=0.02)


def test_pulses_are_the_forces_of_the_contacts(short_run):
    assert_pulses(short_run)


@pytest.mark.parametrize("variant", ["reference-minimal", "exudyn-tree"])
def test_a_grazing_touch_within_one_step_is_seen(run, variant):
    """The turning point of a first flight lies 1e-9 m inside the wall, for a part of a step."""
    press = {"clearance.slider": 5e-4, "initial.slider_vx": 0.02, "drive.cycles": 0.025}
    flight = run("reference-minimal", "150rpm-0.2mm", press | {"output.samples_per_cycle": 200_000})
    assert flight.result.events["start"].size == 0
    turn = flight.columns["slider_x"].max() + 0.55
    settings = {"solver.reference.tolerance": 3e-6, "solver.exudyn.tolerance": 1e-9}
    events = run(variant, "150rpm-0.2mm", press | settings | {"clearance.slider": turn - 1e-9}).result.events
    assert set(events["corner"]) == {"lr", "ur"}
    # The sampled turning point is off by at most a sample's fall, (2e-6 s)^2 * 10 m/s^2 = 4e-11 m.
    assert events["largest_depth"].max() == pytest.approx(1e-9, rel=0.05)


@pytest.mark.parametrize("variant", ["reference-minimal", "exudyn-tree"])
@pytest.mark.parametrize(
    ("changes", "count"),
    [
        ({"drive.cycles": 0.1, "output.samples_per_cycle": 2_000_000}, 7),
        # A nearly flat side at 0.05 m/s, samples 2e-8 s apart
        ({"initial.slider_offset": 1.9e-4, "initial.slider_angle": 3e-6, "initial.slider_vx": 0.05,
          "drive.cycles": 0.004, "output.samples_per_cycle": 20_000_000}, 1),
    ],
    ids=["dense", "flat"],
)  # fmt: skip
def test_a_side_of_a_foundation_has_one_row_a_contact(run, variant, changes, count):
    """A row lasts from the first corner's touch, at its speed, to the last one's separation, by the gaps."""
    simulation = run(variant, "150rpm-0.2mm", changes | {"contact.law": "foundation"})
    assert_pulses(simulation)
    events, columns, time = simulation.result.events, simulation.columns, simulation.columns["time"]
    joined, outlasted = [], []
    for side in (("ll", "ul"), ("lr", "ur")):
        gaps = np.array([columns[f"corner_{corner}_gap"] for corner in side])
        force = sum(columns[f"corner_{corner}_normal"] for corner in side)
        covered = np.zeros(time.size, dtype=bool)
        for row in np.flatnonzero(np.isin(events["corner"], side)):
            during = (time > events["start"][row]) & (time < events["end"][row])
            assert not covered[during].any()
            covered |= during
            assert np.all(gaps[:, during].min(axis=0) < 0.0)
            first = side.index(events["corner"][row])
            gap, other = gaps[first, during], gaps[1 - first, during]
            assert gap[0] < min(0.0, other[0])
            # By differences over the last interval of flight, in which 500 m/s^2 add 1e-4 m/s.
            last = during.argmax() - 1
            touch = (gaps[first, last - 1] - gaps[first, last]) / time[1]
            assert touch == pytest.approx(events["normal_speed"][row], abs=2e-4)
            # Forty samples of the shortest contact, its peak within half an interval: (pi / 80)^2 / 2
            assert events["peak_force"][row] == pytest.approx(force[during].max(), rel=2e-3)
            assert events["largest_depth"][row] == pytest.approx(-gaps[:, during].min(), rel=2e-3)
            assert events["impulse"][row] == pytest.approx(trapezoid(force[during], time[during]), rel=2e-3)
            joined.append(bool((other < 0.0).any()))
            outlasted.append(bool(gap[-1] > 0.0))
        assert np.all(gaps[:, ~covered] >= -1e-11)
    assert len(joined) == count
    assert any(joined)
    assert any(outlasted) == (count == 1)  # a contact keeps the name of a corner that leaves first


@pytest.mark.parametrize(("vx", "speed"), [(0.0, 1e-4), (3e-5, 1e-4), (0.02, 0.02), (-0.02, 1e-4)])
def test_a_corner_that_starts_inside_its_wall_has_its_own_impact_speed_or_the_floor(run, variant, vx, speed):
    changes = {"initial.slider_offset": 2.02e-4, "initial.slider_vx": vx, "drive.cycles": 0.002}
    simulation = run(variant, "150rpm-0.2mm", changes)
    for corner in ("lr", "ur"):
        first = simulation.contacts(corner)[0]
        assert first["start"] == 0.0
        assert first["normal_speed"] == pytest.approx(speed, rel=1e-9)
        assert first["largest_depth"] >= 2e-6 * (1 - 1e-9)
    assert not simulation.contacts("ll") + simulation.contacts("ul")


# Three bounces of 0.1 to 0.3 ms without losses. Samples 2e-6 s apart.
BOUNCES = {
    "contact.restitution": 1.0,
    "friction.coefficient": 0.0,
    "drive.cycles": 0.0195,
    "output.samples_per_cycle": 200_000,
}


@pytest.mark.parametrize("variant", ["reference-minimal", "exudyn-full", "exudyn-index2", "exudyn-tree"])
def test_the_journal_starts_centred_and_touches_where_its_distance_is_the_clearance(run, variant):
    """The journal's table of contacts is that of the samples."""
    simulation = run(variant, "crank-pin", BOUNCES)
    columns, time = simulation.columns, simulation.columns["time"]
    e = columns["journal_x"] + 1j * columns["journal_y"]
    depth, contacts = np.abs(e) - simulation.scene["clearance"]["crank_pin"], simulation.contacts("pin")
    assert len(contacts) == 3
    assert abs(e[0]) < 1e-15  # a difference of coordinates of 0.3 m
    near, touching = np.zeros(time.size, bool), np.zeros(time.size, bool)
    for contact in contacts:
        inside = (contact["start"] < time) & (time < contact["end"])
        # Fifty samples a contact miss the top of an arch by some (pi / 50)^2 / 8 of it.
        assert contact["largest_depth"] == pytest.approx(depth[inside].max(), rel=2e-3)
        touching |= inside
        for edge in (contact["start"], contact["end"]):
            near |= np.abs(time - edge) < 1e-8  # as for corners, see test_contacts.py
    assert np.array_equal((depth > 0.0)[~near], touching[~near])
