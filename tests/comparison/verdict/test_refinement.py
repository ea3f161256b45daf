"""A verdict of five bodies other than "agree" is judged with ever finer runs, until it stands."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from fake_ensemble import COARSE, MODELS, Fake, narrow
from fake_model import signals

from comparison.accuracy.uncertainty import Runs
from comparison.execution.run import VIOLATED, Outcome
from comparison.scene import load_scene
from comparison.tables.table import Table
from comparison.verdict.channel import Criteria
from comparison.verdict.compare import compare
from comparison.verdict.refinement import ENOUGH_LEVELS, MOST_LEVELS, settle, without_violation
from comparison.verdict.results import Doubt
from comparison.words.verdicts import finer_runs, scene_reason

STEP = 2e-6  # s, of the shipped scenes
FAULT = 3e-6  # of the second model's amplitude: outside the uncertainty of its runs, some 3e-7 of it


class Levels:
    """Families of two models, the second of which errs as a function of its step."""

    def __init__(self, fake, error, tree=0.0):
        self.fake, self.error, self.tree = fake, error, tree
        self.settings = []  # step of five bodies and the reference's tolerance
        self.trees = 0  # number of runs for the third opinion

    def families(self, scene):
        solver = scene.data["solver"]
        if solver["exudyn"]["formulation"] == "tree":
            self.trees += 1
            return self.fake.family(0), self.fake.family(1, self.tree)
        step = solver["exudyn"]["step"]
        self.settings.append((step, solver["reference"]["tolerance"]))
        return self.fake.family(0), self.fake.family(1, self.error(step))

    def run(self, starts, model):
        return replace(self.fake, bias=(0.0, self.tree)).run(starts, model)

    def settle(self, families=None):
        scene, families = self.fake.scene, families or self.families
        runs = families(scene)
        before = compare(*runs, scene=scene, labels=MODELS)
        return settle(before, runs, scene=scene, models=MODELS, run=self.run, run_families=families)


def levels(error, tree=0.0, step=STEP):
    scene = load_scene("150rpm-0.2mm", COARSE | {"solver.exudyn.step": step})
    return Levels(Fake(signals, scene, narrow), error, tree)


ERRORS = {1: 1.3e-5, 2: 7.5e-6, 4: 7.7e-6, 8: 1.2e-7, 16: 3.0e-8}
"""Ten times the errors at 0.4 mm of clearance, where two steps show one wrong sequence of contacts."""
OSCILLATION = {1: FAULT, 2: -FAULT, 4: 2 * FAULT, 8: -2 * FAULT, 16: FAULT}


@pytest.mark.parametrize(
    ("errors", "tree", "verdict", "count", "trees"),
    [
        (dict.fromkeys(ERRORS, FAULT), FAULT, "differ", ENOUGH_LEVELS, 1),  # outlasts two refinements
        # Two steps that err alike prove nothing
        (ERRORS, 0.0, "agree", 3, 0),
        # Runs that converge to nothing are indeterminate, unless the tree, which does converge, is apart too
        (OSCILLATION, 0.0, "indeterminate", MOST_LEVELS, 1),
        (OSCILLATION, FAULT, "differ", MOST_LEVELS, 1),
        # Against the tree five bodies must stay apart at all levels; where they do not, the tree was right
        (dict.fromkeys(ERRORS, FAULT), 0.0, "differ", MOST_LEVELS, 1),
        (dict.fromkeys(ERRORS, FAULT) | {16: 0.0}, 0.0, "agree", MOST_LEVELS, 1),
    ],
)
def test_a_verdict_is_refined_until_it_stands(errors, tree, verdict, count, trees):
    model = levels(lambda step: errors[round(STEP / step)], tree)
    outcome = model.settle()
    result = outcome.comparison
    assert (result.verdict, result.refined, model.trees) == (verdict, count, trees)
    steps, tolerances = zip(*model.settings, strict=True)
    assert steps == pytest.approx([STEP / 2**n for n in range(count + 1)])
    # The reference is refined to its strict tolerance.
    assert tolerances == pytest.approx([1e-10, 1e-11, 1e-12, 1e-12, 1e-12][: count + 1], rel=1e-9)
    np.testing.assert_array_equal(result.channels["slider_x"].b, outcome.runs[1].base.values("slider_x"))
    assert f"halved {('', 'once', 'twice', 'three times', 'four times')[count]}, to" in finer_runs(result)
    assert ("have not converged" in scene_reason(result)) == (verdict == "indeterminate")
    if verdict == "differ":
        assert (result.confirmation.outcome, result.confirmation.members) == ("confirmed", (99, 0))


def test_what_is_indeterminate_is_refined_as_far_as_that_can_help():
    model = levels(lambda _: 0.0)

    def families(scene):
        """Runs as far apart as their scale."""
        first, second = model.families(scene)
        return first, replace(second, finer=model.fake.table(0.0, 1.0))

    result = model.settle(families).comparison
    assert (result.verdict, result.refined) == ("indeterminate", ENOUGH_LEVELS)


@pytest.mark.parametrize("step", [8e-7, 1e-7])
def test_a_small_step_is_not_refined_to_the_end(step):
    model = levels(lambda finer: FAULT * (-1.0) ** round(np.log2(step / finer)), step=step)
    result = model.settle().comparison
    assert (result.verdict, result.refined) == ("indeterminate", ENOUGH_LEVELS)


@pytest.mark.parametrize(
    ("tree", "verdict"), [(FAULT, "differ"), (0.0, "indeterminate"), (None, "indeterminate")]
)
def test_where_a_finer_run_fails_the_tree_decides(tree, verdict):
    """An ensemble does not show an error of the step; None: the tree fails as well."""
    model = levels(lambda _: FAULT, tree or 0.0)

    def families(scene):
        is_tree = scene.data["solver"]["exudyn"]["formulation"] == "tree"
        failed = tree is None if is_tree else bool(model.settings)
        return None if failed else model.families(scene)

    result = model.settle(families).comparison
    assert (result.verdict, result.refined) == (verdict, 0)
    assert (result.confirmation is not None) == (verdict == "differ")
    assert ("a finer run failed" in scene_reason(result)) == (verdict == "indeterminate")


@pytest.mark.parametrize(("fault", "verdict"), [(FAULT, "differ"), (0.0, "agree")])
def test_against_a_model_without_settings_five_bodies_alone_are_refined(fault, verdict):
    """Its runs have no uncertainty: the scene's tolerance decides."""
    model = levels(lambda step: fault + 10 * FAULT * (step == STEP))
    scene, models = model.fake.scene.with_values({"compare.tolerance": 1e-6}), ("mine", "exudyn")

    def families(scene):
        mine, exudyn = model.families(scene)
        return Runs(mine.base), exudyn

    runs, criteria = families(scene), Criteria(tolerance=1e-6)
    before = compare(*runs, scene=scene, labels=models, criteria=criteria)
    assert before.verdict == "differ"
    options = {"scene": scene, "models": models, "run": model.run, "run_families": families}
    result = settle(before, runs, **options).comparison
    assert result.verdict == verdict
    assert (result.confirmation and result.confirmation.doubt) == (Doubt.TOLERANCE if fault else None)
    assert [step for step, _ in model.settings] == [STEP, STEP / 2, STEP / 4, STEP / 8][: 4 if fault else 2]


