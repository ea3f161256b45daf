"""The figure of one impact: which one, with both pulses whole and the peaks of the event tables."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
from half_sines import half_sines

from comparison.report import svg
from comparison.report.gallery import figures
from comparison.report.impact_figure import draw_impact, representative_impact
from comparison.verdict.results import Attribution, SceneComparison


def test_the_largest_impact_is_drawn_and_where_the_models_differ_the_last_one_before(
    scene: SceneComparison,
) -> None:
    pulses = half_sines(scene)
    events, _ = scene.events
    assert events is not None
    impact = representative_impact(scene, pulses)
    assert impact is not None
    assert impact.first[0]["peak_force"] == events["peak_force"].max()
    third = float(events["start"].sort_values().iloc[2])
    early = replace(scene, attribution=Attribution(outside_from=third + 1e-6))
    impact = representative_impact(early, pulses)
    assert impact is not None
    assert impact.first[0]["start"] == third
    assert impact.second[0]["corner"] == impact.first[0]["corner"]
    # One model alone shows no agreement.
    assert representative_impact(scene, (pulses[0], [])) is None
    assert representative_impact(replace(scene, events=(None, None)), pulses) is None


def test_both_pulses_are_whole_in_the_drawing(scene: SceneComparison) -> None:
    impact = representative_impact(scene, half_sines(scene))
    assert impact is not None
    with svg.style():
        drawing = draw_impact(impact, ("$x^2$", "exudyn"), "k")
    lines = [path for path in re.findall(r'd="M([^"]*)"', drawing) if path.count("L") == 24]
    assert len(lines) == 2
    for line in lines:
        height = np.array([float(point.split()[1]) for point in line.split("L")])
        # Upwards is down in a drawing: it starts and ends at the bottom, and has one peak half-way.
        assert height.argmin() == 12
        assert height[0] == height[-1] == height.max()
    assert "$x^2$" in drawing
    assert "normal force (N)" in drawing
    assert "time from the touch (µs)" in drawing


def test_the_figure_stands_among_the_scenes_with_peaks_in_words(scene: SceneComparison) -> None:
    with svg.style():
        headings = [drawing.heading for drawing in figures(scene, "s0")]
        drawings = figures(scene, "s0", half_sines(scene))
    assert [d.heading for d in drawings if d.heading not in headings] == [drawings[1].heading]
    assert drawings[1].heading.startswith("An impact resolved: lower ")
    events, _ = scene.events
    assert events is not None
    assert f"Peak {events['peak_force'].max():.3g}"[:7] in drawings[1].caption
    assert "(25 points)" in drawings[1].alt
