"""The made-up comparisons of the report's own tests, and a browser that shows their pages."""

import shutil
from dataclasses import replace

import pytest
from bouncing_press import half_sines, make_scene
from outline import page
from playwright.sync_api import sync_playwright

from comparison.execution.run import Job
from comparison.scene import load_scene
from comparison.verdict.results import Basis, Confirmation, Doubt

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


@pytest.fixture(scope="session")
def comparisons():
    """Verdicts of all kinds, and none in the order of the page.

    Agreement at both tiers; a seeded fault; a difference that was confirmed, one that was withdrawn; too few
    predictable samples; a run that crashed.
    """

    def shift(columns):
        return columns | {"slider_x": columns["slider_x"] + 1e-6}

    press, fault = make_scene("press"), make_scene("fault", alter=shift)
    confirmation = Confirmation("confirmed", members=(99, 30))
    withdrawal = replace(confirmation, outcome="underestimated", factor=6.4)
    channel = replace(press.channels["slider_x"], verdict="indeterminate", basis=Basis.COVERAGE)
    scenes = [
        replace(press, tight=make_scene("press", tier="tight")),
        replace(fault, confirmation=Confirmation("unconfirmed", doubt=Doubt.FEW_RUNS, members=(3, 0))),
        replace(fault, name="confirmed", confirmation=confirmation),
        replace(press, name="underestimated", confirmation=withdrawal),
        replace(
            press, name="undecided", verdict="indeterminate", channels=press.channels | {"slider_x": channel},
            closer_command="sixbar validate press --accuracy strict",
        ),
        replace(
            press, name="crashed", verdict="cannot compare", channels={}, events=(None, None), provenance={},
            error="scene 'crashed': the exudyn run did not succeed: crashed; exit code 3",
            failed_job=Job(load_scene("150rpm-0.2mm"), "exudyn"),
        ),
    ]  # fmt: skip
    return [replace(scene, pulses=half_sines(scene)) for scene in scenes]


@pytest.fixture(scope="session")
def report(comparisons, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "report.html"
    path.write_text(page(*comparisons), "utf-8")
    return path


@pytest.fixture(scope="session")
def browser():
    if CHROMIUM is None:
        pytest.skip("no Chromium on this machine (Debian: apt-get install chromium)")
    with sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()


@pytest.fixture
def show(browser, report):
    """Return a function that opens the report or another page; errors and other requests fail the test."""
    errors, contexts = [], []

    def open_page(width=1440, height=900, anchor="", path=report, **options):
        context = browser.new_context(viewport={"width": width, "height": height}, **options)
        contexts.append(context)
        tab, url = context.new_page(), path.as_uri()
        tab.on("pageerror", lambda error: errors.append(f"error: {error}"))
        tab.on("console", lambda message: errors.append(f"console: {message.text}"))
        tab.on("request", lambda r: None if r.url.partition("#")[0] == url else errors.append(r.url))
        tab.goto(url + anchor)
        return tab

    yield open_page
    for context in contexts:
        context.close()
    assert errors == []
