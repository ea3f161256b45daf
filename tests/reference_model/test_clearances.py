"""Clearances at pins and guides of linkages: against the press, a published start, and conservation laws."""

import math

import numpy as np
import pytest
from linkage_scenes import (
    ALL,
    DOUBLE_FOUR_BAR,
    NAMES,
    linkage,
    loose_guide,
    loose_pin,
    pins,
    press,
    rod,
    slider_crank,
)

from comparison.scene import load_scene
from reference_model import simulate

EVERY = [*ALL, "contacts"]
LOSSLESS, RUBBING = {"restitution": 1.0}, {"coefficient": 0.3}


def success(scene):
    result = simulate(scene)
    assert (result.status, result.remedy) == ("success", "")
    return result


def test_the_published_slider_crank_first_touches_with_two_corners_at_once():
    """Flores, Leine and Glocker (2010): free flight until 2.692503 ms."""
    result = success(slider_crank(clearance={"G": loose_guide(1e-3, 0.1, 0.05)}, duration=0.01))
    assert [str(corner) for corner in result.events["corner"]] == ["G.ll", "G.ul"]
    np.testing.assert_allclose(result.events["start"], 2.692503e-3, atol=1e-9, rtol=0)
    assert np.ptp(result.events["start"]) == 0.0
    rows, at = result.pulses["row"], result.pulses["time"]
    assert set(rows.tolist()) == {0, 1}
    assert at.min() >= result.events["start"][0]
    # What the corners do to the slider, by the balance of its momentum
    columns = result.columns
    force = 0.076 * (columns["slider.ay"] + 9.81) - columns["B.reaction_y"]
    np.testing.assert_allclose(columns["G.force"], force, atol=1e-8 * np.abs(force).max(), rtol=0)
    assert np.abs(columns["G.force"]).max() > 100.0


def test_a_linkage_on_which_nothing_acts_stays_at_rest():
    initial = {"rod": {"angle_deg": 20.0}}
    scene = linkage({"rod": rod()}, gravity=0.0, pin=pins(((0.0, 0.0), "rod.start")), initial=initial)
    columns = success(scene | {"clearance": {"P0": loose_pin(1e-3)}}).columns
    assert np.ptp(columns["rod.x"]) == np.ptp(columns["rod.angle"]) == 0.0


PRESS = {
    "slider": ("multiplier", {}, 0.5),
    "adams-impact": ("multiplier", {"contact.law": "adams-impact"}, 0.5),
    "pin": ("minimal", {"joints.crank_pin": "clearance", "joints.slider": "ideal"}, 0.03),
    "both": ("minimal", {"joints.crank_pin": "clearance", "initial.slider_angle": 1e-4}, 0.03),
}


@pytest.mark.parametrize("case", PRESS)
def test_the_press_as_a_linkage_moves_as_the_press(case):
    """As multipliers with Baumgarte's terms, and as a chain that is cut at the crank pin."""
    formulation, changes, cycles = PRESS[case]
    usual = {
        "drive.cycles": cycles,
        "solver.reference.formulation": formulation,
        "solver.reference.tolerance": 1e-12,
        "output.groups": ["accelerations", "corners", "joints", "energy"],
        "clearance.crank_pin": 1e-4,
    }
    scene = load_scene("150rpm-0.2mm", usual | changes).data
    exact, simulated = simulate(scene), success(press(scene))
    events, own = exact.events, simulated.events
    order, mine = (np.lexsort((e["corner"], np.round(e["start"], 9))) for e in (events, own))
    assert order.size >= 5
    assert [NAMES.get(str(corner)) for corner in events["corner"][order]] == [*map(str, own["corner"][mine])]
    np.testing.assert_allclose(own["start"][mine], events["start"][order], atol=1e-8, rtol=0)
    largest = {
        column: events[column].max() for column in ("normal_speed", "impulse", "peak_force", "largest_depth")
    }
    for column, scale in largest.items():
        np.testing.assert_allclose(own[column][mine], events[column][order], atol=1e-5 * scale, rtol=0)
    before = exact.columns["time"] < min(events["start"][0], own["start"][0])
    assert before.sum() > 5
    for name, values in exact.columns.items():
        if name in ("time", "energy_residual") or np.ptp(values) < 1e-12:  # of an ideal slider
            continue
        if name == "guide_force":  # along -x
            name, values = "G.force", -values
        theirs, scale = simulated.columns[NAMES.get(name, name)], np.ptp(values) or 1.0
        # Coordinates of 0.55 m round at 1e-16 m
        bound = 1e-12 * scale + 2e-15
        np.testing.assert_allclose(theirs[before], values[before], atol=bound, rtol=0, err_msg=name)
        np.testing.assert_allclose(theirs, values, atol=1e-3 * scale, rtol=0, err_msg=name)


