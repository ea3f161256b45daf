"""The paper's figures and statements: how they are judged, on made-up motions whose answer is known."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from comparison.execution.run import MODELS
from comparison.reliability.interference import reliability
from comparison.scene import load_scene, shipped_scenes
from comparison.scene.criteria import Limits
from comparison.studies.paper import claims, dynamics, measures, rows, runs, tolerances, trends
from comparison.studies.paper.decision import CONTRADICTED, SUPPORTED, UNDECIDED, decide
from comparison.studies.shared.page import single_page
from comparison.studies.shared.published import printed_rows, published
from comparison.tables.table import Table

TURNS = 12
DENSE, SPARSE = 200, 50


@pytest.fixture(autouse=True)
def few_samples(monkeypatch):
    for module in (runs, measures, trends):
        for name, value in (("SAMPLES", DENSE), ("LONG_SAMPLES", SPARSE)):
            if hasattr(module, name):
                monkeypatch.setattr(module, name, value)


def table(period, turns, per_turn, y=0.0, x=0.0, vy=0.0, ay=0.0, events=()):
    """A run: the ideal motion y = 0.1 cos, plus errors of shape (turns * per_turn + 1,) or numbers."""
    time = np.arange(turns * per_turn + 1) * (period / per_turn)
    angle = 2 * np.pi * time / period
    w = 2 * np.pi / period
    frame = pd.DataFrame(
        {
            "time": time,
            "slider_x": -0.54995 + x + 0 * time,
            "slider_y": 0.112 * np.cos(angle) + y,
            "slider_vx": 0 * time,
            "slider_vy": -0.112 * w * np.sin(angle) + vy,
            "slider_ay": -0.112 * w**2 * np.cos(angle) + ay,
        }
    )
    contacts = pd.DataFrame(events, columns=["start", "peak_force"])
    extrema = {name: {"min": frame[name].min(), "max": frame[name].max()} for name in frame}
    return Table(frame, contacts, extrema)


def motions(changes=None, long=None, twin=None):
    """Runs of all conditions without any error, but for some: (scene, channel) -> sizes of each member's."""
    short, ideal, many = {}, {}, {}
    for scene in runs.SCENES:
        period = load_scene(scene).period
        phase = np.sin(2 * np.pi * np.arange(2 * DENSE + 1) / DENSE)
        for model in MODELS:
            ideal[scene, model] = table(period, 2, DENSE)
            short[scene, model] = [
                table(
                    period,
                    2,
                    DENSE,
                    **{c.removeprefix("slider_"): each * phase for (s, c), each in of.items() if s == scene},
                )
                for of in (changes or [{}])
            ]
            many[scene, model] = table(period, TURNS, SPARSE, **(long or {}).get(scene, {}))
    period = load_scene(runs.CENTRAL).period
    twins = {model: table(period, TURNS, SPARSE, **(twin or {})) for model in MODELS}
    return runs.Runs(short, ideal, many, twins, twins, {})


def larger(channel="slider_y"):
    return {"channel": channel, "more": "69GPa", "less": runs.CENTRAL}


def test_every_printed_row_has_a_scene_and_every_claim_a_test_and_scenes():
    for identifier in printed_rows().index:
        assert measures.scene_of(str(identifier)) in shipped_scenes()
    for claim in claims.all_claims():
        assert claim["test"] in claims.TESTS
        named = [claim.get(key) for key in ("scene", "more", "less")] + claim.get("scenes", [])
        assert set(named) - {None} <= set(runs.SCENES)
    assert len({claim["id"] for claim in claims.all_claims()}) == len(claims.all_claims())


@pytest.mark.parametrize(
    ("ratio", "verdict"),
    [
        (1.0, "reproduced"),
        (0.951, "reproduced"),
        (1.06, "within a factor 2"),
        (0.5, "within a factor 2"),
        (2.01, "contradicted"),
        (0.49, "contradicted"),
        (0.0, "contradicted"),
    ],
)
def test_what_a_ratio_means(ratio, verdict):
    assert rows.judge(ratio) == verdict


