"""The report as a browser shows it: nothing missing, cut off or on top of something else, wide and narrow."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from comparison.agreement.results import SceneComparison
from comparison.report import write_report

pytestmark = pytest.mark.browser

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
WIDTHS = (400, 1280)

# The page goes into frames of the wanted widths (a window cannot be narrower than 500), all parts opened.
MEASURE = """
addEventListener("load", () => {
  const result = {};
  for (const frame of document.querySelectorAll("iframe")) {
    const page = frame.contentDocument, root = page.documentElement;
    const closed = page.querySelectorAll("details:not([open])").length;
    page.querySelectorAll("details").forEach(d => { d.open = true; });
    const box = e => e.getBoundingClientRect(), drawn = e => box(e).width > 0 && box(e).height > 0;
    const cut = [], overlaps = [];
    for (const figure of page.querySelectorAll("figure svg")) {
      const outer = box(figure), texts = [...figure.querySelectorAll("text")];
      const boxes = texts.map(box);
      boxes.forEach((b, i) => {
        const name = texts[i].textContent.trim();
        const out = [outer.left - b.left, b.right - outer.right, outer.top - b.top, b.bottom - outer.bottom];
        if (Math.max(...out) > 1) cut.push(name);
        for (let j = 0; j < i; j++) {
          const c = boxes[j];
          const wide = Math.min(b.right, c.right) - Math.max(b.left, c.left);
          const high = Math.min(b.bottom, c.bottom) - Math.max(b.top, c.top);
          if (wide > 1 && high > 3) overlaps.push(name + " / " + texts[j].textContent.trim());
        }
      });
    }
    const figures = [...page.querySelectorAll("figure svg")];
    const letters = figures.flatMap(s => [...s.querySelectorAll("text, tspan")].map(t =>
      parseFloat(frame.contentWindow.getComputedStyle(t).fontSize) * box(s).width / s.viewBox.baseVal.width));
    result[frame.width] = {
      overflow: root.scrollWidth - root.clientWidth, closed, cut, overlaps,
      lead: page.querySelector(".lead").innerText,
      figures: figures.filter(drawn).length,
      lines: figures.map(s => [...s.querySelectorAll("path")].filter(p => p.getTotalLength() > 0).length),
      strips: [...page.querySelectorAll("svg.strip")].filter(drawn).length,
      smallest: Math.min(...letters),
    };
  }
  document.body.innerHTML = "<pre id=result></pre>";
  document.getElementById("result").textContent = JSON.stringify(result);
});
"""


def chromium(profile: Path, *arguments: str) -> str:
    """Run a headless browser on its own profile; returns its standard output."""
    if CHROMIUM is None:
        pytest.skip("no Chromium on this machine (Debian: apt-get install chromium)")
    flags = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--hide-scrollbars"]
    flags += ["--disable-background-networking", "--disable-component-update", "--disable-sync"]
    command = [CHROMIUM, *flags, f"--user-data-dir={profile}", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout


@pytest.fixture(scope="module")
def report(comparisons: list[SceneComparison], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    return write_report(comparisons, folder, title="Press", command="sixbar validate press moved")


@pytest.fixture(scope="module")
def measured(report: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    """What the browser made of the page, by width."""
    folder = tmp_path_factory.mktemp("measure")
    content = html.escape(report.read_text("utf-8"), quote=True)
    frames = "".join(f'<iframe width="{width}" height="900" srcdoc="{content}"></iframe>' for width in WIDTHS)
    page = folder / "frames.html"
    page.write_text(f"<!DOCTYPE html><meta charset=utf-8><script>{MEASURE}</script>{frames}", "utf-8")
    dump = chromium(folder / "profile", "--virtual-time-budget=20000", "--dump-dom", page.as_uri())
    found = re.search(r'<pre id="result">(.*?)</pre>', dump, re.DOTALL)
    assert found is not None, dump[:500]
    return json.loads(html.unescape(found[1]))  # type: ignore[no-any-return]


@pytest.mark.parametrize("width", ["400", "1280"])
def test_every_figure_and_the_verdict_are_there(
    measured: dict[str, dict[str, Any]], comparisons: list[SceneComparison], report: Path, width: str
) -> None:
    seen = measured[width]
    assert "differ" in seen["lead"]
    assert "At the standard tier of 2 scenes 1 differs and 1 agrees; at the tight tier" in seen["lead"]
    # Nine of motion, the normal forces of two corners and the enlargement; more where others differ.
    assert seen["figures"] == report.read_text("utf-8").count("<figure>") >= 2 * 12
    # Both axes with grid and ticks, both models, the difference, the threshold, and their legends.
    assert min(seen["lines"]) >= 10
    channels = [
        channel for scene in comparisons for tier in scene.tiers for channel in tier.channels.values()
    ]
    assert seen["strips"] == sum(channel.verdict != "unexcited" for channel in channels)
    assert seen["closed"] == 1 + 2 * 2  # one of two scenes, and of each its numbers and the other measures


@pytest.mark.parametrize("width", ["400", "1280"])
def test_nothing_is_cut_off_or_overlaps(measured: dict[str, dict[str, Any]], width: str) -> None:
    seen = measured[width]
    assert seen["overflow"] == 0
    assert seen["cut"] == []
    assert seen["overlaps"] == []


@pytest.mark.parametrize(("width", "pixels"), [("400", 7.0), ("1280", 11.0)])
def test_letters_in_figures_can_be_read(
    measured: dict[str, dict[str, Any]], width: str, pixels: float
) -> None:
    # Exponents of the logarithmic ticks are the smallest: 0.7 of the labels.
    assert measured[width]["smallest"] >= 0.7 * pixels


@pytest.mark.parametrize("size", ["500,2000", "1280,2000"])
def test_a_screenshot_shows_a_page_and_not_a_blank(report: Path, tmp_path: Path, size: str) -> None:
    picture = tmp_path / "page.png"
    chromium(tmp_path / "profile", f"--window-size={size}", f"--screenshot={picture}", report.as_uri())
    # A blank PNG of this size has some 10 kB.
    assert picture.stat().st_size > 40e3
