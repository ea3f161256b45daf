"""The page: the verdict first, complete, honest, safe, small, the same every time."""

import re
from collections import Counter
from dataclasses import replace
from html import escape, unescape

import numpy as np
import pandas as pd
import pytest
from outline import Outline, page, words

from comparison.accuracy.levels import thresholds
from comparison.accuracy.uncertainty import Runs
from comparison.formatting import number, percent, quantity
from comparison.reliability.assessment import ReliabilityComparison, compare_reliability
from comparison.report.page import anchors, render
from comparison.scene.schema import Reliability
from comparison.tables.table import Table
from comparison.verdict.channel import Criteria, Samples, compare_channel
from comparison.verdict.compare import scene_verdict
from comparison.verdict.results import Attribution, Refinement
from comparison.words.differences import attribution_lines
from comparison.words.verdicts import card, definition, reason


def part(html, start, end):
    html = html[html.index(start) :]
    return html[: html.index(end)]


def text(html):
    """Return what a part of a page says, with plain blanks."""
    return " ".join(unescape(re.sub(r"<[^>]*>", " ", html)).split())


def rows(html, label=""):
    """Return the cells of all rows of numbers, of the table with that label, by the row's name."""
    result = part(html, f'aria-label="{label}', "</table>") if label else html
    return {
        text(name): [text(cell) for cell in re.findall(r"<td[^>]*>(.*?)</td>", cells, re.DOTALL)]
        for name, cells in re.findall(r'<th scope="row"[^>]*>(.*?)</th>(.*?)</tr>', result, re.DOTALL)
    }


# ---- first screen


def test_the_verdict_and_the_worst_channel_come_first(html, scene, differing):
    shown = words(html)
    assert shown.index("✗ differ Of 2 scenes 1 differs and 1 agrees.") < shown.index("the worst channel")
    figure, worst = part(html, '<div class="worst">', "</figure>"), differing.decisive
    assert f"<b>{worst.label} (" in figure
    assert f"= {number(worst.ratio, 2)} " in figure
    assert 'href="#stiff--standard"' in figure
    assert figure.count("<svg") == 1
    assert "the channel nearest to its limit" in words(page(scene))
    assert "cannot compare There is no scene to compare." in words(page())  # which is not agreement


def test_the_grid_shows_numbers_leads_to_cards_and_has_the_worst_scene_first(scene, tiered):
    html = page(scene, replace(tiered, name="tiered"))
    grid = part(html, '<table class="grid', "</table>")
    cells = rows(grid)
    assert list(cells) == ["tiered", "press"]
    assert cells["press"][2] == "not run"
    for n, tier in enumerate(tiered.tiers):
        assert number(tier.decisive.ratio, 2) in cells["tiered"][2 * n]
        assert cells["tiered"][2 * n + 1] == text(percent(tier.coverage))
    for target in re.findall(r'class="cell" href="#([^"]+)"', grid):
        assert part(html, f'id="{target}"', "</h3>")
    failing = part(html, "<header>", "</header>")
    assert re.findall(r'<a href="#([^"]+)">(\w+), (\w+) tier', failing) == [
        ("tiered--tight", "tiered", "tight")
    ]
    opened = re.findall(r'<details class="scene" id="\w+"( open)?>\s*<summary><b>(\w+)', html)
    assert opened == [(" open", "tiered"), ("", "press")]
    # Terms are explained where they are first seen, and only if they are used.
    for comparison, terms in ((tiered, ["Tier", "u", "Predictable"]), (scene, ["u", "Predictable"])):
        assert re.findall("<dt>(.*?)</dt>", part(page(comparison), '<dl class="terms">', "</dl>")) == terms


# ---- the whole page


def test_ids_are_unique_every_link_has_its_target_and_nothing_is_fetched(html, scene, differing):
    odd = page(scene, replace(differing, name="press--plots"), replace(scene, name='a #b"<'))
    assert len(set(re.findall(r'(?<=\sid=")[^"]+', odd))) == len(re.findall(r'\sid="', odd))
    assert set(re.findall(r'href="#([^"]+)', odd)) <= set(re.findall(r'\sid="([^"]+)', odd))
    outline = Outline(html)
    ids = Counter(attributes["id"] for _, attributes in outline.elements if "id" in attributes)
    assert max(ids.values()) == 1
    targets = set(re.findall(r'(?:url\(#|href="#)([^")]+)', html))
    assert {"press", "stiff", "definition", "all-channels"} <= targets <= set(ids)
    for _, attributes in outline.elements:
        assert not {"src", "onclick", "onload"} & attributes.keys()
        assert all((attributes.get(name) or "#").startswith("#") for name in ("href", "xlink:href"))
    assert "default-src 'none'" in html
    assert not re.search(r"@import|url\((?!#)", html)


