"""The page: complete, honest, safe, small, the same every time; its drawings show all peaks.

Its layout is tested in tests/browser.
"""

import base64
import json
import re
import zlib
from collections import Counter
from dataclasses import replace
from html import escape, unescape
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from bouncing_press import half_sines, make_scene, stretch
from outline import Outline, page, words

from comparison.accuracy.uncertainty import Runs
from comparison.cli import main
from comparison.formatting import number, percent, quantity
from comparison.reliability.assessment import ReliabilityComparison, compare_reliability
from comparison.report import svg
from comparison.report.figures import channel_figure, picture
from comparison.report.page import render
from comparison.report.pictures.notebook import RunTable
from comparison.report.plots import MOST, scene_lines, scene_plots
from comparison.scene.schema import Reliability
from comparison.tables.table import Table
from comparison.tables.table_files import write
from comparison.words.verdicts import reason, round_down

FORCE = "corner_ll_normal"


@pytest.fixture(scope="module")
def scene():
    """Two crank cycles of a made-up press on which both models agree."""
    return make_scene()


@pytest.fixture(scope="module")
def stiff_scene():
    """The same with the second model's normal forces 3 % too large."""
    return make_scene(
        "stiff", alter=lambda columns: {k: 1.03 * v if "normal" in k else v for k, v in columns.items()}
    )


def part(html, start, end):
    html = html[html.index(start) :]
    return html[: html.index(end)]


def text(html):
    """Return the text of a part of a page, with plain blanks."""
    return " ".join(unescape(re.sub(r"<[^>]*>", " ", html)).split())


def rows(html, label):
    """Return the cells of all rows of the table with that label, by the row's name."""
    return {
        text(name): [text(cell) for cell in re.findall(r"<td[^>]*>(.*?)</td>", cells, re.DOTALL)]
        for name, cells in re.findall(
            r'<th scope="row"[^>]*>(.*?)</th>(.*?)</tr>',
            part(html, f'aria-label="{label}', "</table>"),
            re.DOTALL,
        )
    }


def test_ids_are_unique_every_link_has_its_target_and_nothing_is_fetched(scene, stiff_scene):
    others = [replace(scene, name=name) for name in ('a #b"<', "a #b<", "overview")]
    html = page(scene, replace(stiff_scene, name="press--plots"), *others)
    outline = Outline(html)
    ids = Counter(attributes["id"] for _, attributes in outline.elements if "id" in attributes)
    assert max(ids.values()) == 1
    targets = set(re.findall(r'(?:url\(#|href="#)([^")]+)', html))
    assert {"press", "definition", "all-channels"} <= targets <= set(ids)
    # Nothing that a link would have to escape
    assert all(re.fullmatch(r"[\w.+=-]+", target, re.ASCII) for target in targets)
    for _, attributes in outline.elements:
        assert not {"src", "onclick", "onload"} & attributes.keys()
        assert all((attributes.get(name) or "#").startswith("#") for name in ("href", "xlink:href"))
    assert "default-src 'none'" in html
    assert not re.search(r"@import|url\((?!#)", html)
    assert "cannot compare There is no scene to compare." in words(page())  # which is not agreement


def test_what_users_write_is_text(scene):
    script = "<script>alert('x')</script>"
    failure = replace(scene, title=script, verdict="cannot compare", error=script, channels={})
    html = render([failure], title=script, command=f"sixbar validate '{script}'")
    assert html.count("<script>") == 1  # ours
    assert script in " ".join(Outline(html).text)


def test_equal_comparisons_give_equal_pages_of_bounded_size(scene):
    # Eleven scenes at both tiers are to be at most 3.5 MB and 15,000 elements; `one` has all shared parts.
    pair = replace(scene, tight=replace(scene, tier="tight"))
    one, two = (page(*(replace(pair, name=f"press{n}") for n in range(count))) for count in (1, 2))
    assert page(replace(pair, name="press0")) == one
    assert len(one.encode()) + 10 * (len(two.encode()) - len(one.encode())) < 3.5e6
    first, both = (len(Outline(html).elements) for html in (one, two))
    assert first + 10 * (both - first) < 15_000


def test_every_channel_is_in_the_table_or_named(stiff_scene):
    html = page(stiff_scene)
    table = rows(html, "Channels of scene")
    assert "drive.speed_rpm = 150.0" in html
    (names,) = re.findall(r"Not plotted: (.*?), which were not excited", html, re.DOTALL)
    reasons = text(part(html, "of the channels do", "</details>"))
    for name, channel in stiff_scene.channels.items():
        if channel.verdict == "unexcited":
            # It is not agreement: there is no share of it.
            assert name not in table
            assert name in names.split(", ")
            continue
        verdict, ratio, end, coverage, explained, *_ = table[name]
        assert verdict.endswith(channel.verdict)
        assert ratio == number(channel.ratio, 2)
        assert end.split(" ")[0] == (round_down(channel.until) if channel.until < 0.8 else "0.8")
        assert coverage == text(percent(channel.coverage, channel.coverage_error))
        assert explained == text(percent(channel.explained))
        assert (text(escape(reason(channel))) in reasons) == (channel.verdict != "agree")


