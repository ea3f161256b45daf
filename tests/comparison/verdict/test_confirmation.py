"""A difference is confirmed, left unconfirmed, or taken back; the starts of the runs that decide it."""

import math
from functools import partial

import fake_model
import numpy as np
import pandas as pd
import pytest
from by_keywords import compare_recorded
from fake_ensemble import COARSE, LOCAL, MODELS, ONSET, Fake, narrow, wide

from comparison.accuracy.levels import tight
from comparison.accuracy.refine import levels
from comparison.accuracy.uncertainty import Runs, perturbation
from comparison.execution.sides import Run
from comparison.scene import load_scene
from comparison.tables.table import Table
from comparison.verdict.confirmation import ENOUGH_MEMBERS, moved_starts, starting_error
from comparison.verdict.linkage import linkage_pair, moved_states
from comparison.verdict.recorded import ProgramRuns

SINCE = pytest.approx(ONSET * 0.8, abs=0.01)
TIME = np.arange(401) * 2e-3


@pytest.fixture
def tree_scene():
    """Two cycles with few samples, Exudyn's tree: both models have an ensemble."""
    return tight(load_scene("150rpm-0.2mm", COARSE), MODELS)


@pytest.fixture
def fake(tree_scene):
    return partial(Fake, fake_model.signals, tree_scene)


def test_a_true_difference_is_confirmed_even_a_tiny_one(fake):
    u = 1.25 * 10 / 9 * LOCAL / 10 * np.sqrt(2.0)  # of three levels in order, of both models
    before, after = fake(narrow, bias=(0.0, 3.0 * u)).confirmed()
    confirmation = after.confirmation
    assert (before.verdict, after.verdict, confirmation.outcome) == ("differ", "differ", "confirmed")
    assert (confirmation.farther, confirmation.members, confirmation.since) == ((0, 0), (99, 30), SINCE)
    # By construction the farthest of 99 normal draws is some 3 standard deviations out, i.e. about 2 u.
    assert confirmation.excess > 1.0


def test_an_underestimated_uncertainty_is_taken_back_and_called_so(fake):
    before, after = fake(wide).confirmed(b=3e-6)
    confirmation = after.confirmation
    assert (before.verdict, after.verdict, confirmation.outcome) == ("differ", "agree", "underestimated")
    assert (min(confirmation.farther) > 0, confirmation.since) == (True, SINCE)
    # The farthest of 99 draws over four decades is close to their end, 1e-4; u is some 2e-7.
    assert 1e-4 / 2.5e-7 / 2 < confirmation.factor < 2 * 1e-4 / 1.5e-7
    # The corrected uncertainty is in the channels, and holds only where it was wrong.
    x, old = after.channels["slider_x"], before.channels["slider_x"]
    late, early = x.time > ONSET * 0.8 + 0.02, x.time < ONSET * 0.8 - 0.02
    assert np.all(x.u[late] > 10 * old.u[late])
    np.testing.assert_array_equal(x.u[early], old.u[early])


def test_too_few_members_leave_the_difference_unconfirmed_and_one_large_ensemble_takes_it_back(fake):
    _, after = fake(narrow, bias=(0.0, 1e-3), succeed=18).confirmed()
    confirmation = after.confirmation
    assert (after.verdict, confirmation.outcome, confirmation.members) == ("differ", "unconfirmed", (18, 18))

    class Failing(Fake):
        def run(self, starts, model):
            tables = super().run(starts, model)
            # A third model may choose its times: such runs are no members.
            return tables if model == "reference" else [*tables[:5], Table(tables[5].frame.iloc[::2])]

    twin = fake(wide)
    retraction = Failing(twin.signals, twin.scene, wide).confirmed(b=3e-6)[1].confirmation
    assert (retraction.outcome, retraction.members) == ("underestimated", (99, 5))


@pytest.mark.parametrize("response", [10.0, 1000.0])
def test_starts_are_moved_by_what_the_error_is_worth(make_table, scene, response):
    clearance, samples = scene.data["clearance"]["slider"], make_table().time.size

    def start_error(error, before=samples):
        """The error of a start; the perturbed runs have moved by `response` times as much as their starts."""
        distance = response * perturbation(scene) / clearance
        base, finer, one, other = (make_table(stretch=size) for size in (0.0, error, distance, -distance))
        return starting_error(Runs(base, finer, one, other_perturbed=other), scene, before)

    # x moves by the clearance times the error at a sine's peak, as its perturbed runs do by their response: a
    # constant ratio. The angle times the length is twice that, and its response as well.
    shift, until = start_error(1e-5)
    assert shift == pytest.approx(1e-5 * clearance / response, rel=1e-3)
    assert until[-1] == pytest.approx(shift, rel=1e-3)
    assert start_error(1e-12)[0] == start_error(1e-5, 0)[0] == perturbation(scene)