def test_a_difference_by_a_time_shift_alone_outlasts_refinement():
    model, models, time = levels(lambda _: 0.0), ("mine", "exudyn"), np.arange(201) * 4e-3
    scene = model.fake.scene.with_values({"compare.tolerance": 0.01})

    def wave(shift, amplitude=1e-3, w=2 * np.pi / 0.4):
        phase = w * (time - shift)
        columns = {"slider_y": amplitude * np.cos(phase), "slider_vy": -amplitude * w * np.sin(phase)}
        return Runs(Table(pd.DataFrame({"time": time} | columns)))

    runs, criteria = (wave(0.0), wave(2e-5)), Criteria(tolerance=0.01, channels=["slider_y"])
    before = compare(*runs, scene=scene, labels=models, criteria=criteria)
    assert (before.verdict, before.channels["slider_y"].verdict) == ("differ", "agree")
    options = {"scene": scene, "models": models, "run": model.run, "run_families": lambda _: runs}
    result = settle(before, runs, **options).comparison
    assert (result.verdict, result.refined) == ("differ", ENOUGH_LEVELS)


def test_a_violation_at_the_scenes_own_step_is_remedied_by_half_of_it():
    model, failure = levels(lambda _: 0.0), ("exudyn", Outcome(VIOLATED, "lower the step"))
    scene, _, (warning,) = without_violation(model.fake.scene, [failure], MODELS, model.families)
    assert (scene.data["solver"]["exudyn"]["step"], model.settings[0][0]) == (STEP / 2, STEP / 2)
    assert warning.endswith("at which five bodies fail: lower the step")
    for other in (("reference", failure[1]), ("exudyn", Outcome("crashed"))):
        assert without_violation(model.fake.scene, [failure, other], MODELS, model.families) is None


@pytest.mark.parametrize(
    ("error", "verdict", "count"),
    [
        (lambda _: FAULT, "differ", 3),
        (lambda tolerance: FAULT * (tolerance > 2e-12), "agree", 3),
        (lambda tolerance: FAULT * (tolerance > 2e-11), "agree", 2),
    ],
)
def test_a_difference_of_two_models_with_tolerances_must_be_there_at_finer_ones(error, verdict, count):
    tree = {"solver.exudyn.formulation": "tree", "solver.exudyn.tolerance": 1e-10}
    model, tolerances = Levels(Fake(signals, load_scene("150rpm-0.2mm", COARSE | tree), narrow), None), []

    def families(scene):
        tolerances.append(scene.data["solver"]["exudyn"]["tolerance"])
        return model.fake.family(0), model.fake.family(1, error(tolerances[-1]))

    model.tree = FAULT  # in ensembles, which run at the scene's own tolerance
    result = model.settle(families).comparison
    assert (result.verdict, result.halved) == (verdict, False)
    assert result.refined == (0 if verdict == "differ" else count - 1)
    assert tolerances == pytest.approx([1e-10, 1e-11, 1e-12][:count])
    assert ("judged at settings refined" in finer_runs(result)) == (verdict == "agree")
