"""The engine by itself, by laws of mechanics, and against the reference: both read one page of equations."""

import numpy as np
import pytest
from slider_crank import CHANGES, closed_form

pytest.importorskip("pinocchio", reason="pin has no wheel for this Python and platform, or is not installed")

from pinocchio_press.contact import CORNERS, LAWS, SIDES, Corner, Guide
from pinocchio_press.integration import StepError, integrate

import reference_model
from comparison.scene import load_scene
from comparison.tables.channels import channels, expected

pytestmark = pytest.mark.slow
ALL = {"output.groups": ["accelerations", "corners", "joints", "energy"]}
# Thrown into its guide with a spin: single hits, then both corners of a side.
THROWN = ALL | {
    "drive.cycles": 0.08,
    "output.samples_per_cycle": 20_000,
    "initial.slider_omega": 1.0,
    "initial.slider_vx": 0.02,
}
# A workpiece that the slider meets in these runs.
LOADED = {"load.surface": 0.18, "load.force": 2.0}
TABLE = {"load.surface": 0.18, "load.table": [[0.0, 0.0], [0.002, 5.0], [0.004, 1.0]]}
MOTION = ("slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")


@pytest.mark.parametrize("name", ["ideal", "150rpm-0.2mm"])
def test_rates_and_accelerations_are_derivatives(run, name):
    """Against fourth-order differences, away from contacts, whose forces are not smooth."""
    own = ALL | {"drive.cycles": 0.02, "output.samples_per_cycle": 10_000, "initial.slider_omega": 0.3}
    result = run(name, own)[1]
    columns = result.columns
    assert columns["time"][-1] < min(result.events["start"], default=1.0)
    rates = (*MOTION[3:], "slider_ax", "slider_ay", "slider_alpha")
    for of, rate in zip(MOTION, rates, strict=True):
        values = columns[of]
        slope = (values[:-4] - 8 * values[1:-3] + 8 * values[3:-1] - values[4:]) / (12 * columns["time"][1])
        # The integrator's tolerance of 1e-10 rad and 1e-8 rad/s over a time of 4e-5 s.
        atol = 1e-6 if of in MOTION[:3] else 1e-4
        np.testing.assert_allclose(slope, columns[rate][2:-2], rtol=0, atol=atol)


@pytest.mark.parametrize(
    "changes", [{}, {"contact.law": "foundation"}, {"contact.law": "adams-impact"}], ids=str
)
def test_energy_is_balanced_through_contacts(run, changes):
    _, result = run("150rpm-0.2mm", THROWN | changes)
    assert len(result.events["start"]) > 3
    assert min(result.columns[f"energy_{loss}"][-1] for loss in ("damping", "friction")) > 1e-8
    # Measured 1e-11 J; a rate 1 % wrong at one corner would leave 1 % of the losses, above 1e-8 J.
    assert np.abs(result.columns["energy_residual"]).max() < 1e-10


@pytest.mark.parametrize("load", [LOADED, TABLE], ids=["power", "table"])
def test_energy_is_balanced_with_a_workpiece(run, load):
    _, result = run("150rpm-0.2mm", THROWN | load, 1e-12)
    # Measured 2e-11 and 3e-12 J; 2e-9 and 4e-9 J at a tolerance of 1e-10.
    assert np.abs(result.columns["energy_residual"]).max() < 1e-10
    assert result.columns["energy_load"].max() > 1e-3


def test_slider_obeys_newton_with_the_force_of_its_joint(run):
    scene, result = run("150rpm-0.2mm", THROWN)
    columns, mass = result.columns, scene["mechanism"]["slider"]["mass"]
    walls = sum(
        sign * columns[f"corner_{name}_normal"] for name, sign in zip(CORNERS, (1, -1, 1, -1), strict=True)
    )
    rub = sum(columns[f"corner_{name}_friction"] for name in CORNERS)
    along_x = columns["reaction_F_x"] + walls - mass * columns["slider_ax"]
    along_y = columns["reaction_F_y"] + rub - mass * (columns["slider_ay"] + scene["environment"]["gravity"])
    # Round-off of sums of forces of some 100 N.
    assert max(np.abs(along_x).max(), np.abs(along_y).max()) < 1e-10
    assert np.abs(walls).max() > 1.0