def test_contacts_impacts_and_situations_of_both_models_stand_side_by_side(scene):
    html, events = page(scene), scene.events[0]
    assert int(rows(html, "Contacts of")["lower left"][0]) == (events["corner"] == "ll").sum()
    a, b = (contacts["start"][contacts["corner"] == "ll"].min() for contacts in scene.events)
    starts = [text(each) for each in (quantity(a, "s", 6), quantity(b, "s", 6), quantity(a - b, "s"))]
    assert rows(html, "First contacts of")["lower left"] == starts
    for cells, impacts in zip(rows(html, "Impacts of").values(), scene.impacts.values(), strict=True):
        assert cells[:3] == [str(impacts.count_a), str(impacts.count_b), str(len(impacts.pairs))]
    end = scene.time[-1]
    columns = {"corner": ["ll", "ur", "ul"], "start": [end / 2, end / 2, 3 * end / 4]}
    columns["end"] = [2 * end, (0.5 + 2e-5) * end, 2 * end]  # time behind the run does not count
    html = page(replace(scene, events=(events.head(3).assign(**columns), None)))
    # Rare is not never; a model without events is not one without contact.
    assert rows(html, "Contact situations") == {
        "free": ["50.0 %", "n/a"],
        "one corner": ["25.0 %", "n/a"],
        "two corners of one side": ["25.0 %", "n/a"],
        "two opposite corners": ["0.00200 %", "n/a"],
    }
    assert rows(html, "Contacts of")["all"][1] == "n/a"
    assert "Impacts cannot be matched" in html
    empty = events.iloc[:0]
    assert "None: the event tables are empty." in page(replace(scene, events=(empty, empty)))


def test_the_reliability_of_both_models_and_their_difference(scene):
    """The error of the acceleration is larger between 100 and 108 degrees."""
    phase = 2 * np.pi * scene.time / 0.4
    bump = 90.0 * ((np.degrees(phase) % 360 > 100) & (np.degrees(phase) % 360 <= 108))

    def runs(error):
        columns = {"slider_y": 0.1 * np.cos(phase), "slider_vy": np.sin(phase), "slider_ay": error}
        return Runs(*[Table(pd.DataFrame({"time": scene.time, **columns}))] * 2)

    sides, settings = (runs(15.0 + bump), runs(15.4 + bump)), Reliability()
    quantities = compare_reliability(sides, (runs(0.0),) * 2, 0.4, settings, 2.0)
    displacement = quantities["displacement"] = replace(quantities["displacement"], numerical=3e-3)
    html = page(replace(scene, reliability=ReliabilityComparison(settings, quantities)))
    clause = f"includes zero and reaches {abs(displacement.minimum) + 2e-3:.1e} beyond 0.001"
    assert f"± 3.0e-03 (mostly numerics), {clause}" in html
    acceleration = quantities["acceleration"]
    cells = rows(html, 'Reliability of scene press, standard tier"')["acceleration, by default ≤ 150 m/s²"]
    assert cells[0].endswith(acceleration.verdict)
    assert cells[1:4] == [f"{acceleration.a.minimum:.5f}", f"{acceleration.b.minimum:.5f}", "108°"]
    assert cells[4:6] == [number(acceleration.minimum, 2), number(acceleration.half_width, 2)]
    refusal = ReliabilityComparison(settings, missing="the model <b>mine</b> refused")
    sentence = "Not available: the model &lt;b&gt;mine&lt;/b&gt; refused."
    assert sentence in page(replace(scene, reliability=refusal))


