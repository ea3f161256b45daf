"""A difference is confirmed, left unconfirmed, or taken back as an underestimated uncertainty."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
import pytest

from comparison.accuracy.tiers import tight
from comparison.accuracy.uncertainty import Runs, movable, twin_shift
from comparison.agreement.compare import compare
from comparison.agreement.confirmation import confirm
from comparison.agreement.confirmation_starts import (
    MEMBERS,
    OTHER_MEMBERS,
    arrived,
    moved_starts,
    starting_error,
)
from comparison.report.text import EXIT_CODES, as_mapping, scene_lines
from comparison.scene import Scene, digest, load_scene
from comparison.tables.table import Table

MODELS = ("reference", "exudyn")
LOCAL = 1e-6  # of the amplitude: error of a level, from which u follows
COARSE: dict[str, object] = {"output.samples_per_cycle": 100, "output.groups": []}
LATE = 0.6  # of the run: where magnified errors begin


def contact_at(start: float, corner: str = "ul") -> dict[str, object]:
    """One row of an event table."""
    numbers = {"end": start + 1e-3, "normal_speed": 0.1, "impulse": 0.02, "peak_force": 40.0}
    return {"corner": corner, "start": start, **numbers, "largest_depth": 1e-6}


@dataclass
class Fake:
    """Two models whose error after some time is a draw of each start: the truth times 1 + error."""

    signals: Callable[..., dict[str, np.ndarray]]
    scene: Scene
    draw: Callable[[np.random.Generator], float]
    """Relative error, late in the run, of one whose start was moved."""
    bias: tuple[float, float] = (0.0, 0.0)
    """Of either model, late in the run, whatever the start."""
    succeed: int | None = None
    """How many runs of an ensemble do; None: all."""
    late: float = LATE
    """Share of the run from which errors are magnified."""
    extra: Callable[[float], bool] = lambda _: False
    """Whether a run with such an error has one contact more."""
    asked: list[tuple[str, int]] = field(default_factory=list)

    def table(self, late: float, everywhere: float = 0.0) -> Table:
        samples = (
            round(self.scene.data["drive"]["cycles"] * self.scene.data["output"]["samples_per_cycle"]) + 1
        )
        error = everywhere + np.where(np.arange(samples) >= self.late * samples, late, 0.0)
        rows = [contact_at(0.01), *([contact_at(0.3)] if self.extra(late) else [])]
        return Table(pd.DataFrame(self.signals(self.scene.data, 0.0, error)), pd.DataFrame(rows))

    def family(self, side: int, late: float = 0.0) -> Runs:
        """Return runs that lie together, by chance or because this is all there is."""
        late += self.bias[side]
        return Runs(
            self.table(late),
            finer=self.table(late, LOCAL / 10),
            coarser=self.table(late, 10 * LOCAL / 10),
            twin=self.table(late, LOCAL + 1e-9),
            other_twin=self.table(late, LOCAL - 1e-9),
            refinement=(10.0, 1.0),
        )

    def run(self, starts: Sequence[Scene], model: str) -> list[Table]:
        self.asked.append((model, len(starts)))
        bias = self.bias[MODELS.index(model)]
        seeds = [int(digest([start.hash, model])[:8], 16) for start in starts]
        tables = [self.table(bias + self.draw(np.random.default_rng(seed))) for seed in seeds]
        return tables[: self.succeed]

    def confirmed(self, a: float = 0.0, b: float = 0.0, tier: str = "standard"):
        runs = self.family(0, a), self.family(1, b)
        before = compare(*runs, scene=self.scene, labels=MODELS, tier=tier)
        return before, confirm(before, runs, scene=self.scene, models=MODELS, run=self.run)


@pytest.fixture
def small() -> Scene:
    """Two cycles with few samples, Exudyn's tree: both models have an ensemble."""
    tree = tight(load_scene("150rpm-0.2mm", COARSE), MODELS)
    assert tree is not None
    return tree


@pytest.fixture
def fake(fake_model, small) -> Callable[..., Fake]:
    def make(draw: Callable[[np.random.Generator], float], of: Scene = small, **options) -> Fake:
        return Fake(fake_model.signals, of, draw, **options)

    return make