def test_contacts_begin_and_end_where_the_gap_is_zero(run):
    _, result = run("150rpm-0.2mm", THROWN)
    columns, events = result.columns, result.events
    assert min(events["normal_speed"].min(), events["impulse"].min()) > 0.0
    for name in CORNERS:
        gap, inside = columns[f"corner_{name}_gap"], np.zeros(len(columns["time"]), bool)
        for row in np.flatnonzero(events["corner"] == name):
            inside |= (columns["time"] > events["start"][row]) & (columns["time"] < events["end"][row])
        np.testing.assert_array_equal(gap < 0.0, inside)
        assert (columns[f"corner_{name}_normal"][~inside] == 0.0).all()


@pytest.mark.parametrize("law", LAWS)
def test_elastic_forces_are_the_slope_of_the_stored_energy(law):
    guide, h = Guide(load_scene("150rpm-0.2mm", {"contact.law": law}).data), 1e-10
    left = [c for c, its in enumerate(guide.contacts) if set(its) <= set(SIDES[0])]

    def corners(lower, upper):
        return [Corner(0j, gap, 0.0, 0.0) for gap in (-lower, 1.0, -upper, 1.0)]

    for lower, upper in ((2e-6, 2e-6), (3e-6, 1e-6), (1e-6, 3e-6), (2e-6, -5e-6), (-5e-6, 2e-6)):
        inside = [lower > 0.0, False, upper > 0.0, False]
        points = [guide.point(c, corners(lower, upper), inside) for c in left]
        forces = [share * point.elastic for point in points for share in point.shares]
        moves = (((lower + h, upper), (lower - h, upper)), ((lower, upper + h), (lower, upper - h)))
        ends = [[guide.stored(corners(*depths), inside) for depths in pair] for pair in moves]
        # The second-order difference of steps 1e-4 of the depth, and round-off 1e-16 / 1e-4: below 1e-7.
        assert [(after - before) / (2 * h) for after, before in ends] == pytest.approx(forces, rel=1e-7)


def test_each_partner_has_its_own_material():
    scene = load_scene("150rpm-0.2mm", {"contact.youngs_modulus.slider": 69e9, "contact.poisson.guide": 0.3})
    guide = Guide(scene.data)
    sigma = (1 - 0.28**2) / 69e9 + (1 - 0.3**2) / 210e9
    stiffness = 4 / (3 * sigma) * np.sqrt(1e-3), 0.12 / (0.475 * sigma)
    assert (guide.K, guide.K_surface) == pytest.approx(stiffness, rel=1e-14)
    both = load_scene("150rpm-0.2mm").data
    each = both["contact"] | {"youngs_modulus": {"slider": 210e9, "guide": 210e9}}
    assert Guide(both | {"contact": each}).K == Guide(both).K


@pytest.mark.parametrize("speed", [150.0, -300.0])
def test_slider_crank_follows_its_closed_form(run, speed):
    scene, result = run("ideal", CHANGES | {"drive.speed_rpm": speed, "output.samples_per_cycle": 100})
    bounds = {"slider_y": 1e-14, "slider_vy": 1e-13, "slider_ay": 1e-11, "crank_torque": 1e-12}  # round-off
    for name, exact in closed_form(scene, result.columns["time"]).items():
        assert np.abs(result.columns[name] - exact).max() < bounds[name], name


class Dip:
    """y = t, and a surface that is passed twice within a thousandth of a step."""

    def __init__(self):
        self.side, self.passed = 1.0, []

    def rates(self, _t, _y):
        return np.ones(1)

    def surfaces(self, _t, y):
        return {("dip", 0): (self.side * ((y[0] - 0.53) ** 2 - 1e-8), self.side * 2.0 * (y[0] - 0.53))}

    def switch(self, _surface, t, _y):
        self.side *= -1.0
        self.passed.append(t)


def test_a_dip_between_two_checks_is_found():
    system = Dip()
    pieces = list(integrate(system, np.zeros(1), 1.0, np.full(1, 1e-10), 1.0))
    # The square root of the rounding 1e-16 of the surface, over its slope of 2e-4.
    np.testing.assert_allclose(system.passed, [0.5299, 0.5301], rtol=0, atol=1e-11)
    assert [piece.switched for piece in pieces if piece.switched] == [("dip", 0)] * 2
    assert [piece.end for piece in pieces[:-1]] == [piece.start for piece in pieces[1:]]


