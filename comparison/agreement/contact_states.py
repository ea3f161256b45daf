"""Contact situations and the pin's contact of both results of a scene, where they mean something."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeVar

import pandas as pd

from comparison.agreement.results import SceneComparison
from comparison.metrics.contacts import pin_share, time_shares

Shares = Mapping[str, float]
T = TypeVar("T")


def of_scene(scene: SceneComparison) -> tuple[Shares | None, Shares | None]:
    """Return the shares in both results; None without events, without corners, or where a row is a side's."""
    of_corners = scene.scene is None or (
        scene.scene["joints"]["slider"] == "clearance" and scene.scene["contact"]["law"] != "foundation"
    )
    return _of_both(scene, time_shares) if of_corners else (None, None)


def pin_of_scene(scene: SceneComparison) -> tuple[float | None, float | None]:
    """Return the pin's share in both results; None where there are no events, or no clearance at the pin."""
    has_clearance = scene.scene is not None and scene.scene["joints"]["crank_pin"] == "clearance"
    return _of_both(scene, pin_share) if has_clearance else (None, None)


def _of_both(
    scene: SceneComparison, share: Callable[[pd.DataFrame, tuple[float, float]], T]
) -> tuple[T | None, T | None]:
    if not scene.time.size:
        return None, None
    span = float(scene.time[0]), float(scene.time[-1])
    first, second = scene.events
    return (
        None if first is None else share(first, span),
        None if second is None else share(second, span),
    )