def narrow(rng: np.random.Generator) -> float:
    """Errors of the size that the family shows."""
    return float(LOCAL / 10 * rng.standard_normal())


def wide(rng: np.random.Generator) -> float:
    """Errors over four decades: five of them may well lie together."""
    return float(rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(-8.0, -4.0))


def test_where_models_agree_nothing_is_run(fake):
    model = fake(wide)
    before, after = model.confirmed()
    assert before.verdict == "agree"
    assert after is before
    assert model.asked == []
    assert after.confirmation is None


@pytest.mark.parametrize("size", [3.0, 300.0])
def test_a_true_difference_is_confirmed_even_a_tiny_one(fake, size):
    u = 1.25 * 10 / 9 * LOCAL / 10 * np.sqrt(2.0)  # of three levels in order, of both models
    model = fake(narrow, bias=(0.0, size * u))
    before, after = model.confirmed()
    assert before.verdict == "differ"
    assert model.asked == [("reference", MEMBERS["reference"]), ("exudyn", OTHER_MEMBERS)]
    found = after.confirmation
    assert (after.verdict, found.outcome, found.farther) == ("differ", "confirmed", (0, 0))
    assert found.members == (99, 30)
    # By construction the farthest of 99 normal draws is some 3 standard deviations out, i.e. about 2 u.
    assert found.excess > 1.0
    assert found.since == pytest.approx(LATE * 0.8, abs=0.01)
    assert found.sentence.startswith("difference confirmed from 0.48")
    assert "by 99 reference and 30 exudyn runs" in found.sentence


def test_an_underestimated_uncertainty_is_taken_back_and_called_so(fake):
    before, after = fake(wide).confirmed(b=3e-6)
    assert before.verdict == "differ"
    found = after.confirmation
    assert (after.verdict, found.outcome) == ("agree", "underestimated")
    assert EXIT_CODES[after.verdict] == 0
    assert min(found.farther) > 0
    # The farthest of 99 draws over four decades is close to their end, 1e-4; u is some 2e-7.
    assert 1e-4 / 2.5e-7 / 2 < found.factor < 2 * 1e-4 / 1.5e-7
    assert found.since == pytest.approx(LATE * 0.8, abs=0.01)
    assert "no difference of models, the uncertainty had been underestimated by a factor" in found.sentence
    # The corrected uncertainty is in the channels, and holds only where it was wrong.
    x, old = after.channels["slider_x"], before.channels["slider_x"]
    late = x.time > LATE * 0.8 + 0.02
    assert np.all(x.u[late] > 10 * old.u[late])
    early = x.time < LATE * 0.8 - 0.02
    np.testing.assert_array_equal(x.u[early], old.u[early])


def test_what_the_ensemble_makes_unpredictable_is_lost_and_below_the_floor_nobody_can_tell(fake):
    def draw(rng: np.random.Generator) -> float:
        return float(rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(-6.0, -1.0))

    # Predictable at the standard tier is u <= 0.01 of scale, over at least half of the samples; errors of
    # 0.1 come late enough to leave that, or too early.
    for late, verdict in ((0.6, "agree"), (0.3, "indeterminate")):
        before, after = fake(draw, late=late).confirmed(b=1e-4)
        assert before.verdict == "differ"
        assert (after.verdict, after.confirmation.outcome) == (verdict, "underestimated")
        x = after.channels["slider_x"]
        # But where the sine passes zero, for there the error of this fake does, too.
        assert x.predictable[x.time > late * 0.8 + 0.02].mean() < 0.15
        assert x.predictable[x.time < late * 0.8 - 0.02].all()
    assert EXIT_CODES[after.verdict] == 3


def test_an_ensemble_in_clusters_names_the_contact_that_decides(fake):
    def either(rng: np.random.Generator) -> float:
        return float(rng.choice([0.0, 2e-5]) + LOCAL / 10 * rng.standard_normal())

    _, after = fake(either, extra=lambda late: late > 1e-5).confirmed(b=2e-5)
    found = after.confirmation
    assert (after.verdict, found.outcome) == ("agree", "underestimated")
    assert found.clustered
    assert found.suspicious
    assert found.contact.startswith("the contact of the upper left corner at 0.3 s, had by ")
    assert found.contact in found.sentence
    assert "something discontinuous decides" in found.sentence


