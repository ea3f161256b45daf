"""Contacts: signs of forces, the table of contacts beside the samples, momentum."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, trapezoid

CORNERS = ("ll", "lr", "ul", "ur")
WITH_JOINTS = ["reference-minimal", "reference-multiplier", "exudyn-index2"]


def inward(corner: str) -> int:
    """Sign of the wall's normal into the guide, along x."""
    return 1 if corner[1] == "l" else -1


def arms(run, corner: str) -> tuple[np.ndarray, np.ndarray]:
    """Arm of a corner from the slider's centre in the fixed frame, m: x and y at each sample."""
    slider = run.scene["mechanism"]["slider"]
    sx, sy = -inward(corner) * slider["width"] / 2, (-1 if corner[0] == "l" else 1) * slider["length"] / 2
    cosine, sine = np.cos(run.columns["slider_angle"]), np.sin(run.columns["slider_angle"])
    return cosine * sx - sine * sy, sine * sx + cosine * sy


def test_gap_is_the_distance_of_the_corner_from_its_wall(short) -> None:
    """Positive when open, from the slider's channels: to the round-off of 0.55 m coordinates."""
    mechanism = short.scene["mechanism"]
    half_gap = mechanism["slider"]["width"] / 2 + short.scene["clearance"]["slider"]
    for corner in CORNERS:
        rx, _ = arms(short, corner)
        wall = mechanism["guide_x"] - inward(corner) * half_gap
        gap = inward(corner) * (short.columns["slider_x"] + rx - wall)
        assert np.all(np.abs(short.columns[f"corner_{corner}_gap"] - gap) <= 1e-15)


def test_walls_press_and_friction_opposes_the_corner_s_material(short) -> None:
    """normal >= 0; |friction| <= c_f normal, opposite to vy + omega r_x, full above v1."""
    friction_law = short.scene["friction"]
    pressed = 0
    for corner in CORNERS:
        normal, friction = (short.columns[f"corner_{corner}_{part}"] for part in ("normal", "friction"))
        slip = short.columns["slider_vy"] + short.columns["slider_omega"] * arms(short, corner)[0]
        assert np.all(normal >= 0.0)
        assert np.all(friction * slip <= 0.0)
        largest = friction_law["coefficient"] * normal
        assert np.all(np.abs(friction) <= largest * (1 + 1e-12))  # a few roundings
        full = np.abs(slip) > 1.01 * friction_law["transition_speed"]
        np.testing.assert_allclose(np.abs(friction)[full], largest[full], rtol=1e-9)
        pressed += np.count_nonzero(normal[full])
    assert pressed > 100  # samples that could have the wrong sign


def test_accelerations_are_the_forces_over_the_masses(short) -> None:
    """J5 alpha = moment of all corners; what rod 4 adds to m5 a is no moment."""
    slider = short.scene["mechanism"]["slider"]
    moment = np.zeros_like(short.columns["time"])
    for corner in CORNERS:
        rx, ry = arms(short, corner)
        normal, friction = (short.columns[f"corner_{corner}_{part}"] for part in ("normal", "friction"))
        moment += rx * friction - ry * inward(corner) * normal
    spin = slider["inertia"] * short.columns["slider_alpha"]
    assert np.ptp(spin) > 0.01
    # Arms of up to 0.05 m times forces of up to 100 N: some 1e-15 N m of rounding.
    assert np.abs(spin - moment).max() <= 1e-13


def test_only_contacts_of_the_table_bear_a_force(short) -> None:
    """Outside its contacts a corner is open and free, inside it is in the wall."""
    time = short.columns["time"]
    for corner in CORNERS:
        gap, normal = (short.columns[f"corner_{corner}_{part}"] for part in ("gap", "normal"))
        inside, near = np.zeros(time.size, bool), np.zeros(time.size, bool)
        for contact in short.contacts(corner):
            inside |= (contact["start"] < time) & (time < contact["end"])
            # Starts and ends are known to the interpolation within a step or to the location's rounding.
            for edge in (contact["start"], contact["end"]):
                near |= np.abs(time - edge) < 1e-8
        assert np.all(gap[~inside & ~near] >= 0.0), corner
        assert np.all(normal[~inside & ~near] == 0.0), corner
        assert np.all(gap[inside & ~near] <= 0.0), corner


