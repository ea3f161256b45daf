"""A difference that five bodies' own error explains is asked again of finer runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fake_ensemble import COARSE, LOCAL, MODELS, Fake, wide

from comparison.agreement.compare import compare
from comparison.agreement.confirmation import confirm
from comparison.agreement.confirmation_refined import confirm_refined, refined
from comparison.scene import Scene, load_scene

FAULT = 3e-6
"""Of the second model, late in the run: outside u of the family, within the errors that `wide` draws."""


@pytest.fixture
def five_bodies() -> Scene:
    return load_scene("150rpm-0.2mm", COARSE)


class Converging(Fake):
    """Errors over decades at the scene's settings; at finer ones those that the family shows."""

    def run(self, starts, model):
        finer = starts[0].data["solver"]["exudyn"]["step"] < self.scene.data["solver"]["exudyn"]["step"]
        narrow = replace(self, draw=lambda rng: float(LOCAL / 10 * rng.standard_normal()))
        return Fake.run(narrow if finer else self, starts, model)


def judged(model: Fake, families):
    """Judge the runs of a model whose second side errs by `FAULT`; return the verdict before and after."""
    runs = model.family(0), model.family(1, FAULT)
    before = compare(*runs, scene=model.scene, labels=MODELS)
    assert before.verdict == "differ"
    return before, confirm_refined(
        before, runs, scene=model.scene, models=MODELS, run=model.run, run_families=families
    )


def converging(fake, five_bodies: Scene) -> Converging:
    return Converging(fake(wide).signals, five_bodies, wide)


def test_what_stays_with_finer_runs_is_a_difference_of_models(fake, five_bodies):
    model, asked = converging(fake, five_bodies), []

    def families(scene):
        asked.append(scene)
        return model.family(0), model.family(1, FAULT)

    before, after = judged(model, families)
    found = after.confirmation
    assert (after.verdict, found.outcome, found.refined) == ("differ", "confirmed", "differ")
    assert found.members == (99, 0)
    assert found.sentence.endswith("all these runs are two levels finer than the scene's")
    # It shows what the user ran.
    np.testing.assert_array_equal(after.channels["slider_x"].u, before.channels["slider_x"].u)
    # Both models, two levels each: a quarter of the step, a hundredth of the tolerance.
    (closer,) = asked
    for model_name, key, factor in (("exudyn", "step", 4.0), ("reference", "tolerance", 100.0)):
        own, finer = (scene.data["solver"][model_name][key] for scene in (five_bodies, closer))
        assert own / finer == pytest.approx(factor, rel=1e-12)


def test_what_goes_with_finer_runs_was_numerical(fake, five_bodies):
    model = converging(fake, five_bodies)
    _, after = judged(model, lambda _: (model.family(0), model.family(1)))
    found = after.confirmation
    assert (after.verdict, found.outcome, found.refined) == ("agree", "underestimated", "agree")
    assert found.sentence.endswith("with both models two levels finer they agree")


def test_finer_runs_whose_difference_their_ensemble_explains_decide_nothing(fake, five_bodies):
    model = Fake(fake(wide).signals, five_bodies, wide)
    _, after = judged(model, lambda _: (model.family(0), model.family(1, FAULT)))
    found = after.confirmation
    assert (after.verdict, found.outcome, found.refined) == ("agree", "underestimated", "agree")
    # Two ensembles: one at the scene's settings, one at the finer ones, which explains the difference too.
    assert model.asked == [("reference", 99)] * 2


def test_finer_runs_without_a_result_change_nothing(fake, five_bodies):
    model = converging(fake, five_bodies)
    before, after = judged(model, lambda _: None)
    runs = model.family(0), model.family(1, FAULT)
    plain = confirm(before, runs, scene=five_bodies, models=MODELS, run=model.run)
    assert after.confirmation == plain.confirmation
    assert after.confirmation.refined == ""


def test_models_with_ensembles_of_their_own_are_not_asked_again(fake):
    def families(scene):
        raise AssertionError(scene)

    _, after = judged(fake(wide), families)
    assert after.confirmation.outcome == "underestimated"


def test_five_bodies_on_both_sides_have_no_ensemble(fake, five_bodies):
    model = converging(fake, five_bodies)
    runs = model.family(0), model.family(1, FAULT)
    before = compare(*runs, scene=five_bodies, labels=MODELS)
    after = confirm(before, runs, scene=five_bodies, models=("exudyn", "exudyn"), run=model.run)
    assert (after.verdict, after.confirmation.outcome) == ("differ", "unconfirmed")
    assert model.asked == []


def test_a_model_without_settings_cannot_be_refined(five_bodies):
    assert refined(five_bodies, ("reference", "another")) is None
