"""The page: complete, honest, safe, small, the same every time."""

import re
from collections import Counter
from dataclasses import replace
from errno import ENOSPC
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from outline import Outline, page, words

from comparison.report import page as page_module
from comparison.report import svg, write_report
from comparison.report.gallery import figures
from comparison.report.page import render
from comparison.verdict.results import ChannelComparison, SceneComparison


def test_the_verdict_comes_first_and_names_every_scene(html: str) -> None:
    text = words(html)
    assert text.index("✗ differ Of 2 scenes 1 differs and 1 agrees.") < text.index(
        "Definition of the verdict"
    )
    assert text.index("stiff") < text.index("press") < text.index("Definition of the verdict")
    assert "not a validation against a machine" in text
    assert "|difference| ≤ 2 u on at least 99% of the predictable samples" in text


def test_the_worst_scene_is_open_and_only_it(html: str) -> None:
    scenes = re.findall(r'<details class="scene"( open)?>\s*<summary><b>(\w+)</b>', html)
    assert scenes == [(" open", "stiff"), ("", "press")]


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
    assert len(drawings) == html.count("<figure")
    labels = [attributes["aria-label"] or "" for attributes in drawings]
    assert all("Verdict" in label or label.startswith("Schematic of the six-bar press") for label in labels)
    assert html.count("<caption>") == html.count("<table")


def test_verdicts_are_shown_by_word_and_sign_not_by_colour_alone(html: str) -> None:
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
    part = html[html.index('id="s0"') : html.index('id="s1"')]
    assert '<div class="figures">' not in part
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
    assert ">crank cycles<" not in html
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
        table, _, _ = page(comparison).partition("Other measures of similarity")
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
    contacts = scene.events[0].head(3).assign(**pd.DataFrame(rows, columns=columns))
    html = page(replace(scene, events=(contacts, None)))
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
        raise OSError(ENOSPC, "No space left on device")

    monkeypatch.setattr(page_module.Path, "replace", disk_full)
    with pytest.raises(OSError, match="No space"):
        write_report([], written.parent, title="Other", command="")
    assert written.read_bytes() == before
    assert list(written.parent.iterdir()) == [written]


def test_a_scene_is_small(scene: SceneComparison) -> None:
    assert len(page(scene).encode()) < 0.5e6


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