def test_table_of_contacts_is_in_order_and_in_range(short) -> None:
    events, scene = short.result.events, short.scene
    assert events["start"].size >= 10
    assert set(events["corner"]) <= set(CORNERS)
    assert np.all(np.diff(events["start"]) >= 0.0)
    assert np.all(events["end"] > events["start"])
    assert np.all(events["start"] >= 0.0)
    # The last state may lie a rounding of the sum of the steps beyond the last sample.
    assert np.all(events["end"] <= short.columns["time"][-1] * (1 + 1e-12))
    assert np.all(events["normal_speed"] >= scene["contact"]["impact_speed_floor"])
    assert np.all(events["peak_force"] > 0.0)
    for corner in CORNERS:
        contacts = short.contacts(corner)
        for earlier, later in pairwise(contacts):
            assert earlier["end"] <= later["start"]


def samples_of(run, contact):
    time = run.columns["time"]
    return (contact["start"] <= time) & (time <= contact["end"])


def test_peaks_depths_and_impact_speeds_are_those_of_the_samples(short) -> None:
    for corner in CORNERS:
        gap, normal = (short.columns[f"corner_{corner}_{part}"] for part in ("gap", "normal"))
        for contact in short.contacts(corner):
            at = samples_of(short, contact)
            assert at.sum() > 20
            # Fifty samples a contact miss the top of an arch by some (pi / 50)^2 / 8 of it.
            assert contact["peak_force"] == pytest.approx(normal[at].max(), rel=2e-3)
            assert contact["largest_depth"] == pytest.approx(-gap[at].min(), rel=2e-3)
            if contact["start"] > 0.0:
                _, ry = arms(short, corner)
                rate = inward(corner) * (short.columns["slider_vx"] - short.columns["slider_omega"] * ry)
                touch = -np.interp(contact["start"], short.columns["time"], rate)
                # The rate is straight to (4e-6 s)^2 / 8 times its curvature: below 1e-5 m/s.
                assert contact["normal_speed"] == pytest.approx(max(touch, 1e-4), abs=2e-5)


def test_impulse_is_the_integral_of_the_normal_force(short) -> None:
    for corner in CORNERS:
        time, normal = short.columns["time"], short.columns[f"corner_{corner}_normal"]
        for contact in short.contacts(corner):
            at = samples_of(short, contact)
            summed = trapezoid(normal[at], time[at])
            # The trapezoidal rule over n samples of an arch is right to some 1 / n^2, here with what lies
            # between the first and last sample and the ends, where the force is nearly zero.
            assert contact["impulse"] == pytest.approx(summed, rel=2e-3)


def test_impulses_and_friction_turn_the_slider(short) -> None:
    """Impulse and momentum over each stretch with contact: J5 times the change of spin is their moment.

    The impulses are those of the table; friction is full nearly all the time, so its moment goes with them.
    """
    slider, friction = short.scene["mechanism"]["slider"], short.scene["friction"]["coefficient"]
    time, omega = short.columns["time"], short.columns["slider_omega"]
    rows = sorted(
        (c["start"], c["end"], corner, c["impulse"]) for corner in CORNERS for c in short.contacts(corner)
    )
    stretches: list[list] = []
    for row in rows:
        if stretches and row[0] <= max(r[1] for r in stretches[-1]):
            stretches[-1].append(row)
        else:
            stretches.append([row])
    checked = 0
    for stretch in stretches:
        begin, end = stretch[0][0], max(r[1] for r in stretch)
        if begin == 0.0 or end >= time[-1]:
            continue
        before, after = np.searchsorted(time, begin) - 1, np.searchsorted(time, end)
        moment = size = 0.0
        for start, stop, corner, impulse in stretch:
            middle = (start <= time) & (time <= stop)
            rx, ry = (arm[middle].mean() for arm in arms(short, corner))
            slip = short.columns["slider_vy"] + short.columns["slider_omega"] * rx
            if not (np.all(slip[middle] > 1e-3) or np.all(slip[middle] < -1e-3)):
                break  # friction changes its sign: not a product of the impulse
            share = -friction * math.copysign(1.0, slip[middle].mean())
            moment += (rx * share - ry * inward(corner)) * impulse
            size += abs(ry) * impulse
        else:
            checked += 1
            # The arms turn by less than 6e-3 rad within a contact: half of that times 25 mm of 35.
            assert slider["inertia"] * (omega[after] - omega[before]) == pytest.approx(
                moment, abs=3e-3 * size
            )
    assert checked >= 4


