"""The page: the verdict first, complete, honest, safe, small, the same every time."""

import re
import shutil
import subprocess
from collections import Counter
from dataclasses import replace
from errno import ENOSPC
from html import escape, unescape
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from outline import Outline, page, words

from comparison.accuracy.levels import thresholds
from comparison.accuracy.uncertainty import Runs
from comparison.formatting import number, percent
from comparison.reliability.difference import ReliabilityComparison, compare_reliability
from comparison.report import templates, write_report
from comparison.report.page import render
from comparison.scene.schema import Reliability
from comparison.tables.table import Table
from comparison.verdict.channel import compare_channel
from comparison.verdict.compare import scene_verdict
from comparison.verdict.results import Attribution, Confirmation, Refinement, SceneComparison
from comparison.words.cards import card, definition
from comparison.words.differences import attribution_lines, confirmation
from comparison.words.verdicts import reason, scene_reason


def part(html: str, start: str, end: str) -> str:
    html = html[html.index(start) :]
    return html[: html.index(end)]


def text(html: str) -> str:
    """Return what a part of a page says, with plain blanks."""
    return " ".join(unescape(re.sub(r"<[^>]*>", " ", html)).split())


def rows(html: str) -> dict[str, list[str]]:
    """Return the cells of all rows of numbers, by the row's name."""
    found = re.findall(r'<th scope="row"[^>]*>(.*?)</th>(.*?)</tr>', html, re.DOTALL)
    return {
        text(name): [text(cell) for cell in re.findall(r"<td[^>]*>(.*?)</td>", cells, re.DOTALL)]
        for name, cells in found
    }


# ---- first screen


def test_the_verdict_and_the_worst_channel_come_first(
    html: str, scene: SceneComparison, differing: SceneComparison
) -> None:
    shown = words(html)
    assert shown.index("✗ differ Of 2 scenes 1 differs and 1 agrees.") < shown.index("the worst channel")
    figure = part(html, '<div class="worst">', "</figure>")
    worst = differing.decisive
    assert worst is not None
    assert f"<b>{worst.label} (" in figure
    assert f"= {number(worst.ratio, 2)} " in figure
    assert 'href="#s0-standard"' in figure
    assert figure.count("<svg") == 1
    assert "the channel nearest to its limit" in words(page(scene))


def test_the_grid_shows_numbers_leads_to_cards_and_has_the_worst_scene_first(
    scene: SceneComparison, tiered: SceneComparison
) -> None:
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
    assert re.findall(r'<a href="#([^"]+)">(\w+), (\w+) tier', failing) == [("s0-tight", "tiered", "tight")]
    assert 'class="failing"' not in page(scene)
    assert re.findall(r'<details class="scene"( open)?>\s*<summary><b>(\w+)', html) == [
        (" open", "tiered"), ("", "press"),
    ]  # fmt: skip


def test_terms_are_explained_where_they_are_first_seen_and_only_if_they_are_used(
    scene: SceneComparison, tiered: SceneComparison
) -> None:
    terms = part(page(tiered), '<dl class="terms">', "</dl>")
    assert re.findall("<dt>(.*?)</dt>", terms) == ["Tier", "u", "Predictable"]
    assert re.findall("<dt>(.*?)</dt>", part(page(scene), '<dl class="terms">', "</dl>")) == [
        "u",
        "Predictable",
    ]


def test_what_the_models_are_and_where_the_page_comes_from(scene: SceneComparison) -> None:
    origin = templates.Origin(time="2026-01-02 03:04 UTC", code="commit <abc>", machine="a machine")
    shown = words(render([scene], title="Press", command="x", origin=origin))
    assert "reference a hand-written solver of the paper's equations; two degrees of freedom" in shown
    assert "exudyn the same press, written independently as a multibody model in Exudyn" in shown
    assert "2026-01-02 03:04 UTC, commit <abc>" in shown
    assert "a machine" in shown
    assert "UTC" not in words(page(scene))
    assert templates.origin().time.endswith(" UTC")


