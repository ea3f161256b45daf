"""What is compared, with a fault and without; where drawing stops; what the study writes of it."""

import os
import platform
import re
import sys
from collections import Counter
from dataclasses import replace
from importlib.util import find_spec
from math import radians
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import beta

from comparison.models import MODELS, EngineError, engine_names, find, platform_name
from comparison.regression import record as update
from comparison.scene import load_scene
from comparison.studies.detection.faults import (
    RECORDS,
    SPOILS,
    CatalogueError,
    catalogue,
    installed,
    scenes,
)
from comparison.studies.detection.faults import changed as faulty_text
from comparison.studies.detection.pairs import (
    BOTH,
    HASHED,
    MOST_DRAWS,
    MOST_KEYS,
    OWN,
    ROUNDINGS,
    bits,
    both_pair,
    changed,
    controls,
    effective,
    find_all,
    hashes,
    keys,
    moved,
    own_pair,
    sample,
    scenes_with_clearance,
    trials,
)
from comparison.studies.detection.study import STUDY, Results, count
from comparison.studies.shared.scenes import at_tier, leaves
from comparison.studies.shared.study import interval, upper_limit
from comparison.tables.channels import expected

FAULTS = catalogue()
CODE = [fault for fault in FAULTS if fault.kind == "code"]
AGREE = {"verdict": "agree", "reason": "", "channels": {"slider_x": ["agree", 0.5]}, "first": None}
DIFFER = AGREE | {"verdict": "differ", "channels": {"slider_x": ["differ", 1.0]}}
OPEN = AGREE | {"verdict": "indeterminate"}
CORRECTED = AGREE | {"confirmation": {"outcome": "underestimated", "sentence": "too small"}}


# ---- the catalogue


@pytest.mark.parametrize("fault", [*CODE, *catalogue(["rearranged"])], ids=lambda fault: fault.engine)
def test_other_code_replaces_exactly_one_place_of_the_present_sources(fault):
    text = faulty_text(fault)
    assert fault.new in text
    compile(text, fault.file, "exec")
    for old, times in (("a = b", "0"), ("=", r"\d\d+")):
        refusal = rf"{fault.engine}: '{old}' is {times} times in {fault.file} of the"
        with pytest.raises(CatalogueError, match=refusal):
            faulty_text(replace(fault, old=old))


def test_a_copy_is_a_model_of_its_own_and_vanishes():
    folders, fault = list(sys.path), next(fault for fault in CODE if "/" in fault.file)
    with installed([fault]):
        copy = Path(find_spec(fault.engine).origin).parent
        assert find(fault.engine).value == f"{fault.engine}:simulate"
        assert fault.new in (copy / fault.file).read_text()
        assert fault.engine in engine_names()
    assert sys.path == folders
    with pytest.raises(EngineError):
        find(fault.engine)


@pytest.mark.parametrize("tier", ["standard", "tight"])
def test_every_wrong_number_changes_the_scene_and_nothing_else_does(tier):
    for fault in FAULTS:
        scene = scenes(tier)[fault.scene]
        assert (fault.given(scene).hash != scene.hash) == (fault.kind == "number")
        assert set(fault.shows) <= set(expected(scene.data))


def test_every_fault_is_tried_at_the_tiers_that_run_it_against_the_other_model():
    assert len({(fault.name, fault.model) for fault in FAULTS}) == len(FAULTS) >= 20
    assert min(Counter(fault.model for fault in CODE)[model] for model in MODELS) >= 4
    assert {fault.spoil for fault in FAULTS if fault.kind == "table"} == SPOILS.keys()
    tried = trials(FAULTS)
    assert {(trial.fault, trial.tier) for trial in tried} == {
        (fault, tier) for fault in FAULTS for tier in ("standard", "tight") if fault.tier in ("", tier)
    }
    numbers = Counter((t.model, t.tier) for t in tried if t.fault.kind == "number")
    assert numbers.keys() == {("reference", "tight"), ("exudyn", "tight"), ("reference", "standard")}
    assert set(numbers.values()) == {sum(fault.kind == "number" for fault in FAULTS)}
    for trial in tried:
        pair = trial.pair
        assert {side.model for side in pair.sides} == set(MODELS)
        assert pair.scene == scenes(trial.tier)[trial.fault.scene]
        assert pair.sides[1].engine == trial.fault.engine
    assert {pair.scene.hash for pair in controls()} == {trial.pair.scene.hash for trial in tried}


# ---- without a fault


def different(before, after):
    return {key for key in after if after[key] != before[key] and not key.startswith("scene.")}


