"""The page: impacts, other measures, the crank pin, both tiers, confirmations."""

import re
from dataclasses import replace
from html import escape as html_escape

from outline import page, words

from comparison.verdict.results import Confirmation, SceneComparison


def test_the_crank_pins_contacts_stand_beside_the_corners_and_its_share_by_itself(
    scene: SceneComparison,
) -> None:
    seconds = scene.time[-1]
    contacts = scene.events[0].head(3)
    contacts = contacts.assign(corner=["ll", "pin", "pin"], start=[0.0, 0.25 * seconds, 0.75 * seconds])
    contacts = contacts.assign(end=[0.5 * seconds, 0.5 * seconds, seconds])
    for slider in ("clearance", "ideal"):
        joints = {"slider": slider, "crank_pin": "clearance"}
        html = page(
            replace(scene, events=(contacts, contacts.iloc[:2]), scene=scene.scene | {"joints": joints})
        )
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
    assert ">crank pin" not in page(replace(scene, events=(contacts.iloc[:1], None)))


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
    # A cycle takes 0.4 s.
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
    part = page(scene).partition('<details class="more"><summary>Other measures of similarity')[2]
    part = part.partition("</details>")[0]
    assert "no verdict depends on them" in part
    rows = re.findall(r'<th scope="row"><code>(\w+)</code></th>(.*?)</tr>', part)
    # Nothing ever touches the upper left corner.
    assert [name for name, _ in rows] == ["slider_x", "corner_ll_normal"]
    assert all(cells.count('<td class="number">') == 9 for _, cells in rows)


def part_of_tight(html: str) -> str:
    return html[html.index(">Tight tier</h3>") : html.index("Every number of the scene")]


def test_both_tiers_count_for_the_verdict_of_the_page(
    scene: SceneComparison, tiered: SceneComparison
) -> None:
    html = page(scene, replace(tiered, name="tiered"))
    text = words(html)
    assert tiered.tight is not None
    assert (tiered.verdict, tiered.tight.verdict) == ("agree", "differ")
    assert "✗ differ At the standard tier all 2 agree; at the tight tier the scene press differs." in text
    scenes = re.findall(r'<details class="scene"( open)?>\s*<summary><b>(\w+)</b>(.*?)</summary>', html)
    assert [(opened, name) for opened, name, _ in scenes] == [(" open", "tiered"), ("", "press")]
    assert "tight tier" in scenes[0][2]
    assert "differ" in scenes[0][2]
    # One verdict is no two: the page of a single tier says so nowhere.
    assert "tight" not in words(page(scene))


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
    assert len(page(tiered).encode()) < 6e6 / 10  # ten scenes in 6 MB


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
    assert "confirmed by at least 30 runs" in said
    assert "uncertainty underestimated 6.4 times" in said
    assert "Of 2 scenes 1 differs and 1 agrees. 1 of these verdicts rests on a corrected uncertainty." in said
    harmless = page(replace(scene, confirmation=replace(taken_back, clustered=False)))
    assert "<p><b>no difference after all</b></p>" in harmless
    assert "Differ is confirmed before it is reported" in words(harmless)