def worn(**tables):
    """A crank-rocker, of which all pins and a guide on the rocker can be loose."""
    body = {
        "crank": rod(0.1, 0.5),
        "coupler": rod(0.3, 1.2, centroid=[0.14, 0.01]),
        "rocker": rod(0.25, 0.8),
        "block": {"mass": 0.3, "inertia": 2e-4, "points": {}, "centroid": [0.0, 0.0]},
    }
    joined = pins(
        ((0.0, 0.0), "crank.start"),
        ("crank.end", "coupler.start"),
        ((0.28, 0.0), "rocker.start"),
        ("coupler.end", "rocker.end"),
    )
    guide = {
        "G": {"body": "block", "on": "rocker", "point": [0.05, 0.02], "direction_deg": 5.0, "angle_deg": 20.0}
    }
    spring = {
        "S": {"joins": ["rocker.start", "block.centroid"], "stiffness": 400.0, "length": 0.1, "damping": 0.0}
    }
    usual = {
        "guess": {
            "coupler": {"angle_deg": 50.0},
            "rocker": {"angle_deg": 110.0},
            "block": {"x": 0.24, "y": 0.1},
        },
        "initial": {"crank": {"angle_deg": 30.0, "omega": 20.0}, "block": {"x": 0.24, "vx": 0.2}},
        "groups": EVERY,
    }
    return linkage(body, pin=joined, guide=guide, spring=spring, **(usual | tables))


def test_without_losses_energy_only_changes_its_place():
    laws = {"contact": LOSSLESS}
    clearance = {"P1": loose_pin(2e-4, **laws), "G": loose_guide(3e-4, 0.04, 0.03, **laws)}
    clearance |= {"P2": loose_pin(1e-4, **laws)}
    result = success(worn(clearance=clearance, duration=0.1))
    columns = result.columns
    assert {"P1", "P2", "G.ll"} <= {*map(str, result.events["corner"])}
    assert np.abs(columns["energy_damping"]).max() < 1e-9
    assert not columns["energy_friction"].any()
    stored = sum(columns[f"energy_{part}"] for part in ("kinetic", "contact", "spring"))
    total = stored - columns["energy_gravity"]
    np.testing.assert_allclose(total, total[0], atol=1e-8 * total[0], rtol=0)


DRIVES = {
    "speed": {"drive": {"body": "crank", "speed_rpm": 200.0, "cycles": 1.0}},
    "torque": {"drive": {"body": "crank", "torque": 2.0}},
    "table": {"drive": {"body": "crank", "torque_table": [[0.0, 1.0], [100.0, 3.0], [360.0, 1.0]]}},
    "free": {},
}


@pytest.mark.parametrize("drive", DRIVES)
def test_losses_and_the_drive_s_work_balance_at_tolerance(drive):
    laws = {"friction": RUBBING}
    clearance = {"P1": loose_pin(2e-4, **laws), "G": loose_guide(2e-4, 0.04, 0.03, **laws)}
    by_speed = {"initial": {"crank": {"angle_deg": 30.0}, "block": {"x": 0.24, "vx": 0.2}}}
    usual = DRIVES[drive] | (by_speed if drive == "speed" else {"duration": 0.2})
    residuals = []
    for tolerance in (1e-8, 1e-10):
        result = success(worn(clearance=clearance, tolerance=tolerance, **usual))
        columns = result.columns
        assert columns["energy_damping"][-1] > 1e-3
        assert columns["energy_friction"][-1] > 1e-3
        assert len(result.events["start"]) > 20
        residuals.append(np.abs(columns["energy_residual"]).max() / columns["energy_kinetic"].max())
        assert residuals[-1] < 300.0 * tolerance
    # Forces of joints balance each body: the block by its guide and spring alone
    pull = columns["S.force"]
    rocker, block = (np.array([columns[f"{name}.{axis}"] for axis in "xy"]) for name in ("rocker", "block"))
    angle = columns["rocker.angle"]
    start = rocker - 0.125 * np.array([np.cos(angle), np.sin(angle)])
    along = (start - block) / np.hypot(*(start - block))
    force = 0.3 * np.array([columns["block.ax"], columns["block.ay"] + 9.81]) - pull * along
    n = np.array([-np.sin(angle + math.radians(5.0)), np.cos(angle + math.radians(5.0))])
    across = (force * n).sum(axis=0)
    np.testing.assert_allclose(columns["G.force"], across, atol=1e-7 * np.abs(across).max(), rtol=0)
    moment = 2e-4 * columns["block.alpha"]
    np.testing.assert_allclose(columns["G.moment"], moment, atol=1e-7 * np.abs(moment).max(), rtol=0)
    rubbed = -n[::-1] * [[-1.0], [1.0]]
    friction = sum(columns[f"G.{corner}_friction"] for corner in ("ll", "lr", "ul", "ur"))
    np.testing.assert_allclose(
        friction, (force * rubbed).sum(axis=0), atol=1e-6 * np.abs(across).max(), rtol=0
    )