@pytest.mark.parametrize("kind", BOTH, ids=lambda kind: kind.label)
def test_a_draw_is_a_shipped_scene_with_its_own_cycles_and_its_start_moved(kind):
    names = scenes_with_clearance()
    assert "ideal" not in names
    assert {"crank-pin", "both-clearances", "wedge", "90rpm-0.5mm"} <= set(names)
    drawn = [both_pair(kind, ROUNDINGS[2], number) for number in range(len(names))]
    # The scenes follow one another in a circle, which each variant enters at another place.
    assert [pair.scene.source for pair in drawn] == [*names[2:], *names[:2]]
    for pair in drawn:
        shipped = at_tier(load_scene(pair.scene.source), kind.tier)
        keys_moved = different(leaves(shipped.data), leaves(pair.scene.data))
        start = {"initial.slider_offset", "initial.slider_angle"}
        if shipped.data["joints"]["slider"] == "ideal":
            start = {"mechanism.crank_angle_deg"}
        assert start <= keys_moved
        assert len(keys_moved - start) <= (MOST_KEYS if kind.changed else 0)
        assert [side.model for side in pair.sides] == list(MODELS)
        assert {side.scene.hash for side in pair.sides} == {pair.scene.hash}
        assert pair.environment == ROUNDINGS[2].environment != ()


def test_one_to_three_keys_that_the_scene_uses_are_changed_and_each_at_some_time():
    scene, rng = load_scene("both-clearances"), np.random.default_rng(2)
    before = leaves(scene.data)
    drawn = [different(before, leaves(changed(scene, rng).data)) for _ in range(400)]
    assert {len(one) for one in drawn} == {1, 2, 3}
    assert set().union(*drawn) == keys(scene).keys()


@pytest.mark.parametrize("name", ["150rpm-0.2mm", "both-clearances", "crank-pin"])
def test_starts_fill_the_disc_of_two_percent_of_the_clearance(name):
    scene, rng = load_scene(name), np.random.default_rng(1)
    start, mechanism = scene.data["initial"], scene.data["mechanism"]
    distances = []
    for _ in range(200):
        data = moved(scene, 0.02, rng).data
        if name == "crank-pin":
            turned = radians(data["mechanism"]["crank_angle_deg"] - mechanism["crank_angle_deg"])
            way = [turned * mechanism["crank"]["length"] / data["clearance"]["crank_pin"], 0.0]
        else:
            offset, angle = (data["initial"][key] - start[key] for key in ("slider_offset", "slider_angle"))
            way = np.array([offset, angle * mechanism["slider"]["length"]]) / data["clearance"]["slider"]
        distances.append(np.hypot(*way))
    # An angle of 111 deg has a last digit of 1.4e-14 deg: 1e-17 m at the crank, 1e-11 of 2 % of 0.1 mm.
    assert 0.018 < max(distances) <= 0.02 * (1 + 1e-9)
    # Uniform on the disc: half of the starts are within 0.71 of its radius; on the line, half of it.
    assert np.median(distances) / 0.02 == pytest.approx(0.5 if name == "crank-pin" else 0.707, abs=0.1)


@pytest.mark.parametrize("kind", OWN, ids=lambda kind: kind.label)
def test_draws_of_one_model_start_between_the_walls_and_differ_by_numerics_alone(kind):
    for draw in range(5):
        pair = own_pair(kind, np.random.default_rng([7, draw]))
        assert pair.identity == own_pair(kind, np.random.default_rng([7, draw])).identity
        first, second = (side.scene.data for side in pair.sides)
        clearance, length = first["clearance"]["slider"], first["mechanism"]["slider"]["length"]
        start, other = (
            np.array([data["initial"]["slider_offset"], data["initial"]["slider_angle"] * length])
            for data in (first, second)
        )
        assert np.abs(start) @ [1.0, 0.5] < 0.98 * clearance
        # An offset of 5e-4 m has a last digit of 1e-19 m: 1e-6 of a billionth of 1e-4 m.
        assert 0 < np.hypot(*(other - start)) / clearance <= 1e-9 * (1 + 1e-5)
        settings = [data["solver"][kind.model][kind.setting] for data in (first, second)]
        assert 0.3 <= settings[1] / settings[0] <= 3.0
        assert {key for key in first if first[key] != second[key]} == {"initial", "solver"}


@pytest.mark.parametrize(
    ("wanted", "row", "draws", "decided"),
    [
        # Ten decided each, number 0, and number 10, which replaced it.
        (30, lambda n: OPEN if n in (0, 10) else AGREE, 12, 10),
        (30, lambda n: AGREE if n % 2 else OPEN, 13, 6),  # at most 1.25 times 10, rounded up
        (10, lambda _: DIFFER, 4, 4),  # a share that does not divide; a difference is decided as well
    ],
)
def test_drawing_stops_when_each_variant_has_its_share_of_decided_ones(wanted, row, draws, decided):
    asked = []

    def find(drawn):
        asked.extend(drawn)
        return [row(number) for _, number in drawn]

    drawn = sample(replace(BOTH[0], draws=wanted), ROUNDINGS[:3], find)
    for rounding in ROUNDINGS[:3]:
        rows = drawn[rounding]
        assert (len(rows), count(rows)["decided"]) == (draws, decided)
        assert [number for variant, number in asked if variant == rounding] == list(range(draws))
    assert draws <= np.ceil(MOST_DRAWS * np.ceil(wanted / 3))


