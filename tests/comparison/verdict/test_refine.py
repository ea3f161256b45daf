"""A verdict of five bodies other than "agree" is judged with ever finer runs, until it stands."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from fake_ensemble import COARSE, MODELS, Fake, narrow

from comparison.scene import Scene, load_scene
from comparison.verdict.compare import compare
from comparison.verdict.refinement import ENOUGH, MOST, Settled, settle
from comparison.words.verdicts import scene_reason

STEP = 2e-6
"""s, of the shipped scenes."""
FAULT = 3e-6
"""Of the second model's amplitude: outside the uncertainty of its runs, which is some 3e-7 of it."""


@pytest.fixture
def five_bodies() -> Scene:
    return load_scene("150rpm-0.2mm", COARSE)


class Levels:
    """Families of two models, the second of which errs as a function of its step."""

    def __init__(self, fake: Fake, error: Callable[[float], float], *, tree: float = 0.0) -> None:
        self.fake, self.error, self.tree = fake, error, tree
        self.steps: list[float] = []
        """Of five bodies, in the order they were asked."""
        self.tolerances: list[float] = []
        self.trees = 0
        """How often the third opinion was asked."""

    def families(self, scene: Scene):
        solver = scene.data["solver"]
        if solver["exudyn"]["formulation"] == "tree":
            self.trees += 1
            return self.fake.family(0), self.fake.family(1, self.tree)
        self.steps.append(solver["exudyn"]["step"])
        self.tolerances.append(solver["reference"]["tolerance"])
        return self.fake.family(0), self.fake.family(1, self.error(solver["exudyn"]["step"]))

    def run(self, starts, model: str):
        return replace(self.fake, bias=(0.0, self.tree)).run(starts, model)

    def settled(self) -> Settled:
        scene = self.fake.scene
        runs = self.families(scene)
        self.steps.clear()
        before = compare(*runs, scene=scene, labels=MODELS)
        return settle(before, runs, scene=scene, models=MODELS, run=self.run, run_families=self.families)


@pytest.fixture
def levels(fake, five_bodies):
    def make(error, **more) -> Levels:
        return Levels(Fake(fake(narrow).signals, five_bodies, narrow), error, **more)

    return make


def test_what_vanishes_with_the_step_was_numerical(levels):
    model = levels(lambda step: FAULT if step > 0.9 * STEP else 0.0)
    found = model.settled()
    assert (found.comparison.verdict, found.comparison.refined) == ("agree", 1)
    assert model.steps == pytest.approx([STEP / 2])
    assert model.fake.asked == []  # no ensemble is needed to withdraw it
    # Comparison, runs and scene belong together.
    assert found.scene.data["solver"]["exudyn"]["step"] == pytest.approx(STEP / 2)
    np.testing.assert_array_equal(
        found.comparison.channels["slider_x"].b, found.runs[1].base.values("slider_x")
    )


def test_what_outlasts_two_refinements_is_a_difference_of_models(levels):
    model = levels(lambda _: FAULT, tree=FAULT)
    found = model.settled()
    assert (found.comparison.verdict, found.comparison.refined) == ("differ", ENOUGH)
    assert found.comparison.confirmation.outcome == "confirmed"
    assert found.comparison.confirmation.members == (99, 0)
    assert model.steps == pytest.approx([STEP / 2, STEP / 4])
    assert model.trees == 1


def test_two_steps_that_err_alike_prove_nothing(levels):
    """Errors as measured at 0.4 mm of clearance, where two steps show one wrong sequence of contacts."""
    measured = {1: 1.3e-6, 2: 7.5e-7, 4: 7.7e-7, 8: 1.2e-8, 16: 3.0e-9}
    model = levels(lambda step: 10.0 * measured[round(STEP / step)])
    found = model.settled()
    assert (found.comparison.verdict, found.comparison.refined) == ("agree", 3)


