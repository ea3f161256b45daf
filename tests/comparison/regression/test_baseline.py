"""The baseline's text, and the checkpoints that stand in it."""

from __future__ import annotations

import string
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from comparison.accuracy.thresholds import thresholds
from comparison.engines.platform import _processor, platform_name, versions
from comparison.execution.job import Job
from comparison.regression.baseline import (
    Baseline,
    Checkpoint,
    Detection,
    RunRecord,
    SceneRecord,
    read,
    write,
)
from comparison.regression.checkpoints import COUNT, record
from comparison.verdict.compare import Runs, model_uncertainty

numbers = st.floats(allow_nan=False, allow_infinity=False)
positive = st.floats(min_value=0, exclude_min=True, allow_infinity=False)
texts = st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=20)
keys = st.text(string.ascii_letters + string.digits + "._-+", min_size=1, max_size=12)
counts = st.integers(0, 10**12)
runs = st.builds(
    RunRecord,
    settings=st.dictionaries(keys, st.one_of(texts, st.booleans(), counts, numbers), max_size=3),
    counters=st.dictionaries(keys, counts, max_size=3),
    spread=st.dictionaries(keys, counts, max_size=2),
    unexcited=st.lists(keys, max_size=2),
    unpredictable=st.lists(keys, max_size=2),
    channels=st.dictionaries(
        st.sampled_from(["slider_x", "slider_y"]),
        st.lists(st.builds(Checkpoint, numbers, numbers, positive), max_size=2),
    ),
)
tiers = st.dictionaries(st.sampled_from(["standard", "tight"]), runs)
scenes = st.builds(SceneRecord, source=texts, hash=keys, reference=tiers, exudyn=tiers)
baselines = st.builds(
    Baseline,
    platform=texts,
    versions=st.dictionaries(keys, texts, max_size=2),
    thresholds=st.dictionaries(
        keys, st.one_of(numbers, st.dictionaries(keys, numbers, max_size=1)), max_size=2
    ),
    detection=st.one_of(
        st.none(),
        st.just(
            Detection(
                false_alarms={"count": 0, "runs": 300, "upper95": 0.00994},
                detected={"tight": {"count": 24, "faults": 25, "interval": [0.82, 1.0]}},
            )
        ),
    ),
    scenes=st.dictionaries(keys, scenes, min_size=1, max_size=2),
)


@settings(max_examples=50)
@given(baseline=baselines)
def test_what_is_written_is_what_is_read_to_the_last_bit(baseline, tmp_path_factory):
    path = write(baseline, tmp_path_factory.getbasetemp() / "baseline.toml")
    assert read(path) == baseline


def test_a_checkpoint_takes_its_line_and_the_file_is_whole_or_not_there(tmp_path):
    run = RunRecord(
        settings={},
        counters={"steps": 5},
        channels={"slider_x": [Checkpoint(0.1, -0.55, 1e-11)] * 2},
    )
    scene = SceneRecord(source="own.toml", hash="ab", exudyn={"tight": run})
    whole = Baseline(platform="p", versions={}, thresholds={}, scenes={"90rpm-0.1mm": scene})
    lines = write(whole, tmp_path / "deep" / "b.toml").read_text().splitlines()
    assert lines.count("  [0.1, -0.55, 1e-11],") == 2
    assert '[scenes."90rpm-0.1mm".exudyn.tight.channels]' in lines
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["b.toml"]


@pytest.fixture
def family(make_table):
    """Runs whose error grows and vanishes again in each cycle; at most twice ``error`` of the amplitude."""

    def make(error: float, **changes) -> Runs:
        return Runs(
            base=make_table(error, **changes),
            finer=make_table(error / 4, **changes),
            coarser=make_table(4 * error, **changes),
        )

    return make


def test_checkpoints_are_predictable_samples_with_k_u_as_threshold(family, scene):
    runs = family(1e-4)
    made = record(runs, Job(scene, "exudyn"), "standard")
    limits = thresholds()
    assert set(made.channels) | set(made.unexcited) | set(made.unpredictable) == set(runs.base.channels)
    for name in ("slider_x", "slider_omega", "corner_ll_normal"):
        u, values = model_uncertainty(runs, name, scene.period), runs.base.values(name)
        points = made.channels[name]
        at = [int(np.abs(runs.base.time - point.time).argmin()) for point in points]
        assert len(set(at)) == len(points) <= COUNT
        for i, point in zip(at, points, strict=True):
            assert point.time == pytest.approx(runs.base.time[i], rel=1e-8)  # nine digits
            # Two digits, rounded up.
            assert limits.k * u[i] * (1 - 1e-12) <= point.threshold <= 1.1 * limits.k * u[i]
            assert abs(point.value - values[i]) <= 0.005 * point.threshold * (1 + 1e-6)
            assert abs(point.value) > 0.99 * point.threshold
    # Spread over the run: one in each half at least.
    times = [point.time for point in made.channels["slider_x"]]
    assert min(times) < scene.duration / 2 < max(times)


