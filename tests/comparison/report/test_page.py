"""The page: complete, honest, safe, small, the same every time. Its layout is asked in tests/browser."""

import re
from collections import Counter
from dataclasses import replace
from html import escape, unescape

import numpy as np
import pandas as pd
from outline import Outline, page, words

from comparison.accuracy.uncertainty import Runs
from comparison.formatting import number, percent, quantity
from comparison.reliability.assessment import ReliabilityComparison, compare_reliability
from comparison.report.page import render
from comparison.scene.schema import Reliability
from comparison.tables.table import Table
from comparison.words.verdicts import reason, round_down


def part(html, start, end):
    html = html[html.index(start) :]
    return html[: html.index(end)]


def text(html):
    """Return what a part of a page says, with plain blanks."""
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


def test_ids_are_unique_every_link_has_its_target_and_nothing_is_fetched(scene, differing):
    others = [replace(scene, name=name) for name in ('a #b"<', "a #b<", "overview")]
    html = page(scene, replace(differing, name="press--plots"), *others)
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
    hostile = "<script>alert('x')</script>"
    broken = replace(scene, title=hostile, verdict="cannot compare", error=hostile, channels={})
    html = render([broken], title=hostile, command=f"sixbar validate '{hostile}'")
    assert html.count("<script>") == 1  # ours
    assert hostile in " ".join(Outline(html).text)


def test_equal_comparisons_give_equal_pages_of_bounded_size(scene):
    # Eleven scenes at both tiers are to be at most 3.5 MB and 15,000 elements; what pages share is in one.
    tiered = replace(scene, tight=replace(scene, tier="tight"))
    one, two = (page(*(replace(tiered, name=f"press{n}") for n in range(count))) for count in (1, 2))
    assert page(replace(tiered, name="press0")) == one
    assert len(one.encode()) + 10 * (len(two.encode()) - len(one.encode())) < 3.5e6
    first, both = (len(Outline(html).elements) for html in (one, two))
    assert first + 10 * (both - first) < 15_000


def test_every_channel_is_in_the_table_or_named(differing):
    html = page(differing)
    table = rows(html, "Channels of scene")
    assert "drive.speed_rpm = 150.0" in html
    (named,) = re.findall(r"Not plotted: (.*?), which were not excited", html, re.DOTALL)
    reasons = text(part(html, "of the channels do", "</details>"))
    for name, channel in differing.channels.items():
        if channel.verdict == "unexcited":
            # It is not agreement: there is no share of it.
            assert name not in table
            assert name in named.split(", ")
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
    a, b = (own["start"][own["corner"] == "ll"].min() for own in scene.events)
    starts = [text(each) for each in (quantity(a, "s", 6), quantity(b, "s", 6), quantity(a - b, "s"))]
    assert rows(html, "First contacts of")["lower left"] == starts
    for cells, matched in zip(rows(html, "Impacts of").values(), scene.impacts.values(), strict=True):
        assert cells[:3] == [str(matched.count_a), str(matched.count_b), str(len(matched.pairs))]
    end = scene.time[-1]
    occurred = {"corner": ["ll", "ul", "ur"], "start": [0.0, end / 4, 0.0]}
    occurred["end"] = [end / 2, end / 2, 2e-5 * end]
    html = page(replace(scene, events=(events.head(3).assign(**occurred), None)))
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
    """Of an acceleration whose error is larger between 100 and 108 degrees."""
    phase = 2 * np.pi * scene.time / 0.4
    bump = 90.0 * ((np.degrees(phase) % 360 > 100) & (np.degrees(phase) % 360 <= 108))

    def runs(error):
        columns = {"slider_y": 0.1 * np.cos(phase), "slider_vy": np.sin(phase), "slider_ay": error}
        return Runs(*[Table(pd.DataFrame({"time": scene.time, **columns}))] * 2)

    settings = Reliability()
    quantities = compare_reliability(
        (runs(15.0 + bump), runs(15.4 + bump)), (runs(0.0),) * 2, 0.4, settings, 2.0
    )
    wide = quantities["displacement"] = replace(quantities["displacement"], numerical=3e-3)
    html = page(replace(scene, reliability=ReliabilityComparison(settings, quantities)))
    acceleration = quantities["acceleration"]
    assert (
        f"± 3.0e-03 (mostly numerics), includes zero and reaches {abs(wide.minimum) + 2e-3:.1e} beyond 0.001"
        in html
    )
    cells = rows(html, 'Reliability of scene press, standard tier"')["acceleration, by default ≤ 150 m/s²"]
    assert cells[0] == f"{'✗' if acceleration.verdict == 'differ' else '✓'} {acceleration.verdict}"
    assert cells[1:4] == [f"{acceleration.a.minimum:.5f}", f"{acceleration.b.minimum:.5f}", "108°"]
    assert cells[4:6] == [number(acceleration.minimum, 2), number(acceleration.half_width, 2)]
    missing = ReliabilityComparison(settings, missing="the model <b>mine</b> refused")
    assert "Not available: the model &lt;b&gt;mine&lt;/b&gt; refused." in page(
        replace(scene, reliability=missing)
    )