@pytest.mark.skipif(shutil.which("git") is None, reason="git is not installed")
def test_the_commit_is_that_of_the_tracked_file_and_of_no_other_project(tmp_path: Path) -> None:
    def git(*arguments: str) -> str:
        own = ["-c", "user.name=x", "-c", "user.email=x@example.org"]
        command = ["git", "-C", str(tmp_path), *own, *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()

    file, other = tmp_path / "module.py", tmp_path / "site" / "module.py"
    other.parent.mkdir()
    for path in (file, other):
        path.write_text("x = 1\n")
    assert "commit" not in templates.code_version(file)
    git("init", "-q")
    git("add", "module.py")
    git("commit", "-qm", "first")
    commit = git("rev-parse", "--short=10", "HEAD")
    assert templates.code_version(file).endswith(f"commit {commit}")
    # A package installed inside another project's checkout.
    assert "commit" not in templates.code_version(other)
    file.write_text("x = 2\n")
    assert templates.code_version(file).endswith(f"commit {commit} with modifications")


# ---- the whole page


def test_ids_are_unique_every_link_has_its_target_and_nothing_is_fetched(html: str) -> None:
    outline = Outline(html)
    ids = Counter(attributes["id"] for _, attributes in outline.elements if "id" in attributes)
    assert max(ids.values()) == 1
    targets = set(re.findall(r'(?:url\(#|href="#)([^")]+)', html))
    assert {"s0", "s1", "definition", "all-channels"} <= targets <= set(ids)
    for _, attributes in outline.elements:
        assert not {"src", "onclick", "onload"} & attributes.keys()
        for name in ("href", "xlink:href"):
            assert (attributes.get(name) or "#").startswith("#")
    assert "default-src 'none'" in html
    assert not re.search(r"@import|url\((?!#)", html)


def test_the_navigation_has_no_section_that_is_not_there(
    scene: SceneComparison, broken: SceneComparison
) -> None:
    for comparison, names in (
        (scene, ["Overview", "Plots", "Why", "Channels", "Contacts", "Runs", "Definition", "Reproduce"]),
        (broken, ["Overview", "Why", "Definition", "Reproduce"]),
        (
            replace(scene, events=(None, scene.events[1].iloc[:0])),
            ["Overview", "Plots", "Why", "Channels", "Runs", "Definition", "Reproduce"],
        ),
    ):
        html = page(comparison)
        navigation = re.findall(r'<a href="#([^"]+)">(\w+)</a>', part(html, "<nav", "</nav>"))
        assert [name for _, name in navigation] == names
        assert all(f'id="{target}"' in html for target, _ in navigation)


def test_tables_and_drawings_are_marked_up_for_readers_who_do_not_see_them(html: str) -> None:
    outline = Outline(html)
    headings = [attributes for tag, attributes in outline.elements if tag == "th"]
    assert headings
    assert all(attributes.get("scope") in {"col", "row", "colgroup"} for attributes in headings)
    labels = [a["aria-label"] or "" for _, a in outline.elements if a.get("role") == "img"]
    assert len(labels) == html.count("<figure")
    assert all("Verdict" in label or label.startswith("Schematic of the six-bar press") for label in labels)
    # By word and sign, not by colour alone.
    signs = {"agree": "✓", "differ": "✗", "unexcited": "○", "indeterminate": "?"}
    found = re.findall(r'<td class="verdict (\w+)">(\S) (\w+)</td>', html)
    assert {word for word, _, _ in found} >= {"agree", "differ"}
    assert all(body == word and sign == signs[word] for word, sign, body in found)


def test_what_users_write_is_text(broken: SceneComparison) -> None:
    hostile = "<script>alert('x')</script>"
    html = render([broken], title=hostile, command=f"sixbar validate '{hostile}'")
    assert html.count("<script>") == 1  # ours
    assert hostile in " ".join(Outline(html).text)


def test_equal_comparisons_give_equal_pages_of_bounded_size(
    scene: SceneComparison, tiered: SceneComparison
) -> None:
    html = page(scene)
    assert html == page(scene)
    # Eleven scenes at both tiers are to be at most 3.5 MB and 15,000 elements.
    html = page(*(replace(tiered, name=f"press{n}") for n in range(11)))
    assert len(html.encode()) < 3.5e6
    assert len(Outline(html).elements) < 15_000


def test_a_failed_report_leaves_the_old_one_and_no_litter(
    scene: SceneComparison, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = write_report([scene], tmp_path / "new" / "folder", title="Press", command="sixbar validate")
    assert written == tmp_path / "new" / "folder" / "report.html"
    before = written.read_bytes()

    def disk_full(*_: object) -> None:
        raise OSError(ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "replace", disk_full)
    with pytest.raises(OSError, match="No space"):
        write_report([], written.parent, title="Other", command="")
    assert written.read_bytes() == before
    assert list(written.parent.iterdir()) == [written]


def test_no_scene_at_all_is_not_agreement() -> None:
    assert "cannot compare There is no scene to compare." in words(page())


# ---- a scene


def test_each_tier_has_its_card_reasons_channels_and_runs(tiered: SceneComparison) -> None:
    halved = Refinement("exudyn", {"step": 1e-6}, factor=2.0, order=2.0, observed=1.98)
    tiered = replace(tiered, attribution=replace(tiered.attribution, refinements=(halved,)))
    assert card(tiered).order
    html = page(tiered)
    shown = words(html)
    for tier in tiered.tiers:
        own = text(part(html, f'id="s0-{tier.tier}"', "</article>"))
        for line in (card(tier).sentence, card(tier).order, percent(tier.attribution.explained)):
            assert text(escape(line)) in own
        why = text(part(html, f'id="s0-{tier.tier}-why"', "</ul>"))
        for line in (scene_reason(tier), *attribution_lines(tier)):
            assert text(escape(line)) in why
        table = part(html, f'aria-label="Channels of scene press, {tier.tier} tier"', "</table>")
        excited = [name for name, channel in tier.channels.items() if channel.verdict != "unexcited"]
        assert list(rows(table)) == excited
        assert f'aria-label="Runs of scene press, {tier.tier} tier"' in html
    for line in definition([tiered]):
        assert text(escape(line)) in shown
    run = "exudyn finer two degrees of freedom, dop853 tolerance 1e-09 steps 123,456, rhs 1,523,456 2.34 s"
    assert run in shown
    assert "numpy 2.4.6, Linux-x86_64" in shown
    assert "drive.cycles = 2.0 " in shown
    # One verdict is no two: the page of a single tier says so nowhere.
    assert "tight" not in words(page(replace(tiered, tight=None))).replace("tightest", "")


def test_every_channel_is_in_the_table_plotted_or_named(differing: SceneComparison) -> None:
    html = page(differing)
    table = rows(part(html, 'aria-label="Channels of scene', "</table>"))
    named = re.search(r"Not plotted: (.*?)</p>", html, re.DOTALL)
    assert named is not None
    for name, channel in differing.channels.items():
        if channel.verdict == "unexcited":
            # It is not agreement: there is no share of it.
            assert name not in table
            assert re.search(rf"\b{name}\b.*which were not excited", named[1])
            continue
        verdict, ratio, coverage, explained, worst, threshold, *_ = table[name]
        assert verdict.endswith(channel.verdict)
        assert ratio == number(channel.ratio, 2)
        assert coverage == text(percent(channel.coverage, channel.coverage_error))
        assert explained == text(percent(channel.explained))
        assert worst
        assert threshold
    reasons = text(part(html, "of the channels do", "</details>"))
    for channel in differing.channels.values():
        if channel.verdict not in {"agree", "unexcited"}:
            assert text(escape(reason(channel))) in reasons


def test_how_a_difference_was_confirmed_or_taken_back_stands_beside_its_verdict(
    scene: SceneComparison, differing: SceneComparison
) -> None:
    confirmed = replace(differing, confirmation=Confirmation("confirmed", members=(99, 30)))
    taken_back = replace(
        scene, confirmation=Confirmation("underestimated", members=(99, 30), factor=6.4, clustered=True)
    )
    html = page(confirmed, taken_back)
    shown = words(html)
    for comparison in (confirmed, taken_back):
        assert text(escape(confirmation(comparison))) in shown
    assert "confirmed by at least 30 runs" in part(html, '<table class="grid', "</table>")
    assert "uncertainty underestimated 6.4 times" in part(html, '<table class="grid', "</table>")
    assert html.count('<p class="warning">') == 1  # where a discontinuous event decides


@pytest.mark.parametrize("tight", [False, True])
def test_what_could_not_be_compared_is_the_verdict_and_shown_with_its_reason(
    scene: SceneComparison, broken: SceneComparison, tight: bool
) -> None:
    html = page(replace(scene, tight=replace(broken, tier="tight"))) if tight else page(broken)
    shown = words(html)
    assert "! cannot compare" in shown
    assert "exudyn: slider_vx is nan in row 17" in shown
    tier = "tight" if tight else "standard"
    assert f'id="s0-{tier}-why"' in html
    assert f'id="s0-{tier}-channels"' not in html
    if not tight:
        assert 'class="viewer"' not in html
        assert 'class="static"' not in html


def foreign(scene: SceneComparison, tolerance: float | None) -> SceneComparison:
    """Return the same as from two tables that carry nothing but columns."""

    channels = {
        name: compare_channel(
            channel.definition, scene.time, channel.a, channel.b,
            scene=None, u=(None, None), tolerance=tolerance, limits=thresholds(),
        )
        for name, channel in scene.channels.items()
    }  # fmt: skip
    return replace(
        scene,
        labels=("ours", "theirs"),
        channels=channels,
        verdict=scene_verdict(channels, thresholds().coverage),
        period=None, events=(None, None), provenance={}, scene=None, ran=None, attribution=Attribution(),
    )  # fmt: skip


@pytest.mark.parametrize("tolerance", [1.0, None])
def test_a_page_of_tables_speaks_of_what_was_compared(
    scene: SceneComparison, tolerance: float | None
) -> None:
    html = render([foreign(scene, tolerance)], title="Two tables", command="sixbar compare a b")
    shown = words(html)
    assert "<h1>ours and theirs: two tables</h1>" in html
    assert ("Tolerance of the difference E" in shown) == (tolerance is not None)
    for absent in ("2u", "2 u", "tier", "redict", "hand-written", "Contacts", "Impacts"):
        visible = shown.partition("Definition of the verdict")[0].partition("Scope")[0]
        assert absent not in visible, absent
    assert "reliability" not in shown.lower()


# ---- contacts


def test_contacts_impacts_and_situations_of_both_models_stand_side_by_side(scene: SceneComparison) -> None:
    html = page(scene)
    contacts = rows(part(html, 'aria-label="Contacts of', "</table>"))
    events = scene.events[0]
    assert events is not None
    assert list(contacts) == ["lower left", "lower right", "all"]
    assert int(contacts["lower left"][0]) == (events["corner"] == "ll").sum()
    impacts = rows(part(html, 'aria-label="Impacts of', "</table>"))
    assert list(impacts) == ["all", "predictable part"]
    for cells, found in zip(impacts.values(), scene.impacts.values(), strict=True):
        assert cells[:3] == [str(found.count_a), str(found.count_b), str(len(found.pairs))]
        assert len(cells) == 11
    assert "within 80.0 µs" in text(html)  # of a cycle of 0.4 s

    seconds = scene.time[-1]
    columns = ["corner", "start", "end"]
    occurred = [("ll", 0.0, seconds / 2), ("ul", seconds / 4, seconds / 2), ("ur", 0.0, 2e-5 * seconds)]
    made_up = events.head(3).assign(**pd.DataFrame(occurred, columns=columns))
    html = page(replace(scene, events=(made_up, None)))
    situations = rows(part(html, 'aria-label="Contact situations', "</table>"))
    # Rare is not never; a model without events is not one without contact.
    assert situations == {
        "free": ["50.0 %", "n/a"],
        "one corner": ["25.0 %", "n/a"],
        "two corners of one side": ["25.0 %", "n/a"],
        "two opposite corners": ["0.00200 %", "n/a"],
    }
    assert rows(part(html, 'aria-label="Contacts of', "</table>"))["all"][1] == "n/a"


def test_the_crank_pins_contacts_stand_by_themselves(scene: SceneComparison) -> None:
    seconds = scene.time[-1]
    contacts = scene.events[0].head(3)
    contacts = contacts.assign(corner=["ll", "pin", "pin"], start=[0.0, 0.25 * seconds, 0.75 * seconds])
    contacts = contacts.assign(end=[0.5 * seconds, 0.5 * seconds, seconds])
    for slider in ("clearance", "ideal"):
        joints = {"slider": slider, "crank_pin": "clearance"}
        own = scene.scene | {"joints": joints}
        html = page(replace(scene, events=(contacts, contacts.iloc[:2]), scene=own))
        counts = rows(part(html, 'aria-label="Contacts of', "</table>"))
        assert {name: cells[0] for name, cells in counts.items()} == {
            "lower left": "1", "crank pin": "2", "all": "3",
        }  # fmt: skip
        shares = rows(part(html, 'aria-label="Contact situations', "</table>"))
        assert shares["crank pin in contact"] == ["50.0 %", "25.0 %"]
        # The journal touches while the slider is free: the slider's situations do not see it.
        assert shares.get("free", ["50.0 %"])[0] == "50.0 %"
        assert ("free" in shares) == (slider == "clearance")


def test_no_contact_and_impacts_that_cannot_be_matched_are_said_in_words(scene: SceneComparison) -> None:
    empty = scene.events[0].iloc[:0]
    html = page(replace(scene, events=(empty, empty)))
    assert "None: the event tables are empty." in html
    for lacking in (replace(scene, events=(scene.events[0], None)), replace(scene, period=None)):
        html = page(lacking)
        assert "Impacts cannot be matched" in html
        assert 'aria-label="Impacts of' not in html
    assert "Impacts cannot be matched" not in page(scene)


# ---- reliability, other measures


@pytest.fixture(scope="module")
def judged(scene: SceneComparison) -> SceneComparison:
    """With the reliability of an acceleration whose error is larger between 100 and 108 degrees."""

    def table(error: float, bump: float = 0.0) -> Table:
        phase = 2 * np.pi * scene.time / 0.4
        angle = np.degrees(phase) % 360
        course = error + bump * ((angle > 100) & (angle <= 108))
        columns = {"slider_y": 0.1 * np.cos(phase), "slider_vy": np.sin(phase), "slider_ay": course}
        return Table(pd.DataFrame({"time": scene.time} | columns))

    ideal, first, second = table(0.0), table(15.0, 90.0), table(15.4, 90.0)
    runs, ideals = (Runs(first, first), Runs(second, second)), (Runs(ideal, ideal),) * 2
    quantities = compare_reliability(runs, ideals, 0.4, Reliability(), 2.0)
    return replace(scene, reliability=ReliabilityComparison(Reliability(), quantities))


def test_the_reliability_of_both_models_their_difference_and_its_parts(judged: SceneComparison) -> None:
    html = page(replace(judged, tight=replace(judged, tier="tight")))
    assert judged.reliability is not None
    found = judged.reliability.quantities["acceleration"]
    for tier in ("standard", "tight"):
        table = rows(part(html, f'aria-label="Reliability of scene press, {tier} tier"', "</table>"))
        cells = table["acceleration, ≤ 150 m/s²"]
        assert cells[0] == f"{'✗' if found.verdict == 'differ' else '✓'} {found.verdict}"
        assert cells[1:4] == [f"{found.a.minimum:.5f}", f"{found.b.minimum:.5f}", "108°"]
        assert cells[4] == number(found.minimum, 2)
        assert cells[5] == number(found.half_width, 2)
        assert "0.9986501" in " ".join(table["velocity, ≤ " + list(table)[1].partition("≤ ")[2]])
    shown = words(html)
    assert "no verdict of a scene or a channel depends on them" in shown
    # It is separate from the verdict of the scene, which stays as it was.
    assert "✓ agree" in text(part(html, "<header>", "</header>"))


def test_a_reliability_that_is_not_available_is_escaped_and_without_one_there_is_no_section(
    scene: SceneComparison,
) -> None:
    missing = ReliabilityComparison(Reliability(), missing="the model <b>mine</b> refused")
    assert "Not available: the model &lt;b&gt;mine&lt;/b&gt; refused." in page(
        replace(scene, reliability=missing)
    )
    assert "eliability" not in words(page(scene))


def test_other_measures_are_closed_and_said_to_be_information(scene: SceneComparison) -> None:
    shown = ("slider_x", "corner_ll_normal", "corner_ul_normal")
    html = page(replace(scene, channels={name: scene.channels[name] for name in shown}))
    own = part(html, '<details class="more"><summary>Other measures of similarity', "</details>")
    assert "no verdict depends on them" in own
    # Nothing ever touches the upper left corner.
    assert {name: len(cells) for name, cells in rows(own).items()} == {"slider_x": 15, "corner_ll_normal": 15}
