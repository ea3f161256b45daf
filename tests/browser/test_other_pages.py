"""The animation, and the page of three models: one viewer, one drawing, nothing asked for."""

import numpy as np
import pandas as pd
import pytest

from comparison.report.page import Row, write_animation, write_pairwise
from comparison.scene import load_scene
from comparison.tables.table import Table
from comparison.tables.table_files import write
from comparison.verdict.validate import pairs, standing, validate

pytestmark = pytest.mark.browser


def table(size):
    """The slider swings across its guide."""
    time = np.linspace(0.0, 0.8, 401)
    x = size * 2e-4 * np.sin(20.0 * time)
    columns = {"time": time, "slider_x": x - 0.55, "slider_y": 0.1 * x, "slider_angle": 5.0 * x}
    return Table(pd.DataFrame(columns), provenance={"scene": load_scene("150rpm-0.2mm").data})


STATE = """() => {
  const v = [...viewers.values()][0], part = name => document.querySelector(name);
  const points = [".body.first", ".body.second"].map(name => part(name).getAttribute("points"));
  return [v.index, v.slider.value, ...points, part(".at-A").getAttribute("cx"), part(".heading").textContent];
}"""


def test_the_animation_moves_drawing_cursor_and_clock_together(show, tmp_path):
    tables = {"a": table(1.0), "b": table(0.9)}
    scene = load_scene("150rpm-0.2mm").data
    path = write_animation(tables, scene, tmp_path / "a.html", title="a", command="sixbar")
    page = show(390, 800, path=path)
    page.locator("canvas").first.wait_for()
    page.focus(".plots")
    first = page.evaluate(STATE)
    page.keyboard.press("ArrowRight")
    page.wait_for_timeout(50)
    second = page.evaluate(STATE)
    assert second[0] == 1
    assert all(before != after for before, after in zip(first, second, strict=True))
    page.keyboard.press("Space")
    assert page.locator("button[aria-pressed=true]").inner_text() == "■ stop"
    page.wait_for_function("() => [...viewers.values()][0].index > 5")
    page.keyboard.press("Space")
    assert page.locator("button[aria-pressed=false]").inner_text() == "▶ play"
    # On a phone nothing has to be scrolled to the side.
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_a_linkage_moves_with_the_cursor(show, tmp_path):
    scene = load_scene("quick-return", {"output.samples_per_cycle": 100, "solver.exudyn.step": 2e-4})
    (result,) = validate(scene, n_jobs=0)
    page = show(path=result.comparison.report(tmp_path / "a.html"))
    page.locator("canvas").first.wait_for()
    page.focus(".plots")
    for _ in range(5):
        page.keyboard.press("ArrowRight")
    page.wait_for_function("() => [...viewers.values()][0].index == 5")
    rotation = """name => document.querySelector(`[data-body=${name}]`).getAttribute("transform")
      .match(/rotate.(.*).$/)[1]"""
    # It starts at 0 degrees and turns counter-clockwise, which is negative in SVG.
    assert float(page.evaluate(rotation, "crank")) == pytest.approx(-5 * 3.6, abs=0.05)
    for name in page.locator("[data-body=crank] .name").all():  # its name and those of its pins do not turn
        assert float(name.get_attribute("transform")[7:-1]) == pytest.approx(5 * 3.6, abs=0.05)
    block, rocker = (float(page.evaluate(rotation, name)) for name in ("block", "rocker"))
    assert block == pytest.approx(rocker, abs=0.05)
    assert float(page.evaluate(rotation, "ram")) == 0.0  # constant: not among the plots
    assert page.locator(".schematic .heading").text_content() == "linkage at 0.1000 s"


def test_three_models_are_on_common_plots(show, tmp_path):
    models = ("a", "b", "c")
    agreement = {"verdict": "agree", "ratio": 0.5, "channels": {}}
    for first, second in pairs(models):
        for model in (first, second):
            folder = tmp_path / f"{first}-{second}" / "tables"
            write(table(1.0 + 0.1 * models.index(model)), folder / f"swing-{model}.csv")
    outcome = standing(models, dict.fromkeys(pairs(models), "agree"))
    row = Row("swing", "A swing", outcome, dict.fromkeys(pairs(models), agreement))
    page = show(390, 800, path=write_pairwise([row], tmp_path, models=models, command="sixbar validate"))
    page.locator("canvas").first.wait_for()
    labels = page.evaluate(
        "() => [...viewers.values()][0].plots.map(p => p.series.slice(1).map(s => s.label))"
    )
    assert labels == [["a", "b", "c"], ["a − b", "a − c", "b − c"]]
    largest = page.evaluate(
        "() => [...viewers.values()][0].data.channels[0].sizes.map(s => Math.max(...s.map(v => v || 0)))"
    )
    # 5 bits of mantissa of either difference from the first.
    assert largest == pytest.approx([2e-5, 4e-5, 2e-5], rel=0.05)
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