def test_anchors_are_the_names_of_scenes_valid_and_unique():
    names = ["wedge", "150rpm-0.2mm+x=1", "a b", "a-b", "a--b", "a#b/c", "Ω", "%", "overview", "a b"]
    given = anchors(names)
    assert given[:2] == names[:2]
    assert len(set(given)) == len(names)
    # No hyphen twice, which is between a scene and its part; nothing that a link would have to escape.
    assert all(re.fullmatch(r"[\w.+=]+(-[\w.+=]+)*", anchor, re.ASCII) for anchor in given)
    assert "overview" not in given


def test_what_users_write_is_text(broken):
    hostile = "<script>alert('x')</script>"
    html = render([broken], title=hostile, command=f"sixbar validate '{hostile}'")
    assert html.count("<script>") == 1  # ours
    assert hostile in " ".join(Outline(html).text)


def test_equal_comparisons_give_equal_pages_of_bounded_size(scene, tiered):
    assert page(scene) == page(scene)
    # Eleven scenes at both tiers are to be at most 3.5 MB and 15,000 elements.
    html = page(*(replace(tiered, name=f"press{n}") for n in range(11)))
    assert len(html.encode()) < 3.5e6
    assert len(Outline(html).elements) < 15_000


# ---- a scene


def test_each_tier_has_its_card_reasons_channels_and_runs(tiered):
    finer = Refinement("reference", {"tolerance": 1e-10}, factor=10.0, order=1.0)
    halved = Refinement("exudyn", {"step": 1e-6}, factor=2.0, order=2.0, observed=1.98)
    left = {"a": 1.0, "b": 0.25, "both": 0.2}
    attribution = replace(tiered.attribution, refinements=(finer, halved), remaining=left)
    tiered = replace(tiered, attribution=attribution)
    assert card(tiered).order
    html = page(tiered)
    for tier in tiered.tiers:
        own = text(part(html, f'id="press--{tier.tier}"', "</article>"))
        for line in (card(tier).sentence, card(tier).order, percent(tier.attribution.explained)):
            assert text(escape(line)) in own
        why = text(part(html, f'id="press--{tier.tier}-why"', "</ul>"))
        for line in attribution_lines(tier):
            assert text(escape(line)) in why
        excited = [name for name, channel in tier.channels.items() if channel.verdict != "unexcited"]
        assert list(rows(html, f'Channels of scene press, {tier.tier} tier"')) == excited
        assert f'aria-label="Runs of scene press, {tier.tier} tier"' in html
    refined = rows(html, 'Refinement of scene press, standard tier"')
    assert refined["exudyn"] == ["25.00 %", "25.00 %", "step 1e-06", "2.00"]
    assert [cells[0] for cells in refined.values()] == ["100 %", "25.00 %", "20.00 %"]
    shown = words(html)
    run = "exudyn finer two degrees of freedom, dop853 tolerance 1e-09 steps 123,456, rhs 1,523,456 2.34 s"
    for line in (*definition([tiered]), run, "numpy 2.4.6, Linux-x86_64", "drive.cycles = 2.0 "):
        assert text(escape(line)) in shown
    # One verdict is no two: the page of a single tier says so nowhere.
    assert "tight" not in words(page(replace(tiered, tight=None))).replace("tightest", "")


def test_every_channel_is_in_the_table_plotted_or_named(differing):
    html = page(differing)
    table = rows(html, "Channels of scene")
    (named,) = re.findall(r"Not plotted: (.*?), which were not excited", html, re.DOTALL)
    reasons = text(part(html, "of the channels do", "</details>"))
    for name, channel in differing.channels.items():
        if channel.verdict == "unexcited":
            # It is not agreement: there is no share of it.
            assert name not in table
            assert name in named.split(", ")
            continue
        verdict, ratio, coverage, explained, *_ = table[name]
        assert verdict.endswith(channel.verdict)
        assert ratio == number(channel.ratio, 2)
        assert coverage == text(percent(channel.coverage, channel.coverage_error))
        assert explained == text(percent(channel.explained))
        assert all(table[name][:-1])  # the last one is drawn
        assert (text(escape(reason(channel))) in reasons) == (channel.verdict != "agree")


