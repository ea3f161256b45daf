"""What is compared without a fault: what is drawn, where drawing stops, which variants of rounding count."""

from __future__ import annotations

import os
import platform
from dataclasses import replace
from math import radians

import numpy as np
import pytest

from comparison.models import MODELS, platform_name
from comparison.scene import load_scene
from comparison.studies.detection.draws import (
    BOTH,
    HASHED,
    MOST,
    MOST_KEYS,
    OWN,
    ROUNDINGS,
    Draw,
    bits,
    changed,
    effective,
    hashes,
    keys,
    moved,
    own_pair,
    sample,
    scenes_with_clearance,
)
from comparison.studies.detection.faults import catalogue, installed
from comparison.studies.detection.pairs import find_all
from comparison.studies.shared.scenes import at_tier, leaves

AGREE, DIFFER, INDETERMINATE = ({"verdict": verdict} for verdict in ("agree", "differ", "indeterminate"))


def different(before, after):
    return {key for key in after if after[key] != before[key] and not key.startswith("scene.")}


@pytest.mark.parametrize("kind", BOTH, ids=lambda kind: kind.label)
def test_a_draw_is_a_shipped_scene_with_its_own_cycles_and_its_start_moved(kind):
    names = scenes_with_clearance()
    assert "ideal" not in names
    assert {"crank-pin", "both-clearances", "wedge", "90rpm-0.5mm"} <= set(names)
    drawn = [Draw(kind, ROUNDINGS[2], number).pair for number in range(len(names))]
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
        assert [pair.a.model, pair.b.model] == list(MODELS)
        assert pair.a.scene.hash == pair.b.scene.hash == pair.scene.hash
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
        first, second = pair.a.scene.data, pair.b.scene.data
        assert pair.a.scene.hash == pair.scene.hash
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
    ("wanted", "verdict", "draws", "decided"),
    [
        # Ten decided each, number 0, and number 10, which replaced it.
        (30, lambda n: INDETERMINATE if n in (0, 10) else AGREE, 12, 10),
        (30, lambda n: AGREE if n % 2 else INDETERMINATE, 13, 6),  # at most 1.25 times 10, rounded up
        (10, lambda _: DIFFER, 4, 4),  # a share that does not divide; a difference is decided as well
    ],
)
def test_drawing_stops_when_each_variant_has_its_share_of_decided_ones(wanted, verdict, draws, decided):
    asked = []

    def find(drawn):
        asked.extend((draw.rounding.name, draw.number) for draw in drawn)
        return [verdict(draw.number) for draw in drawn]

    drawn = sample(replace(BOTH[0], draws=wanted), ROUNDINGS[:3], find)
    for rounding in ROUNDINGS[:3]:
        assert len(drawn[rounding]) == draws
        assert sum(row != INDETERMINATE for row in drawn[rounding]) == decided
        assert [number for name, number in asked if name == rounding.name] == list(range(draws))
    assert draws <= np.ceil(MOST * np.ceil(wanted / 3))


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


def test_an_environment_changes_bits_where_its_library_has_other_code(tmp_path, monkeypatch):
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path))
    before = dict(os.environ)
    plain, libm = ROUNDINGS[0], ROUNDINGS[2]
    assert libm.environment[0][0] == "GLIBC_TUNABLES"
    hashed = dict(zip([*HASHED, *HASHED], bits([plain, libm]), strict=False))
    tasks = [task for task in bits([plain, libm]) if task.side == hashed["exudyn", "tight"].side]
    rows = find_all(tasks, 1)
    assert dict(os.environ) == before
    # glibc's sines and cosines round differently without a fused multiply-add: thousands of them in a run.
    if platform.libc_ver()[0] == "glibc" and "fma" in platform_name() and "GLIBC_TUNABLES" not in before:
        assert len({row["bits"] for row in rows}) == 2


@pytest.mark.slow
def test_sums_in_another_order_change_bits_of_both_models_at_both_tiers_on_any_machine(tmp_path, monkeypatch):
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path))
    two = ROUNDINGS[0], next(variant for variant in ROUNDINGS if variant.rearranged)
    assert two[1].environment == ()
    with installed(catalogue(["rearranged"])):
        plain, other = hashes(two, find_all(bits(two), 2)).values()
    assert all(len(one) == 64 and one != another for one, another in zip(plain, other, strict=True))
