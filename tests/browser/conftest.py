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

    def moved(columns):
        return columns | {"slider_x": columns["slider_x"] + 1e-6}

    press, fault = make_scene("press"), make_scene("fault", alter=moved)
    confirmed = Confirmation("confirmed", members=(99, 30))
    withdrawn = replace(confirmed, outcome="underestimated", factor=6.4)
    vague = replace(press.channels["slider_x"], verdict="indeterminate", basis=Basis.COVERAGE)
    scenes = [
        replace(press, tight=make_scene("press", tier="tight")),
        replace(fault, confirmation=Confirmation("unconfirmed", doubt=Doubt.FEW_RUNS, members=(3, 0))),
        replace(fault, name="confirmed", confirmation=confirmed),
        replace(press, name="underestimated", confirmation=withdrawn),
        replace(
            press, name="undecided", verdict="indeterminate", channels=press.channels | {"slider_x": vague},
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
        running = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield running
        running.close()


@pytest.fixture
def show(browser, report):
    """Return what opens the report or another page; an error, or a request that leaves it, fails the test."""
    wrong, contexts = [], []

    def opened(width=1440, height=900, anchor="", path=report, **options):
        context = browser.new_context(viewport={"width": width, "height": height}, **options)
        contexts.append(context)
        shown, own = context.new_page(), path.as_uri()
        shown.on("pageerror", lambda error: wrong.append(f"error: {error}"))
        shown.on("console", lambda message: wrong.append(f"console: {message.text}"))
        shown.on("request", lambda r: None if r.url.partition("#")[0] == own else wrong.append(r.url))
        shown.goto(own + anchor)
        return shown

    yield opened
    for context in contexts:
        context.close()
    assert wrong == []