def test_an_intermittent_fault_of_the_judged_run_is_marked_although_its_ensemble_explains_it(fake):
    """All runs but the judged one have a contact: its neighbours show that it should, too."""
    model = fake(narrow, bias=(1e-4, 1e-4), extra=lambda late: late > 5e-5)
    before, after = model.confirmed(a=-1e-4)
    assert before.verdict == "differ"
    found = after.confirmation
    assert found.outcome == "underestimated"
    assert found.suspicious
    assert "the contact of the upper left corner at 0.3 s, had by 99 of 100 reference runs" in found.sentence


@pytest.mark.parametrize("count", [0, 12, 18])
def test_too_few_members_leave_the_difference_unconfirmed(fake, count):
    model = fake(narrow, bias=(0.0, 1e-3), succeed=count)
    _, after = model.confirmed()
    found = after.confirmation
    assert (after.verdict, found.outcome, found.members) == ("differ", "unconfirmed", (count, count))
    assert found.sentence.startswith(f"differ (unconfirmed, {count} runs) from 0.48")
    assert EXIT_CODES[after.verdict] == 1


def test_one_large_ensemble_suffices_to_take_back_but_not_to_confirm(fake):
    class Failing(Fake):
        def run(self, starts, model):
            return super().run(starts, model)[: None if model == "reference" else 5]

    same = fake(wide)
    failing = Failing(same.signals, same.scene, wide)
    assert failing.confirmed(b=3e-6)[1].confirmation.outcome == "underestimated"
    apart = Failing(same.signals, same.scene, narrow, bias=(0.0, 1e-3))
    assert apart.confirmed()[1].confirmation.outcome == "unconfirmed"


def test_five_bodies_are_ranked_in_an_ensemble_of_the_other_model(fake):
    scene = load_scene("150rpm-0.2mm", COARSE)
    model = fake(narrow, of=scene, bias=(0.0, 1e-3))
    _, after = model.confirmed()
    assert model.asked == [("reference", 99)]
    assert (after.confirmation.outcome, after.confirmation.members) == ("confirmed", (99, 0))
    assert "the exudyn run is outside those of reference" in after.confirmation.sentence
    _, taken_back = fake(wide, of=scene).confirmed(b=3e-6)
    assert (taken_back.verdict, taken_back.confirmation.outcome) == ("agree", "underestimated")


def test_without_a_start_to_move_or_with_a_tolerance_nothing_is_run(fake, make_table, scene):
    model = fake(narrow)
    a, b = Runs(make_table()), Runs(make_table(stretch=1e-2))
    judged = compare(a, b, scene=scene, tolerance=1e-4, labels=MODELS)
    assert judged.verdict == "differ"
    after = confirm(judged, (a, b), scene=scene, models=MODELS, run=model.run)
    assert after.verdict == "differ"
    assert after.confirmation.sentence.endswith("a tolerance judges, of which an ensemble says nothing")
    still = load_scene("ideal", COARSE)
    rigid = fake(narrow, of=still, bias=(0.0, 1e-3))
    _, after = rigid.confirmed()
    assert after.verdict == "differ"
    assert "nothing has clearance" in after.confirmation.sentence
    assert model.asked == rigid.asked == []


def test_runs_on_other_times_are_no_members(fake):
    class Elsewhere(Fake):
        def run(self, starts, model):
            return [Table(table.frame.iloc[::2]) for table in super().run(starts, model)]

    usual = fake(narrow)
    _, after = Elsewhere(usual.signals, usual.scene, narrow, bias=(0.0, 1e-3)).confirmed()
    assert after.confirmation.members == (0, 0)


def test_models_that_are_one_are_hardly_ever_told_apart(fake, small):
    """Bases and members drawn alike: whatever is confirmed is a false alarm, once in 100 by the ranks."""
    outcomes = []
    for seed in range(25):
        rng = np.random.default_rng(seed)
        moved = small.with_values({"initial.slider_offset": 1e-5 * (1 + seed / 100)})
        before, after = fake(wide, of=moved).confirmed(a=wide(rng), b=wide(rng))
        if before.verdict == "differ":
            outcomes.append(after.confirmation.outcome)
    assert len(outcomes) >= 15
    assert outcomes.count("confirmed") <= 1
    assert set(outcomes) <= {"confirmed", "underestimated"}