def test_a_force_is_drawn_up_to_the_peaks_between_its_samples_wherever_it_is_drawn(scene):
    tables, times = {}, {"time": scene.time}
    for side, (label, events) in enumerate(zip("ab", scene.events, strict=True)):
        pulses = half_sines(scene)[side]
        columns = {
            "row": np.repeat(np.arange(len(pulses)), [pulse.time.size for pulse in pulses]),
            "time": np.concatenate([events["start"][pulse.row] + pulse.time for pulse in pulses]),
            "force": np.concatenate([pulse.force for pulse in pulses]),
        }
        values = {name: (channel.a, channel.b)[side] for name, channel in scene.channels.items()}
        record = {"scene": scene.scene, "model": label}
        tables[label] = RunTable(
            pd.DataFrame(times | values), events, provenance=record, pulses=columns, extrema={}
        )
    peaks = [events[events["corner"] == "ll"]["peak_force"].max() for events in scene.events]
    samples = [table.values(FORCE).max() for table in tables.values()]
    assert all(np.divide(samples, peaks) < 0.98)
    (axes,) = picture(tables, [FORCE]).axes
    maxima = [line.get_ydata().max() for line in axes.get_lines()]
    channel = scene.channels[FORCE]
    pulse_lines = scene_lines(replace(scene, pulses=half_sines(scene)), channel)
    peak_lines = scene_lines(scene, channel)  # peaks, without pulses
    for tops in (maxima, *([each.extremes[1] for each in lines] for lines in (pulse_lines, peak_lines))):
        assert tops == pytest.approx(peaks)
    row = re.search(rf"<td>{FORCE}</td>.*?</tr>", tables["a"]._repr_html_(), re.DOTALL)[0]
    assert f"<td>{number(peaks[0])}</td>" in row
    # Of a range only its samples.
    (axes,) = picture(tables, [FORCE], start=0.0, end=0.01).axes
    assert all(line.get_xdata().max() <= 0.01 for line in axes.get_lines())


def test_a_figure_says_what_is_beyond_and_what_is_not_predictable_in_bounded_space(scene, stiff_scene):
    for comparison, name in product((scene, stiff_scene), ("slider_x", FORCE)):
        channel = comparison.channels[name]
        drawing = channel_figure(comparison, channel, "k")
        crossed = bool(channel.beyond.any())
        assert crossed == (comparison is stiff_scene and name == FORCE)
        assert (">beyond<" in drawing) == crossed == (channel.explained < 1.0)
        # One is in the legend.
        assert (len(re.findall(r"<use [^>]*--outside", drawing)) > 1) == crossed
        assert (">not predictable<" in drawing) == (channel.coverage < 1.0)
    # At most 800 vertices a model and for the threshold and 400 for the difference, 25 bytes each, are 70 kB;
    # 400 stretches of shade in both axes, 300 bytes each, 240 kB.
    assert len(channel_figure(scene, stretch(scene.channels["slider_x"], 200), "k")) < 320e3


def test_a_long_run_keeps_its_peaks_in_bounded_space(scene):
    channel = stretch(scene.channels[FORCE], 40)
    n = channel.time.size
    channel.a[n // 2 + 7] = channel.b[n // 2 + 7] = 1e4  # a contact of one sample, in both models alike
    long_scene = replace(scene, time=channel.time, channels={FORCE: channel})
    head = json.loads(zlib.decompress(base64.b64decode(scene_plots(long_scene))))
    assert len(head["time"]) <= MOST < head["of"] == n
    ((lowest, step), seconds) = head["channels"][0]["grid"], head["start"] + np.array(head["time"])
    values = (lowest + np.cumsum(np.cumsum(head["channels"][0]["steps"]))) * step
    assert values.max() == pytest.approx(1e4)
    assert seconds[values.argmax()] == pytest.approx(channel.time[n // 2 + 7])


def test_an_envelope_keeps_both_ends_and_the_extrema_of_every_column():
    values = np.random.default_rng(1).standard_normal(1000)
    columns, indices = values.reshape(50, 20), svg.envelope(values, 50)
    assert (indices[0], indices[-1]) == (0, 999)
    assert len(indices) <= 2 * 50 + 2
    assert {*columns.min(axis=1), *columns.max(axis=1)} <= {*values[indices]}
    assert values[svg.upper_envelope(values, 50)].tolist() == columns.max(axis=1).tolist()


def test_shades_cover_their_samples_and_are_as_wide_as_a_column():
    mask = np.isin(np.arange(11), [0, 4, 5, 9])
    assert svg.spans(mask, np.arange(11.0), 5) == [(0.0, 1.25), (3.5, 5.5), (8.0, 10.0)]
    assert svg.spans(mask, np.arange(11.0), 4) == [(0.0, 1.5), (3.25, 5.75), (7.75, 10.0)]


@pytest.mark.usefixtures("empty_folder")
def test_a_table_s_name_is_shown_as_it_is(make_table, capsys):
    """In a label a dollar sign begins mathematics; a legend leaves out a name with an underline."""
    write(make_table(), "b.csv")
    for name in ("$\\frac", "_a", "&<i>"):
        write(make_table(), f"{name}.csv")
        assert main(["plot", f"{name}.csv", "b.csv", "--channels", "slider_x", "--out", "p.svg"]) == 0
        assert capsys.readouterr().err == ""
        drawing = Path("p.svg").read_text("utf-8")
        assert f">{escape(name)}</text>" in drawing
        assert all(colour in drawing for colour in (svg.FIRST, svg.SECOND))