def test_a_printed_figure_is_judged_by_the_worse_model_and_a_misprint_not_at_all():
    size = published("F9-69-d").value
    of = motions([{("69GPa", "slider_y"): size}])
    worse = table(load_scene("69GPa").period, 2, DENSE, y=3 * size)
    of.short["69GPa", "exudyn"] = [worse]
    judged = {row.identifier: row for row in rows.all_rows(of)}
    row = judged["F9-69-d"]
    assert row.ratio["reference"] == pytest.approx(1.0, rel=1e-3)
    assert row.ratio["exudyn"] == pytest.approx(3.0, rel=1e-6)
    assert row.verdict == "contradicted"
    assert judged["F7-T-d"].verdict == judged["F14c-y"].verdict == "not comparable"
    # Printed at the cap, and without any error: nothing could be told.
    assert judged["F16-01-d"].verdict == "not comparable"
    assert "cap" in judged["F16-01-d"].reason
    # Without any error nothing is missing to the cap, whatever the limit; the paper misses 0.02.
    assert judged["F17-300-a"].ratio == dict.fromkeys(MODELS, pytest.approx(0.0, abs=1e-9))
    assert judged["F17-300-a"].verdict == "contradicted"


def test_the_stroke_and_the_dead_centre_of_a_cosine():
    of = motions()
    assert measures.measure("S4.2-stroke", "lowest_displacement", of, "reference").value == pytest.approx(
        -0.224
    )
    tdc = measures.measure("S2.2-tdc", "crank_angle_at_top_dead_centre", of, "exudyn").value
    assert tdc == pytest.approx(111.36, abs=1e-9)


def test_a_peak_between_two_samples_counts_if_it_is_in_the_second_turn():
    of = motions([{(runs.CENTRAL, "slider_ay"): 3.0}])
    run = of.short[runs.CENTRAL, "reference"][0]
    ideal = np.interp(0.5, run.time, of.ideal[runs.CENTRAL, "reference"].values("slider_ay"))
    for time, expected in ((0.5, -70.0), (0.1, 3.0)):
        run.extrema["slider_ay"] = {"min": ideal - 70.0, "time_of_min": time, "max": 0.0, "time_of_max": 0.0}
        found = measures.largest_error(of, runs.CENTRAL, "reference", "slider_ay", 0)
        assert abs(found.value) == pytest.approx(abs(expected), rel=1e-3)


def test_peaks_of_the_first_turn_and_near_an_instant():
    of = motions([{(runs.CENTRAL, "slider_y"): 1e-5}])  # 1e-5 sin
    period = load_scene(runs.CENTRAL).period
    assert measures.first_turn(of, runs.CENTRAL, "reference", "slider_y").time <= period
    # At the zero crossing sin(2 pi 0.025) of the largest is reached within 2.5 % of a turn.
    close = measures.near(of, runs.CENTRAL, "reference", "slider_y", 1.5 * period)
    assert abs(close.value) == pytest.approx(1e-5 * np.sin(2 * np.pi * 0.025), rel=1e-6)
    found = measures.measure("F9-210-d", "peak_displacement_error", of, "reference")
    assert found.sampled == found.value


