"""The section on reliability: both models' numbers, the drawing, safe text, nothing where there is none."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from comparison.accuracy.uncertainty import Runs
from comparison.reliability.difference import ReliabilityComparison, compare_reliability
from comparison.report.page import render
from comparison.report.reliability import against_angle, drawings, section
from comparison.report.svg import style
from comparison.scene.criteria import Reliability
from comparison.tables.table import Table
from comparison.verdict.results import SceneComparison

SETTINGS = Reliability()


def table(scene: SceneComparison, error: float, bump: float = 0.0) -> Table:
    """The ideal motion with an error of the acceleration, larger between 100 and 108 degrees."""
    phase = 2 * np.pi * scene.time / 0.4
    angle = np.degrees(phase) % 360
    course = error + bump * ((angle > 100) & (angle <= 108))
    columns = {"slider_y": 0.1 * np.cos(phase), "slider_vy": np.sin(phase), "slider_ay": course}
    return Table(pd.DataFrame({"time": scene.time} | columns))


@pytest.fixture(scope="module")
def judged(scene: SceneComparison) -> SceneComparison:
    ideal = table(scene, 0.0)
    of = [table(scene, error, 90.0) for error in (15.0, 15.4)]
    runs, ideals = (Runs(of[0], of[0]), Runs(of[1], of[1])), (Runs(ideal, ideal),) * 2
    quantities = compare_reliability(runs, ideals, 0.4, SETTINGS, 2.0)
    return replace(scene, reliability=ReliabilityComparison(SETTINGS, quantities))


def test_the_section_shows_both_models_their_difference_and_the_cap(judged: SceneComparison) -> None:
    html = render([judged], title="Press", command="sixbar validate")
    part = html[html.index("<h3>Reliability of the motion") : html.index(">Runs</h3>")]
    shown = " ".join(re.sub(r"<[^>]*>", " ", part).split())
    found = judged.reliability.quantities["acceleration"]
    assert "smallest reliabilities: ✗ differ" in shown
    for of in (found.a, found.b):
        assert f"{of.minimum:.5f} at 108°" in shown
    assert "acceleration slider_ay 150 m/s²" in shown
    assert "0.9986501 the cap" in shown
    assert "displacement in 10 of 10 parts" in shown
    # It is separate from the verdict of the scene, which stays as it was.
    assert "No verdict of a scene or a channel depends on it" in " ".join(html.split())
    assert "✓</span> agree" in html[html.index("<header>") : html.index("</header>")]
    assert part.count("<svg") == 1
    ids = re.findall(r' id="([^"]*)"', html)
    assert len(ids) == len(set(ids))


def test_at_the_tight_tier_it_is_a_table_without_a_drawing(judged: SceneComparison) -> None:
    tiered = replace(judged, tight=replace(judged, tier="tight"))
    html = render([tiered], title="Press", command="sixbar validate")
    tight = html[html.index(">Tight tier</h3>") :]
    assert 'aria-label="Reliability of scene press, tight tier"' in tight
    assert "Reliability against the crank angle" not in tight


def test_the_lines_of_the_drawing_are_the_reliabilities_at_the_upper_edges(judged: SceneComparison) -> None:
    quantities = judged.reliability.quantities
    with style():
        figure = against_angle(quantities, ("$x", "_y"))
        (drawn,) = drawings(judged, "key")
    for axes, found in zip(figure.axes, quantities.values(), strict=True):
        cap, first, second = axes.lines
        assert np.array_equal(first.get_xdata(), 36.0 * np.arange(1, 11))
        assert np.array_equal(first.get_ydata(), found.a.reliability)
        assert np.array_equal(second.get_ydata(), found.b.reliability)
        assert set(cap.get_ydata()) == {found.a.cap}
        low, high = axes.get_ylim()
        assert low < found.b.minimum <= found.a.cap < high
    assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()] == ["$x", "_y", "no error"]
    assert figure.axes[-1].get_xlabel() == "crank angle from the start (deg)"
    assert drawn.verdict == "differ"


def test_a_reason_is_escaped_and_without_a_reliability_there_is_no_section(
    judged: SceneComparison, scene: SceneComparison
) -> None:
    missing = ReliabilityComparison(SETTINGS, missing="the model <b>mine</b> refused")
    refused = replace(scene, reliability=missing)
    html = render([refused], title="Press", command="sixbar validate")
    assert "Not available: the model &lt;b&gt;mine&lt;/b&gt; refused." in html
    assert drawings(refused, "key") == []
    assert section(scene) is None
    plain = render([scene], title="Press", command="sixbar validate")
    assert "Reliability" not in plain
    one_part = {name: of for name, of in judged.reliability.quantities.items() if name == "velocity"}
    assert len(section(replace(judged, reliability=ReliabilityComparison(SETTINGS, one_part)))["rows"]) == 1
