"""Units: exact factors, dimensions, and the spellings of other programs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from comparison.tables.channels import channels
from comparison.tables.units import parse


@pytest.mark.parametrize(
    ("text", "si", "factor"),
    [
        ("mm", "m", 1e-3),
        ("in", "m", 0.0254),
        ("µm", "m", 1e-6),
        ("ms", "s", 1e-3),
        ("deg", "rad", math.pi / 180),
        ("rpm", "rad/s", math.pi / 30),
        ("mm/s^2", "m/s^2", 1e-3),
        ("mm/sec**2", "m/s^2", 1e-3),
        ("mm/s²", "m/s^2", 1e-3),
        ("m·s⁻²", "m/s^2", 1.0),
        ("mm/(ms^2)", "m/s^2", 1e3),
        ("deg/sec", "rad/s", math.pi / 180),
        ("N mm", "N m", 1e-3),
        ("N*m", "N m", 1.0),
        ("newton-mm", "N m", 1e-3),
        ("kg mm^2/s^2", "J", 1e-6),
        ("kN", "N", 1e3),
        ("mJ", "J", 1e-3),
    ],
)
def test_spellings_and_factors(text, si, factor):
    unit, wanted = parse(text), parse(si)
    assert unit.powers == wanted.powers
    # The factor is one rounding from the written one, as is the test's own.
    assert float(unit.factor / wanted.factor) == pytest.approx(factor, rel=3e-16)


@pytest.mark.parametrize(
    "text", ["", " ", "furlong", "N/", "/s", "mm^", "mm//s", "x", "12", "MM", "m s oops"]
)
def test_what_is_no_unit(text):
    assert parse(text) is None


def test_every_channel_has_a_unit_that_is_known_and_si():
    for channel in channels().values():
        assert parse(channel.unit).factor == 1, channel.name


def test_an_angle_is_no_length_and_no_pure_number():
    assert len({parse(text).powers for text in ("rad", "m", "1", "s", "N", "N m")}) == 6


@given(st.integers(-(10**15), 10**15), st.sampled_from([("mm", 3), ("um", 6), ("ms", 3), ("cm", 2)]))
def test_a_decimal_unit_gives_the_double_next_to_the_exact_value(n, unit):
    text, digits = unit
    assert parse(text).convert(np.array([float(n)]), parse(text[-1]))[0] == float(f"{n}e-{digits}")