def test_larger_errors_in_both_looks_support_and_smaller_ones_contradict():
    base, soft = (runs.CENTRAL, "slider_y"), ("69GPa", "slider_y")
    turn = np.repeat(1 + 0.01 * np.arange(TURNS), SPARSE)
    wave = np.append(turn * np.sin(2 * np.pi * np.arange(TURNS * SPARSE) / SPARSE), 0.0)
    small, big = {"y": 1e-5 * wave}, {"y": 2e-5 * wave}
    members = [{base: 1.0e-5, soft: 2.0e-5}, {base: 1.1e-5, soft: 2.1e-5}]
    up = motions(members, {runs.CENTRAL: small, "69GPa": big})
    assert trends.larger(up, "reference", larger()).verdict == SUPPORTED
    down = motions([{base: 2e-5, soft: 1e-5}], {runs.CENTRAL: big, "69GPa": small})
    assert trends.larger(down, "reference", larger()).verdict == CONTRADICTED
    at_odds = motions(members, {runs.CENTRAL: big, "69GPa": small})
    assert trends.larger(at_odds, "reference", larger()).verdict == UNDECIDED
    overlapping = motions(
        [{base: 1e-5, soft: 2e-5}, {base: 3e-5, soft: 1e-5}], {runs.CENTRAL: small, "69GPa": big}
    )
    assert trends.larger(overlapping, "reference", larger()).verdict == UNDECIDED


def test_accelerations_of_later_turns_are_judged_by_the_forces_of_the_contacts():
    period = load_scene(runs.CENTRAL).period
    hits = [((k + 0.3) * period, 10.0 + k) for k in range(TURNS)] + [(0.9 * period, 900.0)]
    of = motions(long={"69GPa": {"events": hits}})
    # The first turn, with its 900 N, does not count.
    assert trends.later_turns(of, "69GPa", "exudyn", "slider_ay") == pytest.approx(10.0 + np.arange(1, TURNS))
    assert trends.later_turns(of, runs.PIN, "exudyn", "slider_y").size == TURNS - 1
    # Nor do its two contacts.
    assert trends.contacts_per_turn(of, "69GPa", "exudyn") == pytest.approx(np.ones(TURNS - 1))
    more = trends.more_contacts(of, "reference", {"more": "69GPa", "less": runs.CENTRAL})
    assert more.verdict == SUPPORTED


def test_mann_and_whitney():
    assert trends.above(np.array([2.0, 3.0]), np.array([1.0, 2.0])) == pytest.approx(3.5 / 4)


def noise(seed, size=5e-5):
    return size * np.random.default_rng(seed).standard_normal(TURNS * SPARSE + 1)


def of_twins(base, twin, finer):
    many = motions(long={runs.CENTRAL: {"x": base}}, twin={"x": twin})
    other = motions(twin={"x": finer})
    return replace(many, finer=other.twin)


def test_a_twin_as_different_as_any_two_turns_is_chaos_and_one_that_stays_close_is_not():
    claim = {"scene": runs.CENTRAL}
    base = noise(1)
    chaos = dynamics.sensitive(of_twins(base, noise(2), noise(3)), "reference", claim)
    assert chaos.verdict == SUPPORTED
    close = dynamics.sensitive(of_twins(base, base + 1e-9, noise(3)), "reference", claim)
    assert close.verdict == CONTRADICTED
    nothing = dynamics.sensitive(of_twins(0.0, 0.0, 0.0), "reference", claim)
    assert nothing.verdict == CONTRADICTED
    # A map that is ten times narrower at a closer tolerance is the solver's own.
    solver = dynamics.sensitive(of_twins(base, noise(2), noise(3, 5e-6)), "reference", claim)
    assert solver.verdict == UNDECIDED
    assert "0.10 times as wide" in solver.evidence or "0.0" in solver.evidence