def test_starts_are_drawn_apart_in_offset_and_angle_and_always_alike(tree_scene):
    starts, others = (moved_starts(tree_scene, model, 1e-9) for model in MODELS)
    assert [s.hash for s in starts] == [s.hash for s in moved_starts(tree_scene, "reference", 1e-9)]
    assert len({s.hash for s in (*starts, *others)}) == 129
    offsets, angles = (
        np.array([s.data["initial"][key] for s in starts]) for key in ("slider_offset", "slider_angle")
    )
    length = tree_scene.data["mechanism"]["slider"]["length"]
    for displacements in (offsets - tree_scene.data["initial"]["slider_offset"], angles * length):
        assert displacements.std() == pytest.approx(1e-9, rel=0.3)
    assert abs(np.corrcoef(offsets, angles)[0, 1]) < 0.3


def runs(wave, count, error=1e-7, spread=1e-9):
    """Runs of a method of second order; perturbed ones lie around the base."""
    rng = np.random.default_rng(1)

    def table(size, offset=0.0):
        y = 0.1 * np.cos(9 * TIME) * (1 + size + wave) + offset
        return Table(pd.DataFrame({"time": TIME, "slider_y": y}))

    perturbed = [table(4 * error, spread), table(4 * error, -spread)]
    ensemble = [table(error, spread * rng.standard_normal()) for _ in range(count - 2)]
    return ProgramRuns(table(error), table(error / 4), table(4 * error), [*perturbed, *ensemble])


@pytest.mark.parametrize(
    ("members", "outcome"), [(ENOUGH_MEMBERS - 1, "unconfirmed"), (ENOUGH_MEMBERS, "confirmed")]
)
def test_further_runs_from_files_are_an_ensemble(members, outcome):
    a, b = (runs(part, members + 2) for part in (0.0, 1e-3))
    result = compare_recorded(a, b, scene=None, labels=("a", "b"))
    assert (result.verdict, result.confirmation.outcome) == ("differ", outcome)
    assert result.confirmation.members == (members, members)


def test_starts_are_moved_in_what_they_give_and_within_the_clearances():
    scene = load_scene("slider-crank", {"clearance.O.size": 1e-4, "clearance.G.size": 2e-4})
    assert moved_states(scene) == ["crank.angle", "crank.omega", "G.offset", "G.tilt", "O.x", "O.y"]
    pair = linkage_pair(scene.with_values({"clearance.O.offset": [1e-4, 0]}), ("reference", "exudyn"), list)
    data = pair.job(Run(pair.sides[0], -1, (0.0, 0.0, 1e-9, 1e-3, 1e-12, -1e-12))).scene.data
    assert data["clearance"]["O"]["offset"] == pytest.approx([1e-4, -1e-12])
    assert math.hypot(*data["clearance"]["O"]["offset"]) <= 1e-4
    assert data["clearance"]["G"]["offset"] == 1e-9
    assert data["clearance"]["G"]["tilt_deg"] == pytest.approx(math.degrees(1e-3))
    tolerance = scene.data["solver"]["reference"]["tolerance"]
    assert data["solver"]["reference"]["tolerance"] == pytest.approx(10 * tolerance)
    scenes = levels(scene, "reference")  # of the gate
    for name, sign in (("perturbed", 1), ("other_perturbed", -1)):
        assert scenes[name].data["clearance"]["O"]["offset"] == pytest.approx([1e-13, sign * 1e-13])
        assert scenes[name].data["clearance"]["G"]["offset"] == pytest.approx(2e-13)


def test_a_start_at_rest_is_moved_in_its_rates_too():
    assert moved_states(load_scene("squeezer")) == ["K1.angle", "K1.omega"]
    assert moved_states(load_scene("squeezer", {"initial.K1.vx": 1.0})) == ["K1.angle", "K1.vx"]
    assert moved_states(load_scene("four-bar")) == []  # the drive leaves no freedom
