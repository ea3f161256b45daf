"""No corner and no journal is inside its wall outside a contact: whole runs of both trees, looked at closely.

What is looked at are the accepted steps, at 64 points of each, with gaps from the linkage in closed form and
angles from polynomials of numpy: nothing of what locates the touches takes part.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exudyn_model import simulate
from exudyn_model.tree.recording import TreeRecorder

POINTS = 64
CORNERS = {"ll": (-1, -1), "lr": (1, -1), "ul": (-1, 1), "ur": (1, 1)}
# Far below any depth that matters, and above the round-off of lengths near 0.6 m and of interpolated angles
BOUND = 1e-11  # m


@pytest.fixture(scope="module")
def looked_at(make_scene, linkage_points):
    """Function from a scene's changes to its result and how deep (m) each contact ever was while open."""

    def look(changes):
        scene = make_scene({"solver.exudyn.formulation": "tree", "solver.exudyn.method": "dopri5"} | changes)
        steps, judge = [], TreeRecorder.judge

        def judge_and_keep(self, time, q, v, last):
            fraction = judge(self, time, q, v, last)
            if fraction >= 1.0:  # the recorder has swapped start and end
                steps.append((self._end[0].copy(), self._start[0].copy()))
            return fraction

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(TreeRecorder, "judge", judge_and_keep)
            result = simulate(scene)
        depths = {}
        for first in range(0, len(steps), 4000):
            for name, times, gaps in gaps_of(scene, linkage_points, steps[first : first + 4000]):
                names = [name]
                if scene["contact"]["law"] == "foundation" and name != "pin":  # a side has one contact
                    names = [end + name[1] for end in "lu"]
                chosen = np.isin(result.events["corner"], names)
                starts = np.append(-np.inf, result.events["start"][chosen])
                ends = np.append(-np.inf, result.events["end"][chosen])
                open_now = times > ends[np.searchsorted(starts, times, side="right") - 1]
                depths[name] = max(depths.get(name, 0.0), -np.min(gaps, where=open_now, initial=np.inf))
        return result, depths

    return look


def gaps_of(scene, linkage_points, steps):
    """Name, times and gaps of each contact in these steps, shapes (steps, POINTS + 1)."""
    start, end = (np.array(ends)[:, None] for ends in zip(*steps, strict=True))
    fraction = np.arange(POINTS + 1) / POINTS
    length = end["time"] - start["time"]
    times = start["time"] + fraction * length

    def angle(body):
        ends = [(side[f"theta{body}"], side[f"w{body}"], side[f"a{body}"]) for side in (start, end)]
        return hermite(*ends, length, fraction)

    mechanism, clearance = scene["mechanism"], scene["clearance"]
    crank = np.radians(mechanism["crank_angle_deg"]) + scene["drive"]["speed_rpm"] * np.pi / 30 * times
    if scene["joints"]["crank_pin"] == "clearance":
        h, rocker = complex(*mechanism["rocker_pivot"]), np.exp(1j * angle(3))
        journal = mechanism["crank"]["length"] * np.exp(1j * crank)
        bearing = h + mechanism["rocker"]["centroid"] * rocker
        bearing -= mechanism["rod2"]["length"] * np.exp(1j * angle(2))
        yield "pin", times, clearance["crank_pin"] - abs(journal - bearing)
        tip = h + mechanism["rocker"]["length"] * rocker
    else:
        tip = linkage_points(scene, crank)[2]
    if scene["joints"]["slider"] == "clearance":
        x = tip.real + mechanism["rod4"]["length"] * np.cos(angle(4)) - mechanism["guide_x"]
        slider, rotated = mechanism["slider"], angle(5)
        for name, (side, end_of_side) in CORNERS.items():
            across = side * slider["width"] / 2 * np.cos(rotated)
            across -= end_of_side * slider["length"] / 2 * np.sin(rotated)
            yield name, times, slider["width"] / 2 + clearance["slider"] - side * (x + across)