@pytest.mark.parametrize("tolerance", [1.0, None])
def test_a_page_of_tables_speaks_of_what_was_compared(scene, tolerance):
    """The same from two tables that carry nothing but columns."""
    how = {
        "scene": None,
        "criteria": Criteria(tolerance=tolerance),
        "limits": thresholds(),
    }
    channels = {
        name: compare_channel(channel.definition, Samples(scene.time, channel.a, channel.b), **how)
        for name, channel in scene.channels.items()
    }
    foreign = replace(
        scene, labels=("ours", "theirs"), channels=channels, verdict=scene_verdict(channels, 0.5), ran=None,
        period=None, events=(None, None), provenance={}, scene=None, attribution=Attribution(),
    )  # fmt: skip
    html = render([foreign], title="Two tables", command="sixbar compare a b")
    assert "<h1>ours and theirs: two tables</h1>" in html
    assert ("Tolerance of the difference E" in words(html)) == (tolerance is not None)
    visible = words(html).partition("Definition of the verdict")[0].partition("Scope")[0]
    for absent in ("2u", "2 u", "tier", "redict", "hand-written", "Contacts", "Impacts", "eliability"):
        assert absent not in visible, absent


# ---- contacts


def test_contacts_impacts_and_situations_of_both_models_stand_side_by_side(scene):
    html, events = page(scene), scene.events[0]
    contacts = rows(html, "Contacts of")
    assert list(contacts) == ["lower left", "lower right", "all"]
    own = events[events["corner"] == "ll"]
    assert int(contacts["lower left"][0]) == len(own)
    lasting = quantity(float((own["end"] - own["start"]).median()), "s")
    assert contacts["lower left"][2] == text(lasting)
    impacts = rows(html, "Impacts of")
    assert list(impacts) == ["all", "predictable part"]
    for cells, matched in zip(impacts.values(), scene.impacts.values(), strict=True):
        assert cells[:3] == [str(matched.count_a), str(matched.count_b), str(len(matched.pairs))]
        assert len(cells) == 11
    assert "within 80.0 µs" in text(html)  # of a cycle of 0.4 s
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
    assert 'aria-label="Impacts of' not in html
    empty = events.iloc[:0]
    assert "None: the event tables are empty." in page(replace(scene, events=(empty, empty)))


# ---- reliability, other measures


def test_the_reliability_of_both_models_their_difference_and_its_parts(scene):
    """Of an acceleration whose error is larger between 100 and 108 degrees."""
    phase = 2 * np.pi * scene.time / 0.4
    angle = np.degrees(phase) % 360

    def runs(error, bump=0.0):
        columns = {"slider_y": 0.1 * np.cos(phase), "slider_vy": np.sin(phase)}
        course = error + bump * ((angle > 100) & (angle <= 108))
        table = Table(pd.DataFrame({"time": scene.time, **columns, "slider_ay": course}))
        return Runs(table, table)

    both, settings = (runs(15.0, 90.0), runs(15.4, 90.0)), Reliability()
    quantities = compare_reliability(both, (runs(0.0),) * 2, 0.4, settings, 2.0)
    judged = replace(scene, reliability=ReliabilityComparison(settings, quantities))
    html = page(replace(judged, tight=replace(judged, tier="tight")))
    acceleration = quantities["acceleration"]
    for tier in ("standard", "tight"):
        table = rows(html, f'Reliability of scene press, {tier} tier"')
        cells = table["acceleration, ≤ 150 m/s²"]
        assert cells[0] == f"{'✗' if acceleration.verdict == 'differ' else '✓'} {acceleration.verdict}"
        assert cells[1:4] == [f"{acceleration.a.minimum:.5f}", f"{acceleration.b.minimum:.5f}", "108°"]
        assert cells[4:6] == [number(acceleration.minimum, 2), number(acceleration.half_width, 2)]
        assert "0.9986501" in " ".join(list(table.values())[1])
    missing = ReliabilityComparison(settings, missing="the model <b>mine</b> refused")
    text_of = page(replace(scene, reliability=missing))
    assert "Not available: the model &lt;b&gt;mine&lt;/b&gt; refused." in text_of
