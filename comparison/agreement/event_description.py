"""Description of an instant of the motion: crank cycle and angle, and contact, numbered by corner."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from comparison.tables.channels import CONTACTS, PIN

_ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth")


def describe(
    time: float,
    events: Mapping[str, pd.DataFrame | None],
    *,
    period: float | None,
    scene: Mapping[str, Any] | None,
) -> str:
    """Return "0.0142 s (cycle 1, crank at 13°), during the first contact of the upper left corner".

    Parameters
    ----------
    time
        Since the start, s.
    events
        Label of a model -> its event table. Where the models are in different contacts, both are named.
    period
        Of a crank cycle, s; None: cycle and angle are not reported.
    scene
        The scene mapping, for the crank's angle at the start and its sense of rotation; without it from zero.
    """
    where = f"{time:.4g} s" if abs(time) < 1e4 else f"{time:.15g} s"  # counted from an epoch
    if period is not None:
        cycles = time / period
        start = 0.0 if scene is None else float(scene["mechanism"]["crank_angle_deg"])
        sense = -1.0 if scene is not None and scene["drive"]["speed_rpm"] < 0 else 1.0
        where += f" (cycle {int(cycles) + 1}, crank at {(start + sense * 360 * cycles) % 360:.0f}°)"
    contacts = {label: contact(time, table) for label, table in events.items() if table is not None}
    if not contacts:
        return where
    if len(set(contacts.values())) == 1:
        return f"{where}, {next(iter(contacts.values()))}"
    return f"{where}, " + ", ".join(f"{words} ({label})" for label, words in contacts.items())


def contact(time: float, events: pd.DataFrame) -> str:
    """Describe the contacts at an instant, or the last ones before it, numbered by corner.

    Two corners of one side often touch at one instant: of the last contacts, all that overlap the one that
    ended last are listed.

    Parameters
    ----------
    time
        Of the instant, s.
    events
        One row per contact: ``corner``, ``start`` and ``end`` in s.
    """
    numbered = events.sort_values("start", kind="stable")
    numbered = numbered.assign(count=numbered.groupby("corner").cumcount() + 1)
    begun = numbered[numbered["start"] <= time]
    if begun.empty:
        return "before the first contact"
    current = begun[begun["end"] >= time]
    word = "after" if current.empty else "during"
    if current.empty:
        last = begun["end"].to_numpy().argmax()
        current = begun[begun["end"] >= begun["start"].to_numpy()[last]]
    order = list(CONTACTS)
    named = sorted(zip(current["corner"], current["count"], strict=True), key=lambda one: order.index(one[0]))
    return f"{word} " + " and ".join(
        f"the {_ordinal(count)} contact of the {CONTACTS[place]}{'' if place == PIN else ' corner'}"
        for place, count in named
    )


def _ordinal(count: int) -> str:
    if count <= len(_ORDINALS):
        return _ORDINALS[count - 1]
    ending = {1: "st", 2: "nd", 3: "rd"}.get(count % 10, "th") if count % 100 not in {11, 12, 13} else "th"
    return f"{count}{ending}"
