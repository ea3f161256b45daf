"""Variants of rounding: they reach the worker processes alone, and count only where they change bits."""

from __future__ import annotations

import os
import platform

import pytest

from comparison.models import MODELS, platform_name
from comparison.studies.detection import rounding
from comparison.studies.detection.copies import changed, installed, package
from comparison.studies.detection.rounding import PLACES, REARRANGED, ROUNDINGS, effective, hashes
from comparison.studies.detection.tasks import find_all


@pytest.mark.parametrize("copy", REARRANGED, ids=lambda copy: copy.engine)
def test_a_rearranged_copy_replaces_exactly_one_place_of_the_present_sources(copy):
    text = (package(copy.model) / copy.file).read_text("utf-8")
    other = changed(text, copy)
    assert other != text
    compile(other, copy.file, "exec")


def test_variants_are_at_least_four_besides_the_machine_as_it_is():
    assert ROUNDINGS[0].environment == ()
    assert not ROUNDINGS[0].engines
    assert len({(r.environment, tuple(r.engines.values())) for r in ROUNDINGS}) == len(ROUNDINGS) >= 5


def test_a_variant_without_a_table_of_its_own_does_not_count():
    width = len(PLACES)
    plain = ("a",) * width
    # By the order of PLACES the first two are of the standard tier.
    measured = [
        plain,
        plain,
        ("b", *plain[1:]),
        ("b", *plain[1:]),
        (*plain[:-1], "c"),
        ("b", *plain[2:], "c"),
    ]
    by_variant = dict(zip(ROUNDINGS, measured, strict=True))
    names = {tier: effective(by_variant, tier) for tier in ("standard", "tight")}
    assert [place[1] for place in PLACES] == ["standard", "standard", "tight", "tight"]
    assert names == {"standard": [ROUNDINGS[0], ROUNDINGS[2]], "tight": [ROUNDINGS[0], ROUNDINGS[4]]}


def cheap():
    """Tables of the tight tier, of the models themselves."""
    at = [n for n, (_, tier) in enumerate(PLACES) if tier == "tight"]
    bits = rounding.measurements(ROUNDINGS)
    width = len(PLACES)
    return {
        variant: [bits[width * number + place] for place in at]
        for number, variant in enumerate(ROUNDINGS)
        if not variant.engines
    }


def test_an_environment_changes_bits_where_its_library_has_other_code(tmp_path, monkeypatch):
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path))
    before = dict(os.environ)
    tasks = cheap()
    found = iter(find_all([task for both in tasks.values() for task in both], 1, None))
    bits = {variant: [next(found)["bits"] for _ in both] for variant, both in tasks.items()}
    assert dict(os.environ) == before
    plain, libm = bits[ROUNDINGS[0]], bits[ROUNDINGS[2]]
    assert ROUNDINGS[2].environment[0][0] == "GLIBC_TUNABLES"
    # glibc's sines and cosines round differently without a fused multiply-add. The Exudyn model takes
    # thousands of them in a run; the reference computes its own where the slider alone has clearance.
    exudyn = MODELS.index("exudyn")
    if platform.libc_ver()[0] == "glibc" and "fma" in platform_name() and "GLIBC_TUNABLES" not in before:
        assert plain[exudyn] != libm[exudyn]
    # The rule by which a variant counts, on what was measured here.
    measured = {variant: ("", "", *own) for variant, own in bits.items()}
    copies = [variant for variant in ROUNDINGS if variant not in bits]
    counted = effective(measured | {copy: ("", "", copy.name, "") for copy in copies}, "tight")
    for variant, own in bits.items():
        others = [
            known for earlier, known in bits.items() if ROUNDINGS.index(earlier) < ROUNDINGS.index(variant)
        ]
        assert (variant in counted) == (own not in others)


@pytest.mark.slow
def test_sums_in_another_order_change_bits_of_both_models_at_both_tiers_on_any_machine(tmp_path, monkeypatch):
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path))
    tasks, width = rounding.measurements(ROUNDINGS), len(PLACES)
    other = next(number for number, variant in enumerate(ROUNDINGS) if variant.engines)
    assert ROUNDINGS[other].environment == ()
    with installed(REARRANGED):
        found = find_all([*tasks[:width], *tasks[width * other : width * (other + 1)]], 2, None)
    plain, rearranged = ([result["bits"] for result in found[at : at + width]] for at in (0, width))
    assert all(one != other for one, other in zip(plain, rearranged, strict=True))
    two = ROUNDINGS[0], ROUNDINGS[other]
    assert hashes(two, found) == dict(zip(two, (tuple(plain), tuple(rearranged)), strict=True))
