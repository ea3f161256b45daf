"""Today's sentences under the names of `comparison.words.verdicts`, until that is merged."""

from __future__ import annotations

from collections.abc import Sequence

from comparison.agreement.results import ChannelComparison, SceneComparison
from comparison.report.card import Orders, card
from comparison.report.rule import definition, ratio
from comparison.report.summary import sentence as headline
from comparison.report.text import attribution_words as _attribution_words
from comparison.report.text import shift_line

__all__ = ["Orders", "card", "definition", "headline", "shift_line"]


def reason(channel: ChannelComparison) -> str:
    return channel.reason


def scene_reason(scene: SceneComparison) -> str:
    return ". ".join([*([scene.finer_runs] if scene.refined else []), scene.reason])


def confirmation(scene: SceneComparison) -> str:
    return "" if scene.confirmation is None else scene.confirmation.sentence


def attribution_lines(scene: SceneComparison) -> list[str]:
    return [] if scene.attribution is None else _attribution_words(scene.attribution)


def mark(scene: SceneComparison) -> str:
    return scene.mark


def ratio_name(scenes: Sequence[SceneComparison]) -> str:
    return ratio(scenes)[0]