def test_a_variant_without_a_table_of_its_own_does_not_count():
    plain = ("a",) * len(HASHED)
    # By the order of HASHED the first two are of the standard tier.
    assert [tier for _, tier in HASHED] == ["standard", "standard", "tight", "tight"]
    other = ("b", *plain[1:])
    measured = dict(
        zip(ROUNDINGS, [plain, plain, other, other, (*plain[:-1], "c"), (*other[:-1], "c")], strict=True)
    )
    counted = {tier: effective(measured, tier) for tier in ("standard", "tight")}
    assert counted == {"standard": [ROUNDINGS[0], ROUNDINGS[2]], "tight": [ROUNDINGS[0], ROUNDINGS[4]]}


@pytest.mark.slow
def test_rounding_changes_bits_of_both_models_at_both_tiers(tmp_path, monkeypatch):
    """Sums in another order on any machine, mathematical functions where the library has other code."""
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path))
    before = dict(os.environ)
    three = ROUNDINGS[0], ROUNDINGS[2], next(variant for variant in ROUNDINGS if variant.rearranged)
    assert (three[1].environment[0][0], three[2].environment) == ("GLIBC_TUNABLES", ())
    with installed(catalogue(["rearranged"])):
        plain, libm, other = hashes(three, find_all(bits(three), 2)).values()
    assert dict(os.environ) == before
    assert all(len(one) == 64 and one != another for one, another in zip(plain, other, strict=True))
    # glibc's sines and cosines round differently without a fused multiply-add: thousands of them in a run.
    if platform.libc_ver()[0] == "glibc" and "fma" in platform_name() and "GLIBC_TUNABLES" not in before:
        assert libm[HASHED.index(("exudyn", "tight"))] != plain[HASHED.index(("exudyn", "tight"))]


# ---- rates, and what is written


@pytest.mark.parametrize(("alarms", "tried"), [(0, 1), (0, 300), (1, 300), (3, 40), (63, 64), (20, 20)])
def test_intervals_are_quantiles_of_the_beta_distribution(alarms, tried):
    low, high = interval(alarms, tried)
    assert low == pytest.approx(beta.ppf(0.025, alarms, tried - alarms + 1) if alarms else 0.0, rel=1e-9)
    right = beta.ppf([0.975, 0.95], alarms + 1, tried - alarms) if alarms < tried else [1.0, 1.0]
    assert [high, upper_limit(alarms, tried)] == pytest.approx(right, rel=1e-9)
    assert (*interval(0, 0), upper_limit(0, 0)) == (0.0, 1.0, 1.0)


def test_counts_of_verdicts_without_a_fault():
    hidden = OPEN | {"confirmation": {"outcome": "underestimated"}}
    counts = count([AGREE, AGREE, CORRECTED, hidden, OPEN, DIFFER, DIFFER, {"verdict": "cannot compare"}])
    numbers = {"draws": 8, "decided": 6, "underestimated": 1, "alarms": 3}
    assert counts == numbers | {"upper_limit_95": round(upper_limit(3, 6), 5)}


def test_what_the_study_writes_is_what_a_baseline_reads(tmp_path):
    tried = trials(FAULTS)
    first = {"channel": "slider_x", "unit": "m", "time": 0.1, "difference": 1e-6, "threshold": 1e-9}
    search = {"found": 1.23456e-7, "shown": 1.23456e-7}
    results = Results(
        both=[(BOTH[0], {ROUNDINGS[0]: [AGREE] * 200, ROUNDINGS[1]: [AGREE] * 99 + [CORRECTED]})],
        own=[(OWN[0], [AGREE] * 300 + [DIFFER, OPEN])],
        bits={variant: (str(n),) * len(HASHED) for n, variant in enumerate(ROUNDINGS)},
        healthy=[AGREE],
        faults=[(trial, DIFFER | {"first": first}) for trial in tried[:-1]] + [(tried[-1], AGREE)],
        smallest={name: [{"found": None, "shown": 1e-8}, search, search] for name in RECORDS["smallest"]},
    )
    page = STUDY.report(results, tmp_path).read_text("utf-8")
    read = update._rates(tmp_path / "detection.json", None)
    assert read is not None
    numbers = {"draws": 302, "decided": 301, "underestimated": 0, "alarms": 1, "upper_limit_95": 0.01566}
    assert read.false_alarms[OWN[0].label] == numbers
    numbers = {"draws": 300, "decided": 300, "underestimated": 1, "alarms": 0, "upper_limit_95": 0.00994}
    assert read.false_alarms[BOTH[0].label] == numbers
    assert read.detected["tight"]["faults"] == sum(trial.tier == "tight" for trial in tried)
    assert page.splitlines()[2].startswith("**1 false alarms in 601 decided comparisons; ")
    assert "| both models, tight | 0 | 300 |" in page
    assert "draw 99 (): agree: too small." in page
    assert not re.search(r"\{\w*\}|\bnan\b", page)
    faults = pd.read_csv(tmp_path / "faults.csv")
    assert len(faults) == len(tried)
    assert faults["detected"].sum() == sum(rates["detected"] for rates in read.detected.values())
    lines = pd.read_csv(tmp_path / "comparisons.csv").set_index("comparison").loc[OWN[0].label]
    assert len(lines) == 302
    assert lines["slider_x"].value_counts().to_dict() == {"agree": 301, "differ": 1}
