"""Contacts: signs of forces, the table of contacts beside the samples, momentum."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import trapezoid

CORNERS = {"ll": 1, "lr": -1, "ul": 1, "ur": -1}
"""With the sign of the wall's normal into the guide, along x."""


def test_gaps_and_forces_are_those_of_the_slider_s_motion(short):
    """Gap from its wall; normal >= 0; |friction| <= c_f normal, opposite to the slip; J5 alpha = moment."""
    mechanism, law = short.scene["mechanism"], short.scene["friction"]
    half_gap = mechanism["slider"]["width"] / 2 + short.scene["clearance"]["slider"]
    pressed, moment = 0, np.zeros_like(short.columns["time"])
    for corner, inward in CORNERS.items():
        gap, normal, friction, rx, ry, _, slip = short.corner(corner)
        # To the round-off of 0.55 m coordinates.
        own = inward * (short.columns["slider_x"] + rx - mechanism["guide_x"]) + half_gap
        assert np.abs(gap - own).max() <= 1e-15
        assert np.all(normal >= 0.0)
        assert np.all(friction * slip <= 0.0)
        largest = law["coefficient"] * normal
        assert np.all(np.abs(friction) <= largest * (1 + 1e-12))  # a few roundings
        full = np.abs(slip) > 1.01 * law["transition_speed"]
        np.testing.assert_allclose(np.abs(friction)[full], largest[full], rtol=1e-9)
        pressed += np.count_nonzero(normal[full])
        moment += rx * friction - ry * inward * normal
    assert pressed > 100  # samples that could have the wrong sign
    spin = mechanism["slider"]["inertia"] * short.columns["slider_alpha"]
    assert np.ptp(spin) > 0.01
    # Arms of up to 0.05 m times forces of up to 100 N: some 1e-15 N m of rounding.
    assert np.abs(spin - moment).max() <= 1e-13


def test_table_of_contacts_is_that_of_the_samples(short):
    """In order; outside its contacts a corner is open and free, inside it is in the wall; peaks, impulses."""
    events, time = short.result.events, short.columns["time"]
    assert events["start"].size >= 10
    assert set(events["corner"]) <= set(CORNERS)
    assert np.all(np.diff(events["start"]) >= 0.0)
    assert np.all(events["end"] > events["start"])
    assert events["start"].min() >= 0.0
    # The last state may lie a rounding of the sum of the steps beyond the last sample.
    assert events["end"].max() <= time[-1] * (1 + 1e-12)
    assert events["normal_speed"].min() >= short.scene["contact"]["impact_speed_floor"]
    assert events["peak_force"].min() > 0.0
    for corner in CORNERS:
        gap, normal, *_, rate, _ = short.corner(corner)
        inside, near = np.zeros(time.size, bool), np.zeros(time.size, bool)
        for earlier, later in pairwise(short.contacts(corner)):
            assert earlier["end"] <= later["start"]
        for contact in short.contacts(corner):
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
    """From the first corner's touch, at its speed, to the last one's separation, by the gaps alone."""
    simulated = run(variant, "150rpm-0.2mm", changes | {"contact.law": "foundation"})
    events, columns, time = simulated.result.events, simulated.columns, simulated.columns["time"]
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
            own, other = gaps[first, during], gaps[1 - first, during]
            assert own[0] < min(0.0, other[0])
            # By differences over the last interval of flight, in which 500 m/s^2 add 1e-4 m/s.
            last = during.argmax() - 1
            touch = (gaps[first, last - 1] - gaps[first, last]) / time[1]
            assert touch == pytest.approx(events["normal_speed"][row], abs=2e-4)
            # Forty samples of the shortest contact, its peak within half an interval: (pi / 80)^2 / 2
            assert events["peak_force"][row] == pytest.approx(force[during].max(), rel=2e-3)
            assert events["largest_depth"][row] == pytest.approx(-gaps[:, during].min(), rel=2e-3)
            assert events["impulse"][row] == pytest.approx(trapezoid(force[during], time[during]), rel=2e-3)
            joined.append(bool((other < 0.0).any()))
            outlasted.append(bool(own[-1] > 0.0))
        assert np.all(gaps[:, ~covered] >= -1e-11)
    assert len(joined) == count
    assert any(joined)
    assert any(outlasted) == (count == 1)  # a contact keeps the name of a corner that leaves first


@pytest.mark.parametrize(("vx", "speed"), [(0.0, 1e-4), (3e-5, 1e-4), (0.02, 0.02), (-0.02, 1e-4)])
def test_a_corner_that_starts_inside_its_wall_has_its_own_impact_speed_or_the_floor(run, variant, vx, speed):
    changes = {"initial.slider_offset": 2.02e-4, "initial.slider_vx": vx, "drive.cycles": 0.002}
    simulated = run(variant, "150rpm-0.2mm", changes)
    for corner in ("lr", "ur"):
        first = simulated.contacts(corner)[0]
        assert first["start"] == 0.0
        assert first["normal_speed"] == pytest.approx(speed, rel=1e-9)
        assert first["largest_depth"] >= 2e-6 * (1 - 1e-9)
    assert not simulated.contacts("ll") + simulated.contacts("ul")


@pytest.mark.parametrize("variant", ["reference-minimal", "reference-multiplier", "exudyn-tree"])
def test_what_starts_far_inside_its_wall_leaves_where_damping_has_taken_the_force_away(run, variant):
    """Its force of 9 MN accelerates it outwards until 1 + C d'/v = 0, within some 1e-11 s.

    On the way nothing else moves it, so the impulse is mass times v / C; the mass is that which the force
    accelerates at t = 0. Samples are 4e-9 s apart.
    """
    changes = {"initial.slider_offset": 0.01, "initial.slider_vx": 0.0, "friction.coefficient": 0.0}
    dense = {"drive.cycles": 1e-7, "output.samples_per_cycle": 100_000_000}
    simulated = run(variant, "150rpm-0.2mm", changes | dense)
    contact, pressed = simulated.scene["contact"], ("lr", "ur")
    force = sum(simulated.columns[f"corner_{corner}_normal"][0] for corner in pressed)
    mass = -force / simulated.columns["slider_ax"][0]
    speed = contact["impact_speed_floor"] / (0.75 * (1.0 - contact["restitution"] ** 2))
    # The linkage's own 3 m/s^2 give 1e-6 of v / C until the force is gone; measured 1.1e-6 and 1.6e-6.
    impulse = sum(simulated.contacts(corner)[0]["impulse"] for corner in pressed)
    assert impulse == pytest.approx(mass * speed, rel=1e-5)
    assert np.all(simulated.columns["corner_lr_normal"][1:] == 0.0)