def test_a_step_below_rounding_is_an_error(monkeypatch):
    """y = 1 / (1 - t)."""
    monkeypatch.setattr(Dip, "rates", lambda _self, _t, y: y**2)
    monkeypatch.setattr(Dip, "surfaces", lambda *_: {})
    with pytest.raises(StepError, match=r"at (0\.99|1 s)"):
        list(integrate(Dip(), np.ones(1), 2.0, np.full(1, 1e-10), 1.0))


def of_the_reference(name, changes):
    result = reference_model.simulate(load_scene(name, changes | {"solver.reference.tolerance": 1e-12}).data)
    assert result.status == "success", result.remedy
    return result


def test_ideal_press_is_that_of_the_reference(run):
    changes = ALL | {"drive.cycles": 1.0}
    scene, result = run("ideal", changes)
    reference = of_the_reference("ideal", changes).columns
    assert set(result.columns) == {"time", *expected(scene)} == set(reference)
    # Measured: 4e-16 m, 4e-15 m/s, 7e-14 N, 7e-15 N m, 5e-15 J: all of it round-off.
    bounds = {"m": 1e-12, "rad": 1e-12, "m/s": 1e-12, "rad/s": 1e-12, "m/s^2": 1e-11, "rad/s^2": 1e-11}
    bounds |= {"N": 1e-11, "N m": 1e-10, "J": 1e-12}
    for name, channel in channels().items():
        if name in reference:
            assert np.abs(result.columns[name] - reference[name]).max() < bounds[channel.unit], name


# Bounds of instants (s): measured 1e-8 s, 9e-11 m at a touch with 1e-2 m/s; of the others 6e-8 and 3e-7 s, at
# a touch with 1e-4 m/s.
@pytest.mark.parametrize(
    ("name", "changes", "instants"),
    [
        ("150rpm-0.2mm", {"drive.cycles": 1.0}, 1e-7),
        ("300rpm-0.2mm", {"drive.cycles": 1.0}, 1e-7),
        ("surface", {}, 2e-6),
        ("150rpm-0.2mm", {"drive.cycles": 0.3, "contact.law": "adams-impact"}, 2e-6),
    ],
)
def test_contacts_are_those_of_the_reference(run, name, changes, instants):
    """Over the whole run, chatter included: 104 contacts magnify what the two codes round differently."""
    _, result = run(name, ALL | changes, 1e-12)
    other = of_the_reference(name, ALL | changes)
    difference = {key: np.abs(result.columns[key] - other.columns[key]) for key in result.columns}
    # Measured 1.8e-11 and 4.9e-12 m over the cycle, of the others 1.1e-10 and 1.4e-10 m.
    assert difference["slider_x"].max() < 1e-9
    if whole := changes == {"drive.cycles": 1.0}:
        # Measured 2.8e-12 m in y, 9e-11 m in a gap.
        for key in ("slider_y", *(f"corner_{corner}_gap" for corner in CORNERS)):
            assert difference[key].max() < 1e-9, key
        # Half the samples are before the chatter or between contacts: measured 1e-11 N m and 5e-10 N.
        assert np.median(difference["crank_torque"]) < 1e-10
        assert max(np.median(difference[f"reaction_{joint}_y"]) for joint in "OABHCF") < 1e-8
    # The same contacts of every corner, one by one; of all corners together two may touch at one instant.
    for corner in CORNERS:
        own, theirs = (
            {
                what: of.events[what][of.events["corner"] == corner]
                for what in ("start", "impulse", "peak_force")
            }
            for of in (result, other)
        )
        assert len(own["start"]) == len(theirs["start"])
        np.testing.assert_allclose(own["start"], theirs["start"], rtol=0, atol=instants)
        # A table of steps holds the peaks of its steps only; the impulse is an integral.
        np.testing.assert_allclose(own["impulse"], theirs["impulse"], rtol=1e-3, atol=1e-7)
        if whole:
            assert len(own["start"]) > 5
            np.testing.assert_allclose(own["peak_force"], theirs["peak_force"], rtol=0.02, atol=1e-2)