def test_where_nothing_is_predictable_or_nothing_happens_there_is_no_checkpoint(family, scene):
    zero = np.zeros(401)
    still = family(1e-4, slider_omega=zero, corner_ur_normal=zero)
    made = record(still, Job(scene, "exudyn"), "standard")
    assert made.unexcited == ["slider_omega", "corner_ur_normal"]
    # At the tight tier u may be 5e-5 of the clearance; here it is 1e-3 of it and more.
    wild = record(family(1.0, slider_ax=np.sin(np.arange(401.0))), Job(scene, "exudyn"), "tight")
    assert "slider_x" in wild.unpredictable
    # What follows from a position is not predictable where that is not, though it be the same in all runs.
    assert "slider_ax" in wild.unpredictable
    assert not {"slider_x", "slider_ax"} & set(wild.channels)


def test_counters_settings_and_contacts_are_those_of_the_run(family, scene):
    runs = family(1e-4)
    base = replace(runs.base, provenance={"counters": {"steps": 7}, "formulation": "tree"})
    made = record(replace(runs, base=base), Job(scene, "exudyn"), "standard")
    assert made.counters == {"steps": 7, "contacts": 0}
    assert made.spread == {}
    assert made.settings == {**scene.data["solver"]["exudyn"], "formulation": "tree"}


def test_neighbouring_starts_raise_the_thresholds_and_give_the_spread_of_the_counters(
    family, scene, make_table
):
    runs = family(1e-4)
    base = replace(runs.base, provenance={"counters": {"steps": 7, "rhs": 70}})
    neighbours = [
        replace(make_table(1e-4, stretch=stretch), provenance={"counters": {"steps": steps, "rhs": 70}})
        for stretch, steps in ((1e-3, 9), (-2e-3, 4))
    ]
    finer = replace(runs.finer, events=pd.DataFrame({"corner": ["ll", "lr"]}))
    runs = replace(runs, base=base, finer=finer)
    alone = record(runs, Job(scene, "exudyn"), "standard")
    assert alone.spread == {"contacts": 2}
    made = record(runs, Job(scene, "exudyn"), "standard", neighbours)
    assert made.spread == {"steps": 3, "contacts": 2}
    # Five bodies have no neighbours: of ten contacts two are uncertain, and so is a fifth of the steps.
    ten = pd.DataFrame({"corner": ["ll"] * 10})
    twelve = replace(finer, events=pd.DataFrame({"corner": ["ll"] * 12}))
    runs = family(1e-4)
    family_of_ten = {
        name: replace(getattr(runs, name), events=ten)
        for name in ("coarser", "perturbed", "other_perturbed")
        if getattr(runs, name) is not None
    }
    uncertain = replace(runs, base=replace(base, events=ten), finer=twelve, **family_of_ten)
    assert record(uncertain, Job(scene, "exudyn"), "standard").spread == {
        "steps": 2,
        "rhs": 14,
        "contacts": 2,
    }
    # k times three times the distance of the neighbour that is further off, the largest within the window.
    x = {point.time: point for point in made.channels["slider_x"]}
    sine = np.abs(np.sin(2 * np.pi * np.array(list(x)) / scene.period))
    thresholds_of_x = np.array([point.threshold for point in x.values()])
    assert np.all(thresholds_of_x >= 2 * 3 * 2e-3 * scene.data["clearance"]["slider"] * sine)
    assert np.median(thresholds_of_x) > 5 * np.median([p.threshold for p in alone.channels["slider_x"]])


def test_the_processor_is_named_with_what_it_can_do(tmp_path):
    path = tmp_path / "cpuinfo"
    path.write_text(
        "processor : 0\nmodel : 1\nmodel name : Some CPU\ncpu family : 25\nflags : fpu avx2 fma\n\n"
        "processor : 1\nmodel : 2\nmodel name : Another\n"
    )
    assert _processor(path) == "Some CPU 25/1 avx2 fma"
    assert isinstance(_processor(Path("nowhere")), str)
    assert platform_name().split(", ")[0]
    assert set(versions()) == {"python", "numpy", "scipy", "numba", "exudyn"}


@pytest.mark.parametrize(
    ("variable", "value", "words"),
    [
        ("OPENBLAS_CORETYPE", "Haswell", "OpenBLAS for Haswell"),
        ("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-FMA", "glibc with glibc.cpu.hwcaps=-FMA"),
        ("NUMBA_CPU_NAME", "nehalem", "numba for nehalem"),
        ("NUMBA_CPU_FEATURES", "-fma", "numba with -fma"),
    ],
)
def test_code_chosen_by_the_environment_is_another_machine(monkeypatch, variable, value, words):
    """It rounds differently on the same processor."""
    monkeypatch.delenv(variable, raising=False)
    alone = platform_name.__wrapped__()
    monkeypatch.setenv(variable, value)
    assert set(platform_name.__wrapped__().split(", ")) == {*alone.split(", "), words}
