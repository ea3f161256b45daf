"""The page: complete, honest, safe, small, the same every time."""

import re
from collections import Counter
from dataclasses import replace
from html import escape as html_escape
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from comparison.agreement.results import ChannelComparison, Confirmation, SceneComparison
from comparison.formatting import percent
from comparison.report import page as page_module
from comparison.report import svg, write_report
from comparison.report.gallery import figures
from comparison.report.page import render

VOID = {"meta", "link", "br", "img", "hr", "input", "path", "rect", "use"}


class Outline(HTMLParser):
    """Elements in order, with what is open around them; wrong nesting is an error."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.text: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "style" not in self.open and "script" not in self.open:
            self.text.append(data)


def words(html: str) -> str:
    return " ".join(" ".join(Outline(html).text).split())


def page(*scenes: SceneComparison) -> str:
    return render(scenes, title="Press", command="sixbar validate")


@pytest.fixture(scope="module")
def html(scene: SceneComparison, differing: SceneComparison) -> str:
    return page(scene, differing)


def test_the_verdict_comes_first_and_names_every_scene(html: str) -> None:
    text = words(html)
    assert text.index("✗ differ Of 2 scenes 1 differs and 1 agrees.") < text.index("How the verdict is made")
    assert text.index("stiff") < text.index("How the verdict is made")
    assert "not a validation against a machine" in text
    assert "|difference| ≤ 2 u on at least 99% of the predictable samples" in text


def test_the_worst_scene_is_open_and_only_it(html: str) -> None:
    scenes = re.findall(r'<details class="scene"( open)?>\s*<summary><b>(\w+)</b>', html)
    assert scenes == [("", "press"), (" open", "stiff")]


def test_ids_are_unique_and_every_link_has_its_target(html: str) -> None:
    outline = Outline(html)
    ids = Counter(attributes["id"] for _, attributes in outline.elements if "id" in attributes)
    assert max(ids.values()) == 1
    targets = set(re.findall(r'(?:url\(#|href="#)([^")]+)', html))
    assert {"s0", "s1"} <= targets <= set(ids)


def test_nothing_is_fetched_and_nothing_can_run_but_our_own_script(html: str) -> None:
    for _, attributes in Outline(html).elements:
        assert not {"src", "onclick", "onload"} & attributes.keys()
        for name in ("href", "xlink:href"):
            assert (attributes.get(name) or "#").startswith("#")
    assert "default-src 'none'" in html
    assert not re.search(r"@import|url\((?!#)", html)


def test_tables_are_marked_up_for_readers_who_do_not_see_them(html: str) -> None:
    outline = Outline(html)
    headings = [attributes for tag, attributes in outline.elements if tag == "th"]
    assert headings
    assert all(attributes.get("scope") in {"col", "row", "colgroup"} for attributes in headings)
    drawings = [attributes for _, attributes in outline.elements if attributes.get("role") == "img"]
    assert len(drawings) == html.count("<figure>")
    assert all("Verdict" in (attributes["aria-label"] or "") for attributes in drawings)


def test_verdicts_are_told_by_word_and_sign_not_by_colour_alone(html: str) -> None:
    for word, sign, body in re.findall(
        r'<span class="verdict (\w+)"><span aria-hidden="true">(.)</span> ([\w ]+)<', html
    ):
        assert body.startswith(word)
        assert sign == {"agree": "✓", "differ": "✗", "unexcited": "○"}[word]


def test_every_channel_is_in_the_table_and_drawn_or_named_as_not_drawn(scene: SceneComparison) -> None:
    html = page(scene)
    drawn = re.findall(r'<span class="soft">(\w+): largest difference', html)
    left_out = re.findall(r"Not drawn, since [^:]*: ([\w, ]+)\.", html)
    assert len(left_out) == 2  # derived, unexcited
    # drawn[0] is the enlargement.
    assert sorted([*drawn[1:], *", ".join(left_out).split(", ")]) == sorted(scene.channels)
    for name in scene.channels:
        assert f'<th scope="row"><code>{name}</code>' in html


def test_an_unexcited_channel_shows_no_share_of_agreement(scene: SceneComparison) -> None:
    assert scene.channels["corner_ul_normal"].verdict == "unexcited"
    row = re.search(r"<code>corner_ul_normal</code>.*?</tr>", page(scene), re.DOTALL)
    assert row is not None
    assert "unexcited" in row[0]
    assert "%" not in row[0]
    assert "<svg" not in row[0]


def test_what_users_write_is_text(broken: SceneComparison) -> None:
    hostile = "<script>alert('x')</script>"
    html = render([broken], title=hostile, command=f"sixbar validate '{hostile}'")
    assert html.count("<script>") == 1  # ours
    assert hostile in " ".join(Outline(html).text)


def test_a_scene_that_could_not_be_compared_is_shown_with_its_reason(
    scene: SceneComparison, broken: SceneComparison
) -> None:
    html = page(scene, broken)
    text = words(html)
    assert "! cannot compare Of 2 scenes 1 cannot be compared and 1 agrees." in text
    assert "exudyn: slider_vx is nan in row 17" in text
    part = html[html.index('id="s1"') :]
    assert "<figure" not in part
    assert "Channels</h3>" not in part


def test_no_scene_at_all_is_not_agreement() -> None:
    text = words(page())
    assert "cannot compare There is no scene to compare." in text


def foreign(scene: SceneComparison, worst_threshold: float) -> SceneComparison:
    """Return the same as from two tables that carry nothing but columns."""

    def bare(channel: ChannelComparison) -> ChannelComparison:
        n = len(scene.time)
        located = worst_threshold if np.isfinite(worst_threshold) else float("nan")
        return replace(
            channel, u_a=None, u_b=None, u=None, predictable=np.ones(n, dtype=bool), coverage=1.0,
            explained=1.0 if np.isfinite(located) else float("nan"), worst_threshold=located,
            worst_time=0.1 if np.isfinite(located) else float("nan"),
            worst_difference=0.0 if np.isfinite(located) else float("nan"),
        )  # fmt: skip

    channels = {name: bare(channel) for name, channel in scene.channels.items()}
    return replace(scene, channels=channels, period=None, events=(None, None), provenance={}, scene=None)


@pytest.mark.parametrize(("threshold", "name"), [(1e-3, "tolerance"), (float("nan"), "indeterminate")])
def test_foreign_tables_without_uncertainty_events_or_provenance(
    scene: SceneComparison, threshold: float, name: str
) -> None:
    html = page(foreign(scene, threshold))
    text = words(html)
    assert "Tables without a refined run carry no uncertainty" in text
    assert name in text
    assert ">crank turns<" not in html
    assert "Contacts</h3>" not in html
    assert "Contact situations" not in html
    assert "Runs</h3>" not in html


def test_one_model_without_events_is_not_shown_as_without_contacts(scene: SceneComparison) -> None:
    html = page(replace(scene, events=(scene.events[0], None)))
    contacts = html[html.index("Contacts</h3>") : html.index("Runs</h3>")]
    assert '<td class="number">n/a</td>' in contacts
    assert '<td class="number">0</td>' not in contacts


def test_the_worst_sample_stands_on_the_right_side_of_its_threshold(
    scene: SceneComparison, differing: SceneComparison
) -> None:
    for comparison in (scene, differing):
        table, _, _ = page(comparison).partition("Other measures of likeness")
        rows = re.findall(r'<th scope="row"><code>(\w+)</code>(.*?)</tr>', table, re.DOTALL)
        signs = {name: re.findall(r"<small>(&gt;|≤) ", row) for name, row in rows}
        for channel in comparison.channels.values():
            expected = [] if channel.verdict == "unexcited" else ["≤" if channel.explained == 1.0 else "&gt;"]
            assert signs[channel.channel] == expected, channel.channel


def test_no_contact_is_said_in_words(scene: SceneComparison) -> None:
    events = scene.events[0]
    assert events is not None
    html = page(replace(scene, events=(events.iloc[:0], events.iloc[:0])))
    assert "None: the event tables are empty." in html


def test_the_contact_situations_of_both_models_stand_side_by_side(scene: SceneComparison) -> None:
    seconds = scene.time[-1]
    columns = ["corner", "start", "end"]
    rows = [("ll", 0.0, seconds / 2), ("ul", seconds / 4, seconds / 2), ("ur", 0.0, 2e-5 * seconds)]
    told = scene.events[0].head(3).assign(**pd.DataFrame(rows, columns=columns))
    html = page(replace(scene, events=(told, None)))
    part = html[html.index("Contact situations</h3>") : html.index("Runs</h3>")]
    cells = re.findall(
        r'<th scope="row">([^<]*)</th><td class="number">([^<]*)</td><td class="number">', part
    )
    # A rare situation is not rounded to one that never occurs.
    assert dict(cells) == {
        "free": "50.0\u00a0%",
        "one corner": "25.0\u00a0%",
        "two corners of one side": "25.0\u00a0%",
        "two opposite corners": "0.00200\u00a0%",
    }
    assert part.count(">n/a<") == 4


def test_contacts_are_counted_by_corner(scene: SceneComparison) -> None:
    events = scene.events[0]
    assert events is not None
    row = re.search(r'<th scope="row">lower left</th><td class="number">(\d+)</td>', page(scene))
    assert row is not None
    assert int(row[1]) == (events["corner"] == "ll").sum()


def test_runs_show_settings_work_and_versions(html: str) -> None:
    text = words(html)
    run = "exudyn finer two degrees of freedom dop853 tolerance 1e-09 steps 123,456, rhs 1,523,456 2.34 s"
    assert run in text
    assert "numpy 2.4.6, Linux-x86_64" in text
    assert "sixbar validate stiff" in text
    assert "drive.cycles = 2.0 " in text


def test_equal_comparisons_give_equal_pages(scene: SceneComparison) -> None:
    assert page(scene) == page(scene)


def test_a_failed_report_leaves_the_old_one_and_no_litter(
    scene: SceneComparison, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = write_report([scene], tmp_path / "new" / "folder", title="Press", command="sixbar validate")
    assert written == tmp_path / "new" / "folder" / "report.html"
    before = written.read_bytes()

    def disk_full(*_: object) -> None:
        raise OSError("No space left on device")

    monkeypatch.setattr(page_module.Path, "replace", disk_full)
    with pytest.raises(OSError, match="No space"):
        write_report([], written.parent, title="Other", command="")
    assert written.read_bytes() == before
    assert list(written.parent.iterdir()) == [written]


def test_a_scene_is_small(scene: SceneComparison) -> None:
    assert len(page(scene).encode()) < 5e6 / 8  # eight scenes in 5 MB


@pytest.mark.parametrize("times", [50, 100, 500])
def test_a_drawing_of_many_cycles_stays_small(scene: SceneComparison, times: int) -> None:
    n = times * (len(scene.time) - 1) + 1
    channel = scene.channels["slider_x"]
    arrays = {name: np.resize(old, n) for name, old in vars(channel).items() if isinstance(old, np.ndarray)}
    longer = replace(
        scene, time=np.arange(n) * scene.time[1], channels={"slider_x": replace(channel, **arrays)}
    )
    with svg.style():
        drawings = figures(longer, "s0")
    # At most 800 vertices a model and for the threshold, 400 for the difference and 400 stretches of shade in
    # both axes, each some 12 bytes, is 80 kB; 79 kB seen at 100 x 2 cycles. 8 scenes of 15 such are 10 MB.
    assert max(len(drawing.svg) for drawing in drawings) < 85e3


def test_a_run_with_multipliers_shows_how_well_its_constraints_are_met(scene: SceneComparison) -> None:
    run = scene.provenance["reference"] | {"constraints": {"position": 1.25e-13, "position_time_s": 0.36}}
    text = words(page(replace(scene, provenance=scene.provenance | {"reference": run})))
    assert text.count("largest error of the constraints: position 1.25e-13, position_time_s 0.36") == 1
    assert "largest error of the constraints" not in words(page(scene))


def test_the_crank_pins_contacts_stand_beside_the_corners_and_its_share_by_itself(
    scene: SceneComparison,
) -> None:
    seconds = scene.time[-1]
    told = scene.events[0].head(3)
    told = told.assign(corner=["ll", "pin", "pin"], start=[0.0, 0.25 * seconds, 0.75 * seconds])
    told = told.assign(end=[0.5 * seconds, 0.5 * seconds, seconds])
    for slider in ("clearance", "ideal"):
        joints = {"slider": slider, "crank_pin": "clearance"}
        html = page(replace(scene, events=(told, told.iloc[:2]), scene=scene.scene | {"joints": joints}))
        table = html[html.index("Contacts</h3>") : html.index("Impacts</h3>")]
        rows = dict(re.findall(r'<th scope="row">([^<]*)</th><td class="number">(\d+)</td>', table))
        assert rows == {"lower left": "1", "crank pin": "2", "all": "3"}
        part = html[html.index("Contact situations</h3>") : html.index("Runs</h3>")]
        cells = re.findall(
            r'<th scope="row">([^<]*)</th><td class="number">([^<]*)</td><td class="number">([^<]*)</td>',
            part,
        )
        assert ("crank pin in contact", "50.0\u00a0%", "25.0\u00a0%") in cells
        # The journal touches while the slider is free: the slider's situations do not see it.
        assert [row[:2] for row in cells if row[0] == "free"] == (
            [("free", "50.0\u00a0%")] if slider == "clearance" else []
        )
    assert ">crank pin" not in page(replace(scene, events=(told.iloc[:1], None)))


def test_impacts_stand_below_the_contacts_for_all_and_for_the_predictable_part(
    scene: SceneComparison,
) -> None:
    scene = replace(scene, channels={"slider_x": scene.channels["slider_x"]})  # the fewer figures
    html = page(scene)
    part = html[html.index("Impacts</h3>") : html.index("Contact situations</h3>")]
    rows = {
        name: re.findall(r'<td class="number">([^<]*)</td>', cells)
        for name, cells in re.findall(r'<th scope="row">([^<]*)</th>(.*?)</tr>', part, re.DOTALL)
    }
    assert list(rows) == ["all", "predictable part"]
    for row, impacts in zip(rows.values(), scene.impacts.values(), strict=True):
        assert row[:3] == [str(impacts.count_a), str(impacts.count_b), str(len(impacts.pairs))]
        assert len(row) == 11
    assert scene.impacts["predictable"].count_a < scene.impacts["all"].count_a
    assert rows["predictable part"][3].endswith("%")
    # A turn takes 0.4 s.
    assert "within 80.0\u00a0µs" in part


def test_impacts_that_cannot_be_matched_are_said_to_be_so(scene: SceneComparison) -> None:
    said = "Impacts cannot be matched"
    scene = replace(scene, channels={})
    assert said not in page(scene)
    for lacking in (replace(scene, events=(scene.events[0], None)), replace(scene, period=None)):
        html = page(lacking)
        assert said in html
        assert "Impacts</h3>" not in html
    empty = scene.events[0].iloc[:0]
    html = page(replace(scene, events=(empty, empty)))
    assert said not in html
    assert "Impacts</h3>" not in html


def test_other_measures_are_closed_and_said_to_be_information(scene: SceneComparison) -> None:
    shown = ("slider_x", "corner_ll_normal", "corner_ul_normal")
    scene = replace(scene, channels={name: scene.channels[name] for name in shown})
    part = page(scene).partition('<details class="more"><summary>Other measures of likeness')[2]
    part = part.partition("</details>")[0]
    assert "no verdict rests on them" in part
    rows = re.findall(r'<th scope="row"><code>(\w+)</code></th>(.*?)</tr>', part)
    # Nothing ever touches the upper left corner.
    assert [name for name, _ in rows] == ["slider_x", "corner_ll_normal"]
    assert all(cells.count('<td class="number">') == 9 for _, cells in rows)


def part_of_tight(html: str) -> str:
    return html[html.index("<h3>Tight tier</h3>") : html.index("Every number of the scene")]


def test_both_tiers_count_for_the_verdict_of_the_page(
    scene: SceneComparison, tiered: SceneComparison
) -> None:
    html = page(scene, replace(tiered, name="tiered"))
    text = words(html)
    assert tiered.tight is not None
    assert (tiered.verdict, tiered.tight.verdict) == ("agree", "differ")
    assert "✗ differ At the standard tier all 2 agree; at the tight tier the scene press differs." in text
    scenes = re.findall(r'<details class="scene"( open)?>\s*<summary><b>(\w+)</b>(.*?)</summary>', html)
    assert [(opened, name) for opened, name, _ in scenes] == [("", "press"), (" open", "tiered")]
    assert "tight tier" in scenes[1][2]
    assert "differ" in scenes[1][2]
    # One verdict is no two: the page of a single tier says so nowhere.
    assert "tight" not in words(page(scene))


def test_the_overview_has_a_column_for_each_tier_with_what_was_predictable(
    scene: SceneComparison, tiered: SceneComparison
) -> None:
    html = page(tiered, scene)
    overview = html[html.index("<tbody>") : html.index("</tbody>")]
    rows = re.findall(r'<tr>\s*<th scope="row">.*?</th>(.*?)</tr>', overview, re.DOTALL)
    cells = [re.findall(r"<td[^>]*>(.*?)</td>", row, re.DOTALL) for row in rows]
    assert "agree" in cells[0][0]
    assert "differ" in cells[0][1]
    assert cells[1][1] == "not run"
    for cell, tier in zip(cells[0], tiered.tiers, strict=False):
        excited = [c.coverage for c in tier.channels.values() if c.verdict != "unexcited"]
        assert f"predictable {percent(sum(excited) / len(excited))}" in cell
        assert "explained 99.99\u00a0%" in cell  # 0.99996, cut off
    (columns,) = {len(row) for row in cells}
    assert columns == 2 + 5 + 2


def test_the_tight_tier_has_its_reason_attribution_channels_figure_and_runs(tiered: SceneComparison) -> None:
    html = page(tiered)
    assert tiered.tight is not None
    part = part_of_tight(html)
    assert f"<p><b>{html_escape(tiered.tight.reason)}</b></p>" in part
    assert "<li>made up for the tight tier</li>" in part
    assert "<li>made up for the standard tier</li>" in html.replace(part, "")
    for name in tiered.tight.channels:
        assert f'<th scope="row"><code>{name}</code>' in part
    assert part.count("<figure>") == 1
    assert re.search(r'<span class="soft">slider_x: largest difference[^<]*; tight tier<', part)
    assert "; standard tier<" in html.replace(part, "")
    assert "exudyn finer" in part


def test_the_rule_states_the_numbers_of_both_tiers(scene: SceneComparison, tiered: SceneComparison) -> None:
    text = words(page(tiered))
    assert "u ≤ 0.01 (standard tier) or 5e-05 (tight tier) of the channel's scale" in text
    assert "below 50% (standard tier) or 25% (tight tier) the channel is indeterminate" in text
    alone = words(page(scene))
    assert "u ≤ 0.01 of the channel's scale" in alone
    assert "below 50% the channel is indeterminate" in alone


def test_a_tight_tier_that_could_not_be_compared_is_the_verdict(
    scene: SceneComparison, broken: SceneComparison
) -> None:
    html = page(replace(scene, tight=replace(broken, tier="tight")))
    part = part_of_tight(html)
    assert "exudyn: slider_vx is nan in row 17" in part
    assert "<table" not in part
    assert "<figure" not in part
    said = "at the tight tier the scene broken cannot be compared."
    assert f"! cannot compare At the standard tier the scene press agrees; {said}" in words(html)


def test_a_scene_of_two_tiers_is_small(tiered: SceneComparison) -> None:
    assert len(page(tiered).encode()) < 10e6 / 10  # ten scenes in 10 MB


def test_how_a_difference_was_confirmed_or_taken_back_stands_beside_its_verdict(
    scene: SceneComparison, differing: SceneComparison
) -> None:
    confirmed = Confirmation("confirmed", members=(99, 30), sentence="confirmed <b>by</b> 129 runs")
    taken_back = Confirmation(
        "underestimated", members=(99, 30), factor=6.4, clustered=True, sentence="no difference after all"
    )
    html = page(replace(differing, confirmation=confirmed), replace(scene, confirmation=taken_back))
    assert "<p><b>confirmed &lt;b&gt;by&lt;/b&gt; 129 runs</b></p>" in html
    assert '<p class="warning"><b>no difference after all</b></p>' in html
    said = words(html)
    assert f"confirmed <b>by</b> 129 runs. {differing.reason}" in said
    assert "confirmed by at least 30 runs" in said
    assert "uncertainty underestimated 6.4 times" in said
    assert "Of 2 scenes 1 differs and 1 agrees. 1 of these verdicts rests on a corrected uncertainty." in said
    harmless = page(replace(scene, confirmation=replace(taken_back, clustered=False)))
    assert "<p><b>no difference after all</b></p>" in harmless
    assert "Differ is confirmed before it is reported" in words(harmless)
