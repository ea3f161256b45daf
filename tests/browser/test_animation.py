"""The animation as a browser shows it: it moves, the cursor with it, and asks for nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from comparison.report.pictures.animation import write_animation
from comparison.report.pictures.motion import motion

from comparison.scene import load_scene
from comparison.tables.table import Table

pytestmark = pytest.mark.browser


def table(size: float) -> Table:
    """The slider swings across its guide."""
    time = np.linspace(0.0, 0.8, 401)
    x = size * 2e-4 * np.sin(20.0 * time)
    return Table(
        pd.DataFrame({"time": time, "slider_x": x - 0.55, "slider_y": 0.1 * x, "slider_angle": 5.0 * x})
    )


@pytest.fixture
def page(browser, tmp_path):
    """The animation of two tables in a browser, with what went wrong in it."""
    moving = motion({"a": table(1.0), "b": table(0.9)}, load_scene("150rpm-0.2mm").data)
    path = write_animation(moving, tmp_path / "a.html", title="a", command="sixbar")
    opened = browser.new_page(viewport={"width": 390, "height": 800})
    opened.faults = []
    opened.on("pageerror", lambda error: opened.faults.append(str(error)))
    opened.on(
        "console", lambda message: opened.faults.append(message.text) if message.type == "error" else None
    )
    opened.on("request", lambda request: opened.faults.append(request.url))
    opened.goto(Path(path).as_uri())
    yield opened
    opened.close()


def state(page):
    return page.evaluate(
        """() => {
            const by = (id) => document.getElementById(id);
            return [by("frame").value, by("cursor").getAttribute("x1"),
                by("slider0").getAttribute("points"), by("now").textContent];
        }"""
    )


def test_the_drawing_the_cursor_and_the_clock_move_together(page):
    first = state(page)
    page.keyboard.press("ArrowRight")
    second = state(page)
    assert second[0] == "1"
    assert all(before != after for before, after in zip(first, second, strict=True))
    page.locator("#plot").click(position={"x": 200, "y": 30})
    third = state(page)
    assert int(third[0]) > 50
    page.keyboard.press("Space")
    assert page.locator("#play").text_content() == "Pause"
    page.wait_for_function(f"() => document.getElementById('frame').value > {third[0]}")
    page.keyboard.press("Space")
    assert page.locator("#play").text_content() == "Play"
    assert page.faults == [page.url]
    # On a phone nothing has to be scrolled to the side.
    assert page.evaluate("() => document.documentElement.scrollWidth") <= 390
