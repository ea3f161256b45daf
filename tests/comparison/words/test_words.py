"""Sentences and numbers as they are shown, and the page on accuracy."""

import dataclasses
import math

import numpy as np
import pytest
from contact_tables import contacts_of
from doc_pages import ROOT, block

from comparison.accuracy.refine import Limit
from comparison.cli.console import Lines
from comparison.formatting import NO_BREAK, percent, quantity
from comparison.scene import load_scene
from comparison.verdict.results import SceneComparison
from comparison.words.differences import instant_of
from comparison.words.verdicts import card

EVENTS = contacts_of(("ul", 0.01, 0.011), ("ll", 0.01, 0.012), ("pin", 0.04, 0.05), ("ll", 0.045, 0.046))


@pytest.mark.parametrize(
    ("time", "words"),
    [
        (0.005, "before the first contact"),
        (0.0105, "during contact of the lower left corner and the upper left corner"),
        (0.015, "after contact of the lower left corner"),
        (0.0455, "during contact of the lower left corner and the crank pin"),
    ],
)
def test_an_instant_is_named_by_the_contact_in_progress_or_the_last_one(time, words):
    """Where both models' contacts differ, both are named; the order of the rows does not count."""
    same, other = EVENTS.iloc[::-1], EVENTS.assign(corner="lr", start=0.0, end=0.001)
    for events, sentence in (
        ((None, EVENTS), words),
        ((EVENTS, same), words),
        ((EVENTS, other), f"{words} (a), after contact of the lower right corner (b)"),
    ):
        scene = SceneComparison(("a", "b"), "differ", np.empty(0), {}, events=events)
        assert instant_of(time, scene).partition(" s, ")[2] == sentence


@pytest.mark.parametrize(("speed", "angle"), [(150.0, 8), (-150.0, 332)])
def test_cycle_and_angle_of_the_crank_follow_the_scene(speed, angle):
    # 0.42 s at 0.4 s a cycle: 18 degrees into the second.
    start = {"mechanism.crank_angle_deg": 350.0, "drive.speed_rpm": speed}
    scene = load_scene("150rpm-0.2mm", start).data
    comparison = SceneComparison(("a", "b"), "differ", np.empty(0), {}, period=0.4, scene=scene)
    assert instant_of(0.42, comparison) == f"0.42 s (cycle 2, crank at {angle}°)"


@pytest.mark.usefixtures("empty_cache")
def test_the_page_has_every_reason_and_its_python_runs(capsys):
    text = (ROOT / "docs" / "accuracy.md").read_text("utf-8")
    assert [limit for limit in Limit if f"`{limit}`" not in text] == []
    exec(block("docs/accuracy.md", "python"), {"__name__": "__main__"})  # our own text
    kept, coverage, largest, _ = capsys.readouterr().out.split()
    assert kept == "True"
    assert 0.5 < float(coverage) <= 1.0
    assert float(largest) > 0.0


def test_the_rest_is_foreseen_from_a_tenth_of_the_work_on(capsys):
    times = iter(np.arange(0.0, 9000.0, 100.0))
    report = Lines("run", lambda: next(times))
    for share in (0.01, 0.05, 0.5):
        report(share, "a part")
    first, second, third = capsys.readouterr().err.splitlines()
    assert not [line for line in (first, second) if "left" in line]
    # Half of the work less 1 % has taken 200 s.
    assert "50%, about 3 min left" in third


@pytest.mark.parametrize("has_file", [True, False])
def test_half_the_time_is_advised_where_no_finer_setting_is_left(has_file):
    """The advice is a command: there is none for a scene without a file."""
    scene = load_scene("wedge", {"drive.cycles": 0.3})
    run_scene = scene if has_file else dataclasses.replace(scene, source="")
    at = np.array([0.0, 1.0])
    commands = card(SceneComparison(("a", "b"), "indeterminate", at, {}, run_scene=run_scene)).commands
    assert commands == (("sixbar validate wedge --set drive.cycles=0.15",) if has_file else ())


QUANTITIES = {
    (5.2e-7, "m"): "520 nm",
    (9.999e-7, "m"): "1.00 µm",
    (0.0234, "m/s^2"): "23.4 mm/s²",
    (29_184.0, "rad/s²"): "29200 rad/s²",
    (1.5e-13, "m"): "1.50·10⁻¹³ m",
    (1.23e-3, "1"): "0.00123",
    (-1e5, "1"): "−1.00·10⁵",
    (0.0, "m"): "0 m",
    (math.nan, "m"): "n/a",
    (math.inf, "m"): "∞ m",
}
# Rounded to the bad side
SHARES = {1.0: "100 %", 0.999999: "99.99 %", 0.989999: "98.99 %", 0.29: "29.00 %", 0.0: "0.00 %"}


@pytest.mark.parametrize(
    ("result", "text"),
    [(quantity(*value), text) for value, text in QUANTITIES.items()]
    + [(percent(share), text) for share, text in SHARES.items()]
    + [(percent(math.nan), "n/a"), (percent(0.664, 0.003), "66.40 ± 0.3 %")],
)
def test_numbers_as_they_are_shown(result, text):
    assert result == text.replace(" ", NO_BREAK)