@pytest.mark.parametrize("variant", WITH_JOINTS)
@pytest.mark.parametrize("name", ["rattle", "wedge"])
def test_reactions_move_the_slider(run, variant, name) -> None:
    """Force of pin F on the higher-numbered body, the slider: with weight and walls it is m5 a."""
    found = run(variant, name)
    slider = found.scene["mechanism"]["slider"]
    fx = found.columns["reaction_F_x"].copy()
    fy = found.columns["reaction_F_y"] - slider["mass"] * found.scene["environment"]["gravity"]
    for corner in CORNERS:
        fx += inward(corner) * found.columns[f"corner_{corner}_normal"]
        fy += found.columns[f"corner_{corner}_friction"]
    scale = np.ptp(found.columns["reaction_F_x"])
    # Exudyn's multipliers carry what its Newton iteration leaves, 1e-6 of the range; the reference's follow
    # from the same balance.
    bound = 1e-11 if found.reference else 2e-6
    assert np.abs(fx - slider["mass"] * found.columns["slider_ax"]).max() <= bound * scale
    assert np.abs(fy - slider["mass"] * found.columns["slider_ay"]).max() <= bound * scale


@pytest.mark.parametrize("variant", WITH_JOINTS)
def test_the_motor_s_torque_does_its_work(run, variant) -> None:
    """Counter-clockwise positive, on the crank: the integral of torque times crank speed is energy_drive."""
    found = run(variant, "rattle")
    power = found.columns["crank_torque"] * found.scene["drive"]["speed_rpm"] * math.pi / 30.0
    work = cumulative_trapezoid(power, found.columns["time"], initial=0.0)
    # Samples of 4e-6 s through hits of 2e-4 s: (1/50)^2 / 12 of what the torque does in them.
    assert np.abs(work - found.columns["energy_drive"]).max() <= 1e-4 * np.ptp(work)


@pytest.mark.parametrize(("vx", "speed"), [(0.0, 1e-4), (3e-5, 1e-4), (0.02, 0.02), (-0.02, 1e-4)])
def test_a_corner_that_starts_inside_its_wall_has_its_own_impact_speed_or_the_floor(
    run, variant, vx, speed
) -> None:
    """A corner with a depth at t = 0 is in contact with max(speed(0), floor)."""
    changes = {"initial.slider_offset": 2.02e-4, "initial.slider_vx": vx, "drive.cycles": 0.002}
    found = run(variant, "150rpm-0.2mm", changes)
    for corner in ("lr", "ur"):
        first = found.contacts(corner)[0]
        assert first["start"] == 0.0
        assert first["normal_speed"] == pytest.approx(speed, rel=1e-9)
        assert first["largest_depth"] >= 2e-6 * (1 - 1e-9)
    assert not found.contacts("ll")
    assert not found.contacts("ul")


@pytest.mark.parametrize("variant", ["reference-minimal", "reference-multiplier", "exudyn-tree"])
def test_what_starts_far_inside_its_wall_leaves_where_damping_has_taken_the_force_away(run, variant) -> None:
    """Its force of 9 MN accelerates it outwards until 1 + C d'/v = 0, within some 1e-11 s.

    On the way nothing else moves it, so the impulse is mass times v / C; the mass is that which the force
    accelerates at t = 0. Samples are 4e-9 s apart.
    """
    changes = {"initial.slider_offset": 0.01, "initial.slider_vx": 0.0, "friction.coefficient": 0.0}
    found = run(
        variant,
        "150rpm-0.2mm",
        {**changes, "drive.cycles": 1e-7, "output.samples_per_cycle": 100_000_000},
    )
    contact = found.scene["contact"]
    force = sum(found.columns[f"corner_{corner}_normal"][0] for corner in ("lr", "ur"))
    mass = -force / found.columns["slider_ax"][0]
    speed = contact["impact_speed_floor"] / (0.75 * (1.0 - contact["restitution"] ** 2))
    impulse = sum(found.contacts(corner)[0]["impulse"] for corner in ("lr", "ur"))
    # The linkage's own 3 m/s^2 give 1e-6 of v / C until the force is gone; measured 1.1e-6 and 1.6e-6.
    assert impulse == pytest.approx(mass * speed, rel=1e-5)
    assert np.all(found.columns["corner_lr_normal"][1:] == 0.0)