def hermite(start, end, length, fraction):
    """Quintic polynomials by value, rate and second derivative at both ends."""
    (x0, v0, a0), (x1, v1, a1) = start, end
    c1, c2 = length * v0, length**2 * a0 / 2
    rise, rate, bend = x1 - x0 - c1 - c2, length * v1 - c1 - 2 * c2, length**2 * a1 - 2 * c2
    c3, c4 = 10 * rise - 4 * rate + bend / 2, -15 * rise + 7 * rate - bend
    c5 = 6 * rise - 3 * rate + bend / 2
    return x0 + fraction * (c1 + fraction * (c2 + fraction * (c3 + fraction * (c4 + fraction * c5))))


GRAZING = {
    # Two contacts at 0.2454 s within 4 ms of free flight
    "drive.speed_rpm": 300.0,
    "drive.cycles": 1.3,
    "initial.slider_offset": 4.624471986426843e-05,
}
SHORT_DIPS = {
    # Two corners dip into the wall within one step of free flight
    "mechanism.crank_angle_deg": 104.14681944133153,
    "drive.speed_rpm": -628.6765405987518,
    "drive.cycles": 0.25,
    "initial.slider_offset": 0.00011453617504758328,
    "clearance.slider": 0.0001692085669172635,
    "contact.youngs_modulus": 19812365031.446693,
    "contact.restitution": 0.0,
    "contact.poisson": 0.45334348236576694,
    "contact.corner_radius": 0.002298941728046554,
    "friction.coefficient": 0.1,
    "environment.gravity": 0.0,
}


@pytest.mark.parametrize(
    ("changes", "tolerance", "step"),
    [(GRAZING, 1e-8, 1e-2), (SHORT_DIPS, 1e-8, 1e-2), (SHORT_DIPS, 1e-11, 1e-4)],
    ids=["grazing", "short dips", "short dips at the usual step"],
)
def test_no_contact_is_missed_at_any_length_of_steps(looked_at, changes, tolerance, step):
    settings = {"solver.exudyn.tolerance": tolerance, "solver.exudyn.step": step}
    result, depths = looked_at(changes | settings)
    assert result.status == "success"
    assert len(depths) == 4
    assert max(depths.values()) < BOUND


@settings(max_examples=12, deadline=None)
@given(
    speed=st.floats(1.0, 3.0),
    backwards=st.booleans(),
    crank=st.floats(0.0, 360.0),
    offset=st.floats(-0.95, 0.95),
    clearances=st.tuples(st.floats(-4.3, -3.3), st.floats(-4.3, -3.3)),
    joints=st.sampled_from([("clearance", "ideal"), ("ideal", "clearance"), ("clearance", "clearance")]),
    law=st.sampled_from(["hertz-corners", "strip", "foundation"]),
    impact_speed=st.sampled_from(["frozen", "current"]),
    modulus=st.floats(7.0, 10.0),
    restitution=st.floats(0.0, 1.0),
    friction=st.floats(0.0, 0.5),
    tolerance=st.floats(-10.0, -6.0),
    step=st.sampled_from([1e-4, 1e-3, 1e-2]),
)
def test_no_contact_is_missed_from_random_starts(
    looked_at,
    speed,
    backwards,
    crank,
    offset,
    clearances,
    joints,
    law,
    impact_speed,
    modulus,
    restitution,
    friction,
    tolerance,
    step,
):
    slider, pin = (10.0**clearance for clearance in clearances)
    rpm = 10.0**speed
    changes = {
        "drive.speed_rpm": -rpm if backwards else rpm,
        "drive.cycles": min(1.0, 0.1 * rpm / 60),
        "mechanism.crank_angle_deg": crank,
        "initial.slider_offset": offset * slider,
        "clearance.slider": slider,
        "clearance.crank_pin": pin,
        "joints.slider": joints[0],
        "joints.crank_pin": joints[1],
        "contact.law": law,
        "contact.impact_speed": impact_speed,
        "contact.youngs_modulus": 10.0**modulus,
        "contact.restitution": restitution,
        "friction.coefficient": friction,
        "output.groups": [],
        "output.samples_per_cycle": 100,
        "solver.exudyn.tolerance": 10.0**tolerance,
        "solver.exudyn.step": step,
    }
    result, depths = looked_at(changes)
    # A stiff guide may chatter without end
    assert result.status in ("success", "work-limit", "step-too-small")
    assert max(depths.values()) < BOUND