def test_runs_that_converge_to_nothing_are_indeterminate(levels):
    errors = {1: FAULT, 2: -FAULT, 4: 2 * FAULT, 8: -2 * FAULT, 16: FAULT}
    model = levels(lambda step: errors[round(STEP / step)], tree=0.0)
    found = model.settled()
    assert (found.comparison.verdict, found.comparison.refined) == ("indeterminate", MOST)
    assert re.search(r"converge to is unknown", scene_reason(found.comparison))
    assert "1.25e-07 s" in scene_reason(found.comparison)
    assert model.fake.asked == []
    # Where the tree, which does converge, is apart from the reference too, the models are.
    model = levels(lambda step: errors[round(STEP / step)], tree=FAULT)
    found = model.settled()
    assert (found.comparison.verdict, found.comparison.refined) == ("differ", MOST)
    assert found.comparison.confirmation.outcome == "confirmed"
    assert model.trees == 1


def test_against_the_tree_five_bodies_must_stay_apart_at_all_levels(levels):
    model = levels(lambda _: FAULT, tree=0.0)
    found = model.settled()
    assert (found.comparison.verdict, found.comparison.refined) == ("differ", MOST)
    assert found.comparison.confirmation.outcome == "confirmed"
    # And where they do not, the tree was right.
    model = levels(lambda step: FAULT if step > 0.1 * STEP else 0.0, tree=0.0)
    found = model.settled()
    assert (found.comparison.verdict, found.comparison.refined) == ("agree", MOST)
    assert model.trees == 1


@pytest.mark.parametrize(("limit", "verdict"), [(0.3, "agree"), (0.0, "indeterminate")])
def test_what_is_indeterminate_is_refined_as_far_as_that_can_help(levels, limit, verdict):
    model = levels(lambda _: 0.0)

    def families(scene: Scene):
        """Runs as far apart as their scale until the step is small enough."""
        step = scene.data["solver"]["exudyn"]["step"]
        model.steps.append(step)
        first, second = model.fake.family(0), model.fake.family(1)
        return first, replace(second, finer=model.fake.table(0.0, 1.0 if step > limit * STEP else 0.0))

    scene = model.fake.scene
    runs = families(scene)
    before = compare(*runs, scene=scene, labels=MODELS)
    assert before.verdict == "indeterminate"
    found = settle(before, runs, scene=scene, models=MODELS, run=model.fake.run, run_families=families)
    assert (found.comparison.verdict, found.comparison.refined) == (verdict, ENOUGH)
    assert model.steps == pytest.approx([STEP, STEP / 2, STEP / 4])


def test_the_reference_is_refined_to_its_strict_tolerance(levels):
    model = levels(lambda _: FAULT, tree=0.0)
    model.settled()
    assert model.tolerances == pytest.approx([1e-10, 1e-11, 1e-12, 1e-12, 1e-12], rel=1e-9)


def test_without_a_finer_run_the_ensembles_decide(levels):
    model = levels(lambda _: FAULT)
    scene = model.fake.scene
    runs = model.families(scene)
    before = compare(*runs, scene=scene, labels=MODELS)
    found = settle(before, runs, scene=scene, models=MODELS, run=model.fake.run, run_families=lambda _: None)
    assert (found.comparison.verdict, found.comparison.refined) == ("differ", 0)
    assert found.comparison.confirmation.outcome == "confirmed"


@pytest.mark.parametrize(("step", "refined"), [(2e-6, MOST), (8e-7, 2), (1e-7, 2)])
def test_a_small_step_is_not_refined_to_the_end(fake, step, refined):
    scene = load_scene("150rpm-0.2mm", COARSE | {"solver.exudyn.step": step})
    model = Levels(
        Fake(fake(narrow).signals, scene, narrow),
        lambda finer: FAULT * (-1.0) ** round(np.log2(step / finer)),
    )
    found = model.settled()
    assert (found.comparison.verdict, found.comparison.refined) == ("indeterminate", refined)


def test_models_with_ensembles_of_their_own_are_not_refined(fake):
    model = fake(narrow, bias=(0.0, FAULT))
    runs = model.family(0), model.family(1)
    before = compare(*runs, scene=model.scene, labels=MODELS)

    def families(scene):
        raise AssertionError(scene)

    found = settle(before, runs, scene=model.scene, models=MODELS, run=model.run, run_families=families)
    assert (found.comparison.verdict, found.comparison.refined) == ("differ", 0)