@pytest.mark.parametrize("joint", ["pin", "guide"])
def test_a_joint_of_two_free_bodies_conserves_both_momenta(joint):
    """Contact and friction act on both bodies alike, with the moments of the same place."""
    one = {"mass": 0.7, "inertia": 2e-3, "points": {"P": [0.1, 0.03]}, "centroid": [0.02, 0.01]}
    two = {"mass": 0.4, "inertia": 1e-3, "points": {"P": [-0.06, 0.02]}, "centroid": [0.0, 0.0]}
    joints = {"pin": {"J": {"joins": ["one.P", "two.P"]}}}
    clearance = loose_pin(3e-4, friction=RUBBING)
    rates = {"vx": 0.3, "vy": -0.2, "omega": 8.0}
    if joint == "guide":
        joints = {"guide": {"J": {"body": "two", "on": "one", "point": [0.1, 0.0], "direction_deg": 40.0,
                                  "angle_deg": 10.0}}}  # fmt: skip
        clearance = loose_guide(3e-4, 0.05, 0.02, friction=RUBBING, offset=1e-4, tilt_rate=0.5)
    own = {"x": 0.15, "vx": 0.25} if joint == "guide" else {"angle_deg": 70.0, "omega": -20.0}
    scene = linkage(
        {"one": one, "two": two},
        gravity=0.0,
        initial={"one": {"x": 0.0, "y": 0.0, "angle_deg": 25.0} | rates, "two": own},
        guess={"two": {"x": 0.15, "y": 0.08}},
        clearance={"J": clearance},
        duration=0.4,
        groups=EVERY,
        **joints,
    )
    result = success(scene)
    columns = result.columns
    assert len(result.events["start"]) >= 3
    assert columns["energy_friction"][-1] > 1e-5
    px, py, turning = 0.0, 0.0, 0.0
    for name, mass, inertia in (("one", 0.7, 2e-3), ("two", 0.4, 1e-3)):
        x, y, vx, vy, w = (columns[f"{name}.{word}"] for word in ("x", "y", "vx", "vy", "omega"))
        px, py = px + mass * vx, py + mass * vy
        turning = turning + inertia * w + mass * (x * vy - y * vx)
    for momentum in (px, py, turning):
        np.testing.assert_allclose(momentum, momentum[0], atol=1e-8, rtol=0)


def test_a_singular_position_ends_a_run_with_contacts():
    """The double four-bar of the IFToMM, and a loose pendulum beside it."""
    upright = {"angle_deg": 90.0}
    joined = pins(*DOUBLE_FOUR_BAR, ((3.0, 0.0), "bob.start"))
    scene = linkage(
        {name: rod() for name in ("left", "top1", "middle", "top2", "right", "bob")},
        pin=joined,
        initial={"left": {"angle_deg": 90.0, "omega": -1.0}, "bob": {"angle_deg": 10.0, "omega": 0.0}},
        guess={"middle": upright, "right": upright},
        clearance={"P7": loose_pin(1e-3)},
        duration=1.0,
    )
    result = simulate(scene)
    assert result.status == "singular"
    assert result.remedy.startswith("singular position at t = 0.714")
    assert len(result.events["start"]) > 3


def test_channels_come_in_the_order_of_the_clearances():
    clearance = {"G": loose_guide(1e-3, 0.1, 0.05), "B": loose_pin(1e-4)}
    scene = slider_crank(clearance=clearance, duration=1e-3, groups=["contacts", "energy"])
    names = [*simulate(scene).columns][1:]
    bodies = [f"{body}.{word}" for body in scene["body"] for word in ("x", "y", "angle", "vx", "vy", "omega")]
    corners = [
        f"G.{corner}_{word}" for corner in ("ll", "lr", "ul", "ur") for word in ("gap", "normal", "friction")
    ]
    energies = ["kinetic", "gravity", "drive", "spring", "damping", "contact", "friction", "residual"]
    pin = [f"B.{word}" for word in ("x", "y", "normal", "friction")]
    assert names == [*bodies, *corners, *pin, *(f"energy_{name}" for name in energies)]
    assert simulate.plan(scene)["contacts"] == ["G.ll", "G.lr", "G.ul", "G.ur", "B"]
    deep = {"B": loose_pin(1e-4, offset=[8e-5, 8e-5])}, {"G": loose_guide(1e-3, 0.1, 0.05, tilt_deg=1.5)}
    for clearance in deep:
        with pytest.raises(ValueError, match=r"^clearance.[BG]: it is closed by .* m at the start$"):
            simulate.check(scene | {"clearance": clearance})
    with pytest.raises(ValueError, match=r"^clearance.B.contact.law = 'foundation' is not simulated"):
        simulate.check(scene | {"clearance": {"B": loose_pin(1e-4, {"law": "foundation"})}})