def test_scattered_points_and_a_repeating_motion():
    loose = motions(long={runs.CENTRAL: {"x": noise(1), "y": noise(2)}})
    of_x, of_y = ({"scene": runs.CENTRAL, "channel": f"slider_{axis}"} for axis in "xy")
    assert dynamics.scattered(loose, "reference", of_x).verdict == SUPPORTED
    assert dynamics.scattered(motions(), "reference", of_x).verdict == CONTRADICTED
    # Scattered at a fifth of all angles only: it hangs on the angle of the section.
    here = np.append(np.tile(np.arange(SPARSE) < SPARSE // 5, TURNS), False)
    partly = motions(long={runs.CENTRAL: {"x": here * noise(1)}})
    assert dynamics.scattered(partly, "reference", of_x).verdict == UNDECIDED
    assert dynamics.periodic(loose, "reference", of_y).verdict == SUPPORTED  # noise of 1e-3 of the stroke
    shaken = motions(long={runs.CENTRAL: {"y": 100 * noise(2)}})
    assert dynamics.periodic(shaken, "reference", of_y).verdict == CONTRADICTED
    assert dynamics.recurring(loose, "reference", of_y).verdict != SUPPORTED
    wave = np.sin(2 * np.pi * np.arange(TURNS * SPARSE + 1) / SPARSE)
    again = motions(long={runs.CENTRAL: {"y": 1e-5 * wave}})
    assert dynamics.recurring(again, "reference", of_y).verdict == SUPPORTED


def test_contacts_and_crossings_are_counted_by_the_turn():
    claim = {"scene": runs.CENTRAL}
    clearance = load_scene(runs.CENTRAL).data["clearance"]["slider"]
    period = load_scene(runs.CENTRAL).period
    wave = np.sin(2 * np.pi * 3 * np.arange(TURNS * SPARSE + 1) / SPARSE)
    hits = [((turn + (k + 0.5) / 12) * period, 1.0) for turn in range(TURNS) for k in range(12)]
    # From the guide's centre line: the ideal slider's is 0.05 mm beside it.
    of = motions(long={runs.CENTRAL: {"x": clearance * wave - 5e-5, "events": hits}})
    decision = dynamics.traversals(of, "reference", claim)
    assert decision.verdict == SUPPORTED
    assert decision.evidence.startswith("12.0 contacts a turn or more; 5 to 5 crossings")
    assert dynamics.traversals(motions(), "reference", claim).verdict == CONTRADICTED


@pytest.mark.parametrize(
    ("angles", "verdict"),
    [
        ((135, 225), SUPPORTED),
        ((-45, 45), SUPPORTED),  # the same in the frame of the pin
        ((135, -45), CONTRADICTED),
        ((135, 135, 135, 135, 135, 135, 135, 135, 135, 135, 135, 135, 135, 135, 135, 225), UNDECIDED),
    ],
)
def test_the_quadrants_in_which_the_pin_pushes(angles, verdict):
    time = np.linspace(0.0, 0.8, 2 * DENSE + 1)
    # In the first turn it pushes elsewhere.
    angle = np.radians(np.where(time < 0.399, 45, np.resize(angles, time.size)))
    frame = pd.DataFrame(
        {"time": time, "reaction_A_x": 50 * np.cos(angle), "reaction_A_y": 50 * np.sin(angle)}
    )
    of = replace(motions(), pin={(runs.PIN, "reference"): Table(frame)})
    assert dynamics.pin_zones(of, "reference", {"scene": runs.PIN}).verdict == verdict


def test_contacts_near_the_lowest_point():
    period = load_scene(runs.CENTRAL).period
    of = motions()
    short = of.short[runs.CENTRAL, "reference"]
    claim = {"scene": runs.CENTRAL}
    assert dynamics.contacts_at_the_bottom(of, "reference", claim).verdict == CONTRADICTED
    # The lowest point of the second turn of a cosine.
    short[0] = table(period, 2, DENSE, events=[(1.5 * period + by, 1.0) for by in (-0.015, 0.0, 0.01, 0.03)])
    decision = dynamics.contacts_at_the_bottom(of, "reference", claim)
    assert decision.verdict == SUPPORTED
    assert decision.evidence.startswith("3 contacts")


def test_two_codes_that_differ_by_half_of_the_error_are_not_consistent():
    of = motions([{(runs.CENTRAL, channel): 1e-5 for channel in runs.CHANNELS}])
    claim = {"scene": runs.CENTRAL}
    assert dynamics.two_codes(of, "reference", claim).verdict == SUPPORTED
    other = motions([{(runs.CENTRAL, channel): 2e-5 for channel in runs.CHANNELS}])
    of.short[runs.CENTRAL, "exudyn"] = other.short[runs.CENTRAL, "exudyn"]
    assert dynamics.two_codes(of, "reference", claim).verdict == CONTRADICTED


def test_a_known_limit_is_implied_by_the_reliability_that_it_gives(monkeypatch):
    size = 20.0
    of = motions([{("300rpm-0.2mm", "slider_ay"): size}])
    assessed = measures.reliabilities(of, "300rpm-0.2mm", "reference")["acceleration"]
    last = int(np.argmin(np.abs(assessed.angle - 360.0)))
    exact = float(reliability(Limits(upper=55.0), assessed.mean[last], assessed.deviation[last]))
    printed = {"F17-300-a": published("F17-300-a")}
    monkeypatch.setattr(tolerances, "printed_rows", lambda: printed_rows().loc[["F17-300-a"]])
    monkeypatch.setattr(
        tolerances, "published", lambda name: type(printed[name])(exact, "1", np.nan, 360.0, 5e-6)
    )
    (found,) = tolerances.implied(of)
    at, low, high = found.limits["reference"]
    assert at == pytest.approx(55.0, rel=1e-9)
    assert low < at < high
    assert found.unit == "m/s^2"


def test_one_limit_is_found_from_reliabilities_that_share_it(monkeypatch):
    sizes = {"90rpm-0.1mm": 3.0, "90rpm-0.5mm": 6.0, runs.CENTRAL: 12.0, "300rpm-0.2mm": 30.0}
    of = motions([{(scene, "slider_ay"): size for scene, size in sizes.items()}])
    real = published

    def printed(identifier):
        if not identifier.endswith("-a") or identifier[:3] not in ("F16", "F17"):
            return real(identifier)
        assessed = measures.reliabilities(of, measures.scene_of(identifier), "reference")["acceleration"]
        return replace(real(identifier), value=0.9986501 - tolerances.missing(70.0, assessed), rounding=5e-7)

    monkeypatch.setattr(tolerances, "published", printed)
    monkeypatch.setattr(rows, "published", printed)
    # 0.9986501 for the cap of 0.99865010 costs 2e-9 of what is missing, here 1e-5 or more.
    assert tolerances.one_limit(of, "acceleration") == pytest.approx(70.0, rel=1e-3)
    judged = {row.identifier: row for row in rows.all_rows(of)}
    for identifier in ("F16-01-a", "F16-05-a", "F17-150-a", "F17-300-a"):
        assert judged[identifier].verdict == "reproduced"
        assert "not printed" in judged[identifier].reason


def test_decide_leaves_the_middle_open():
    assert [decide(v, 0.0, 1.0, "").verdict for v in (0.0, 0.5, 1.0)] == [CONTRADICTED, UNDECIDED, SUPPORTED]


def test_the_page_holds_the_figures_and_shows_html_as_text(tmp_path):
    (tmp_path / "figure-1.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0"/></svg>')
    readme = tmp_path / "README.md"
    readme.write_text(
        "# Title & <b>\n\n[to](figure-1.svg) [it](#the-runs)\n\n## The runs\n\n"
        '| a |\n|---|\n| <script>x</script> |\n\n![Fig. 1: "x" < y](figure-1.svg)\n'
    )
    single_page(readme, tmp_path / "report.html")
    html = (tmp_path / "report.html").read_text("utf-8")
    assert "<title>Title &amp; &lt;b&gt;</title>" in html
    assert "<script>" not in html
    assert "&lt;script&gt;" in html
    assert '<figure id="figure-1">' in html
    assert '<path d="M0 0"/>' in html
    assert "<img" not in html
    assert "<td>" in html
    assert 'href="#figure-1"' in html
    assert 'href="#the-runs"' in html
    assert '<h2 id="the-runs">' in html
    assert re.search(r"<figcaption>Fig. 1: &quot;x&quot; &lt; y</figcaption>", html)
