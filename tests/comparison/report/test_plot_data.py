"""Data of the interactive plots: packed without loss that a reader could see, bounded for long runs."""

import base64
import json
import zlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from half_sines import COUNT, half_sines

from comparison.report import rule
from comparison.report.plot_data import MOST, plot_data
from comparison.verdict.results import SceneComparison


def unpacked(text: str) -> tuple[dict[str, Any], bytes]:
    body = zlib.decompress(base64.b64decode(text))
    length = int.from_bytes(body[:4], "little")
    return json.loads(body[4 : 4 + length]), body[4 + length :]


def columns(head: dict[str, Any], body: bytes) -> dict[str, dict[str, np.ndarray]]:
    """Read value, difference and signed threshold of each channel."""
    n, at, found = head["samples"], 8 * head["samples"] if head.get("uneven") else 0, {}

    def take(stored: int) -> np.ndarray:
        nonlocal at
        planes = np.frombuffer(body[at : at + stored * n], np.uint8).reshape(stored, n)
        at += stored * n
        filled = np.zeros((n, 4), np.uint8)
        filled[:, 4 - stored :] = planes.T
        return filled.view("<f4")[:, 0]

    for channel in head["channels"]:
        found[channel["name"]] = {"a": take(4), "difference": take(2), "limit": take(2)}
    assert at == len(body)
    return found


def test_what_is_packed_is_what_was_compared(scene: SceneComparison) -> None:
    head, body = unpacked(plot_data(scene))
    found = columns(head, body)
    assert head["labels"] == ["reference", "exudyn"]
    for described in head["channels"]:
        channel, packed = scene.channels[described["name"]], found[described["name"]]
        # 24 bits of the value, 8 of difference and threshold; half a unit by rounding.
        reach = np.abs(channel.a - described["offset"]).max()
        np.testing.assert_allclose(packed["a"], channel.a - described["offset"], rtol=0, atol=reach * 2**-24)
        np.testing.assert_allclose(packed["difference"], channel.difference, rtol=2**-8, atol=1e-37)
        threshold, _ = rule.threshold(channel)
        assert threshold is not None
        np.testing.assert_allclose(np.abs(packed["limit"]), threshold, rtol=2**-8)
        np.testing.assert_array_equal(packed["limit"] > 0, channel.predictable)
    drawn = {channel["name"] for channel in head["channels"]}
    assert not any(scene.channels[name].verdict == "unexcited" for name in drawn)
    assert {"slider_x", "slider_ax", "corner_ll_normal"} <= drawn


def test_contacts_are_in_order_of_time_with_their_peaks(scene: SceneComparison) -> None:
    head, _ = unpacked(plot_data(scene))
    for packed, events in zip(head["contacts"], scene.events, strict=True):
        assert events is not None
        assert [start for _, start, _, _ in packed] == pytest.approx(sorted(events["start"]), abs=1e-8)
        assert sorted(peak for *_, peak in packed) == pytest.approx(sorted(events["peak_force"]), rel=5e-4)


def test_resolved_contacts_are_packed_with_their_place_among_the_contacts(scene: SceneComparison) -> None:
    pulses = half_sines(scene)
    first = pulses[0][5:2:-1]  # some, in any order
    head, body = unpacked(plot_data(scene, (first, pulses[1])))
    found = at_end(body, head["pulses"])
    for side, resolved in enumerate((first, pulses[1])):
        events = scene.events[side]
        assert events is not None
        assert head["pulses"][side]["count"] == [COUNT] * len(resolved)
        by_start = {round(events["start"][pulse.row], 8): pulse for pulse in resolved}
        for place, (time, force) in zip(head["pulses"][side]["of"], found[side], strict=True):
            pulse = by_start[head["contacts"][side][place][1]]
            # 16 bits of either, half a unit by rounding; the largest are rounded to six digits.
            np.testing.assert_allclose(time, pulse.time, rtol=0, atol=1e-5 * pulse.time[-1])
            np.testing.assert_allclose(force, pulse.force, rtol=0, atol=1e-5 * pulse.force.max())


def at_end(body: bytes, described: list[dict[str, Any]]) -> list[list[tuple[np.ndarray, np.ndarray]]]:
    """Read times and forces of the resolved contacts of both models, which are the last in the body."""
    found, at = [], len(body) - sum(4 * sum(model["count"]) for model in described)
    for model in described:
        count = sum(model["count"])
        planes = np.frombuffer(body[at : at + 4 * count], np.uint8).reshape(2, 2, count)
        at += 4 * count
        shares = np.split(
            (planes[:, 0] + 256.0 * planes[:, 1]) / 65535, np.cumsum(model["count"])[:-1], axis=1
        )
        found.append(
            [
                (last * time, peak * force)
                for (time, force), last, peak in zip(shares, model["last"], model["peak"], strict=True)
            ]
        )
    return found


def test_the_first_sample_outside_is_marked(differing: SceneComparison) -> None:
    head, _ = unpacked(plot_data(differing))
    marked = {channel["name"]: channel["outside"] for channel in head["channels"]}
    for name, first in marked.items():
        mask = differing.channels[name].beyond
        assert first == ([int(mask.argmax())] if mask.any() else [])
    assert any(marked.values())


def test_a_long_run_keeps_its_peaks_in_bounded_space(scene: SceneComparison) -> None:
    times = 40
    n = times * (len(scene.time) - 1) + 1
    channel = scene.channels["corner_ll_normal"]
    arrays = {name: np.resize(old, n) for name, old in vars(channel).items() if isinstance(old, np.ndarray)}
    arrays["a"][n // 2 + 7] = 1e4  # a contact of one sample
    longer = replace(
        scene, time=np.arange(n) * scene.time[1], channels={channel.channel: replace(channel, **arrays)}
    )
    head, body = unpacked(plot_data(longer))
    assert head["samples"] <= MOST < head["of"] == n
    packed = columns(head, body)["corner_ll_normal"]
    assert packed["a"].max() + head["channels"][0]["offset"] == pytest.approx(1e4)


def test_without_channels_there_are_no_plots(broken: SceneComparison) -> None:
    assert plot_data(broken) == ""
