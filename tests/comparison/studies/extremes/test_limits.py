"""Limits with a known answer: orders on the reference alone."""

from __future__ import annotations

import math
from functools import partial

import pandas as pd
import pytest

from comparison.execution.run import Outcome, run_one
from comparison.models import MODELS
from comparison.studies.extremes.impact import restitution
from comparison.studies.extremes.limits import clearance, lossless, speed, stiffness
from comparison.studies.extremes.limits.convergence import Limit, jobs, orders, runs, values
from comparison.studies.extremes.limits.section import draw
from comparison.studies.shared.rates import rate


def test_restitution_of_the_law() -> None:
    assert restitution(0.9) == pytest.approx(0.9131766778, abs=1e-10)
    assert restitution(1.0) == 1.0


def test_rate_leaves_out_what_has_no_logarithm() -> None:
    assert rate([1.0, 2.0, 4.0, 8.0], [3.0, 12.0, 48.0, math.nan]) == pytest.approx(2.0)
    assert math.isnan(rate([1.0, 2.0], [1.0, 0.0]))


def by_the_reference(limit: Limit) -> pd.DataFrame:
    """Run those of the reference; Exudyn's, which take longer, are said to have crashed."""
    run = partial(run_one, model="reference")
    return runs(
        limit,
        [
            Outcome("success", table=run(job.scene)) if job.model == "reference" else Outcome("crashed")
            for job in jobs(limit)
        ],
    )


def of_reference(limit: Limit, found: pd.DataFrame, **combination: object) -> pd.Series:
    """Return the observed orders of the reference in a combination."""
    observed = orders(limit, found)
    for name, value in {"model": "reference", **combination}.items():
        observed = observed[observed[name] == value]
    (row,) = (observed.loc[index] for index in observed.index)
    return row


def shown(limit: Limit, found: pd.DataFrame, folder) -> str:
    """Return what stands on the page, after its figure was drawn."""
    draw([(limit, found)], folder)
    assert (folder / f"limit_{limit.name}.svg").is_file()
    return str(values(limit, found)[f"{limit.name}_runs"])


def test_clearance_to_zero(tmp_path) -> None:
    found = by_the_reference(clearance.LIMIT)
    wide = of_reference(clearance.LIMIT, found, where=clearance.WIDE)
    # The depth is a tenth of the smallest clearance of these: it takes some hundredths from the order.
    assert wide["x"] == pytest.approx(1.0, abs=0.05)
    assert wide["y"] == pytest.approx(1.0, abs=0.05)
    assert wide["vx"] == pytest.approx(0.5, abs=0.1)
    assert of_reference(clearance.LIMIT, found, where=clearance.TIGHT)["x"] < 0.3
    ran = found[found["model"] == "reference"]
    assert (ran["y"] <= 0.2095 * 1.001 * ran["x"]).all()
    assert "exudyn: crashed" in shown(clearance.LIMIT, found, tmp_path)


def test_stiffness_to_infinity(tmp_path) -> None:
    found = by_the_reference(stiffness.LIMIT)
    for corners in stiffness.TILTS:
        observed = of_reference(stiffness.LIMIT, found, corners=corners)
        assert observed["depth"] == pytest.approx(-0.4, abs=0.005)
        assert observed["duration"] == pytest.approx(-0.4, abs=0.005)
        assert observed["error"] == pytest.approx(-0.4, abs=0.01)
        assert observed["x in flight 1"] == pytest.approx(-0.4, abs=0.02)
    stiffest = found[(found["model"] == "reference") & (found["modulus"] == 1e15)]
    assert len(stiffest) == 2
    assert stiffest["restitution"].to_numpy() == pytest.approx(stiffness.law(), abs=1e-3)
    assert stiffest["depth"].to_numpy() == pytest.approx(stiffest["point mass"].to_numpy(), rel=3e-4)
    assert "exudyn: crashed" in shown(stiffness.LIMIT, found, tmp_path)


def test_nothing_is_lost_that_cannot_be(tmp_path) -> None:
    found = by_the_reference(lossless.LIMIT)
    ran = found[found["model"] == "reference"]
    damped, rough = ran["case"] == lossless.NO_FRICTION, ran["case"] == lossless.NO_DAMPING
    assert (ran.loc[~damped, "damping"] == 0.0).all()
    assert (ran.loc[~rough, "friction"] == 0.0).all()
    assert (ran.loc[damped, "damping"] > 0.0).all()
    assert (ran.loc[rough, "friction"] > 0.0).all()
    assert 0.5 < of_reference(lossless.LIMIT, found)["residual"] < 1.1
    assert "exudyn: crashed" in shown(lossless.LIMIT, found, tmp_path)


def test_speed_to_zero(tmp_path) -> None:
    found = by_the_reference(speed.LIMIT)
    smooth = of_reference(speed.LIMIT, found, friction=0.0)
    for name in ("wall force", "torque", "kinetic energy"):
        assert smooth[name] == pytest.approx(2.0, abs=0.02)
    # At 60 rpm the force differs from the static one by half of it: the depth, its power 2/3, is not linear.
    assert smooth["depth"] == pytest.approx(2.0, abs=0.05)
    rough = found[(found["friction"] > 0) & (found["model"] == "reference")]["torque"].to_numpy()
    assert rough[-1] == pytest.approx(rough[-2], rel=0.05)  # what does not vanish
    assert "exudyn: crashed" in shown(speed.LIMIT, found, tmp_path)


def test_both_models_are_in_every_limit() -> None:
    for limit in (clearance.LIMIT, stiffness.LIMIT, lossless.LIMIT, speed.LIMIT):
        assert {case["model"] for case in limit.cases} == set(MODELS)
