"""The overview: scenes by tiers and channels as numbers, the failing ones first and named."""

import re
from dataclasses import replace

import numpy as np
import pytest
from outline import page, words

from comparison.formatting import number, percent
from comparison.report import overview
from comparison.report.page import render
from comparison.verdict.results import SceneComparison


def test_the_ratio_is_at_most_one_exactly_where_a_channel_agrees(
    scene: SceneComparison, differing: SceneComparison, tiered: SceneComparison
) -> None:
    seen = set()
    for tier in (scene, differing, *tiered.tiers):
        for channel in tier.channels.values():
            ratio = channel.ratio
            if channel.verdict in {"agree", "differ"}:
                assert (ratio <= 1.0) == (channel.verdict == "agree"), channel.channel
            else:
                assert np.isnan(ratio)
            seen.add(channel.verdict)
    assert {"agree", "differ", "unexcited"} <= seen


def test_the_ratio_is_what_the_required_share_stays_within(scene: SceneComparison) -> None:
    time = np.arange(200)
    size = np.linspace(0.01, 2.0, 200)  # 1.98 is the 198th of 200, which are 99 %
    channel = replace(
        scene.channels["slider_x"], a=size, b=np.zeros(200), difference=size, u=np.full(200, 0.5),
        predictable=np.ones(200, dtype=bool), time=time, verdict="differ", explained=0.5,
    )  # fmt: skip
    assert channel.ratio == pytest.approx(1.98)
    assert channel.ratio_name == "|E|/2u (99%)"
    # Without a predictable sample the largest uncertainty of all times is what it exceeds, by the same rule.
    blind = replace(
        channel, predictable=np.zeros(200, dtype=bool), explained=np.nan, worst_difference=2.0,
        worst_threshold=0.5,
    )  # fmt: skip
    assert blind.ratio == pytest.approx(1.98 / 0.5)
    assert blind.largest_ratio == 4.0


def rows_of(html: str) -> dict[str, list[str]]:
    table = html[html.index('<table class="grid">') :]
    table = table[: table.index("</table>")]
    found = re.findall(r'<th scope="row"><a href="#\w+">([^<]+)</a></th>(.*?)</tr>', table, re.DOTALL)
    return {name: re.findall(r"<td>(.*?)</td>", cells, re.DOTALL) for name, cells in found}


def test_each_cell_shows_its_numbers_and_leads_to_its_card(
    scene: SceneComparison, tiered: SceneComparison
) -> None:
    html = page(scene, replace(tiered, name="tiered"))
    rows = rows_of(html)
    assert list(rows) == ["tiered", "press"]  # the one that differs first
    assert rows["press"][1] == "not run"
    for cell, tier in zip(rows["tiered"], tiered.tiers, strict=True):
        channel = tier.decisive
        assert channel is not None
        assert f"<b>{number(channel.ratio, 2)}</b>" in cell
        assert percent(tier.coverage) in cell
        assert channel.channel in cell
        (target,) = re.findall(r'href="#([^"]+)"', cell)
        card = html[html.index(f'id="{target}"') :]
        assert tier.verdict in card[: card.index("</h3>")]


def test_what_fails_is_named_at_the_head_and_only_that(
    scene: SceneComparison, tiered: SceneComparison
) -> None:
    html = page(scene, replace(tiered, name="tiered"))
    head = html[: html.index("</header>")]
    assert re.findall(r'<a href="#([^"]+)">(\w+), (\w+) tier', head) == [("s0-tight", "tiered", "tight")]
    assert 'class="failing"' not in page(scene)


def test_a_scene_without_channels_shows_its_verdict_in_place_of_a_number(broken: SceneComparison) -> None:
    (cells,) = rows_of(page(broken)).values()
    assert "<b>cannot compare</b>" in cells[0]
    assert "coverage" not in cells[0]


def test_the_grid_of_channels_holds_every_ratio(tiered: SceneComparison) -> None:
    grid = overview.channel_grid([tiered], ["s0"])
    assert grid["names"] == list(tiered.channels)
    for row, tier in zip(grid["rows"], tiered.tiers, strict=True):
        for name, cell in zip(grid["names"], row["cells"], strict=True):
            ratio = tier.channels[name].ratio
            assert cell["verdict"] == tier.channels[name].verdict
            assert cell["ratio"] == ("" if np.isnan(ratio) else number(ratio, 2))


def test_the_page_says_what_the_models_are_and_with_what_they_ran(scene: SceneComparison) -> None:
    text = words(page(scene))
    assert "reference a hand-written solver of the paper's equations; two degrees of freedom" in text
    assert "exudyn the same press, written independently as a multibody model in Exudyn" in text
    # Another program's table is not described by what it is not.
    foreign = replace(scene, labels=("ours", "theirs"), provenance={})
    assert "hand-written" not in words(render([foreign], title="", command=""))