def test_starts_are_moved_by_what_the_error_is_worth_and_always_alike(make_table, small, scene):
    def moving(error: float, response: float) -> Runs:
        """A run with an error, whose twins have moved by so many times what their starts had."""
        apart = response * twin_shift(scene) / scene.data["clearance"]["slider"]
        return Runs(
            make_table(),
            finer=make_table(stretch=error),
            twin=make_table(stretch=apart),
            other_twin=make_table(stretch=-apart),
        )

    c = scene.data["clearance"]["slider"]
    samples = make_table().time.size
    # x moves by c times the error at a sine's peak, as its twins do by their response: the ratio is constant.
    for error, response in ((1e-5, 10.0), (1e-5, 1000.0)):
        worth = starting_error(moving(error, response), scene, samples)
        # The angle's amplitude is that of x over half the length, so times the length it is twice that; its
        # response is as much larger, so that both say the same.
        assert worth.shift == pytest.approx(error * c / response, rel=1e-3)
        assert worth.share[-1] == pytest.approx(1.0, rel=1e-3)
    assert starting_error(moving(1e-12, 1000.0), scene, samples).shift == twin_shift(scene)
    assert starting_error(moving(1e-5, 10.0), scene, 0).shift == twin_shift(scene)
    starts = moved_starts(small, "reference", 1e-9)
    assert [s.hash for s in starts] == [s.hash for s in moved_starts(small, "reference", 1e-9)]
    offsets = np.array([s.data["initial"]["slider_offset"] for s in starts])
    angles = np.array([s.data["initial"]["slider_angle"] for s in starts])
    length = small.data["mechanism"]["slider"]["length"]
    for moved in (offsets - small.data["initial"]["slider_offset"], angles * length):
        assert moved.std() == pytest.approx(1e-9, rel=0.3)
    assert abs(np.corrcoef(offsets, angles)[0, 1]) < 0.3
    others = moved_starts(small, "exudyn", 1e-9)
    assert len({s.hash for s in (*starts, *others)}) == len(starts) + len(others) == 129
    pin = load_scene("crank-pin")
    assert movable(pin) == "crank_pin"
    assert len({s.data["mechanism"]["crank_angle_deg"] for s in moved_starts(pin, "exudyn", 1e-9)}) == 30


def test_members_deviate_by_no_more_than_the_error_that_has_arisen(make_table, scene):
    """A model that is exact until the middle of the run: until there its ensemble is as narrow as can be."""
    time = make_table().time
    late = time >= time[-1] / 2.0

    def late_table(stretch: float) -> Table:
        usual, other = make_table(), make_table(stretch=stretch)
        return replace(usual, frame=pd.concat([usual.frame[~late], other.frame[late]]))

    apart = 10.0 * twin_shift(scene) / scene.data["clearance"]["slider"]
    runs = Runs(
        make_table(), late_table(1e-5), twin=make_table(stretch=apart), other_twin=make_table(stretch=-apart)
    )
    error = starting_error(runs, scene, time.size)
    np.testing.assert_array_equal(error.until[~late], twin_shift(scene))
    assert np.all(np.diff(error.until) >= 0.0)
    assert error.share[-1] == 1.0
    far = make_table(stretch=1e-3)
    (member,) = arrived([far], runs.base, error.share)
    x, base, full = (table.values("slider_x") for table in (member, runs.base, far))
    np.testing.assert_allclose(x - base, (full - base) * error.share, atol=1e-15)
    np.testing.assert_array_equal(member.time, time)
    assert member.channels == runs.base.channels


def test_the_sentence_stands_on_the_console_and_in_the_json(fake):
    _, taken_back = fake(wide).confirmed(b=3e-6)
    found = taken_back.confirmation
    lines = scene_lines([taken_back])
    assert lines[0].split()[2] == "agree"
    assert lines[1].split(maxsplit=1) == ["confirmation", found.sentence]
    record = as_mapping(taken_back)["confirmation"]
    assert record["outcome"] == "underestimated"
    assert record["members"] == (99, 30)
    assert record["factor"] == found.factor
    assert record["sentence"] == found.sentence
    assert as_mapping(fake(wide).confirmed()[1])["confirmation"] is None
