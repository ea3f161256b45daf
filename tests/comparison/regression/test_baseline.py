"""The checkpoints of a baseline: predictable samples, with thresholds that neighbouring starts keep."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from comparison.accuracy.levels import thresholds
from comparison.accuracy.uncertainty import Runs, model_uncertainty
from comparison.execution.run import Job
from comparison.regression.record import COUNT, record


@pytest.fixture
def family(make_table):
    """Runs whose error grows and vanishes again in each cycle; at most twice ``error`` of the amplitude."""

    def make(error, **changes):
        return Runs(
            base=make_table(error, **changes),
            finer=make_table(error / 4, **changes),
            coarser=make_table(4 * error, **changes),
        )

    return make


def test_checkpoints_are_predictable_samples_with_k_u_as_threshold(family, scene):
    runs = family(1e-4)
    entry = record(runs, Job(scene, "exudyn"), "standard")
    limits = thresholds()
    assert set(entry.channels) | set(entry.unexcited) | set(entry.unpredictable) == set(runs.base.channels)
    for name in ("slider_x", "slider_omega", "corner_ll_normal"):
        u, values = model_uncertainty(runs, name, scene.period), runs.base.values(name)
        points = entry.channels[name]
        at = [int(np.abs(runs.base.time - point.time).argmin()) for point in points]
        assert len(set(at)) == len(points) <= COUNT
        for i, point in zip(at, points, strict=True):
            assert point.time == pytest.approx(runs.base.time[i], rel=1e-8)  # nine digits
            # Two digits, rounded up.
            assert limits.k * u[i] * (1 - 1e-12) <= point.threshold <= 1.1 * limits.k * u[i]
            assert abs(point.value - values[i]) <= 0.005 * point.threshold * (1 + 1e-6)
            assert abs(point.value) > 0.99 * point.threshold
    # Spread over the run: one in each half at least.
    times = [point.time for point in entry.channels["slider_x"]]
    assert min(times) < scene.duration / 2 < max(times)


def test_what_is_constant_has_one_checkpoint_and_what_is_not_predictable_none(family, scene):
    zero = np.zeros(401)
    runs = family(1e-4, slider_omega=zero + 5.0, corner_ur_normal=zero)
    entry = record(runs, Job(scene, "exudyn"), "standard")
    assert entry.unexcited == ["slider_omega", "corner_ur_normal"]
    assert [[point.value for point in entry.channels[name]] for name in entry.unexcited] == [[5.0], [0.0]]
    # At the tight tier u may be 5e-5 of the clearance; here it is 1e-3 of it and more. A channel that
    # follows from a position is as unpredictable as that, even if it is the same in all runs.
    noise = record(family(1.0, slider_ax=np.sin(np.arange(401.0))), Job(scene, "exudyn"), "tight")
    assert {"slider_x", "slider_ax"} <= {*noise.unpredictable} - set(noise.channels)


def test_neighbouring_starts_raise_the_thresholds_and_give_the_spread_of_the_counters(
    family, scene, make_table
):
    def run(table, steps, contacts=0):
        provenance = {"counters": {"steps": steps, "rhs": 70}, "formulation": "tree"}
        return replace(table, provenance=provenance, events=pd.DataFrame({"corner": ["ll"] * contacts}))

    runs, job = family(1e-4), Job(scene, "exudyn")
    runs = replace(runs, base=run(runs.base, 7), finer=run(runs.finer, 7, 2), coarser=run(runs.coarser, 7))
    neighbours = [run(make_table(1e-4, stretch=stretch), steps) for stretch, steps in ((1e-3, 9), (-2e-3, 4))]
    alone, entry = record(runs, job, "standard"), record(runs, job, "standard", neighbours)
    assert entry.settings == {**scene.data["solver"]["exudyn"], "formulation": "tree"}
    assert (alone.spread, entry.spread) == ({"contacts": 2}, {"steps": 3, "contacts": 2})
    # Five bodies have no neighbours: of ten contacts two are uncertain, and so is a fifth of the steps.
    bodies = replace(runs, base=run(runs.base, 7, 10), finer=run(runs.finer, 7, 12), coarser=None)
    assert record(bodies, job, "standard").spread == {"steps": 2, "rhs": 14, "contacts": 2}
    # k times three times the distance of the neighbour that is further off, the largest within the window.
    points = entry.channels["slider_x"]
    sine = np.abs(np.sin(2 * np.pi * np.array([point.time for point in points]) / scene.period))
    before, after = ([point.threshold for point in each.channels["slider_x"]] for each in (alone, entry))
    assert np.all(np.array(after) >= 2 * 3 * 2e-3 * scene.data["clearance"]["slider"] * sine)
    assert np.median(after) > 5 * np.median(before)
