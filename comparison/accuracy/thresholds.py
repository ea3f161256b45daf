"""Thresholds of the verdicts, explained in ``thresholds.toml``."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from importlib.resources import files
from typing import Any


@dataclass(frozen=True)
class Thresholds:
    """Thresholds of a tier, explained in ``thresholds.toml``."""

    k: float
    share: float
    least_judged: int
    least_outside: int
    alpha: float
    coverage: float


def thresholds_record() -> dict[str, Any]:
    """Read ``thresholds.toml``."""
    return tomllib.loads(files("comparison.accuracy").joinpath("thresholds.toml").read_text("utf-8"))


def thresholds(tier: str = "standard") -> Thresholds:
    """Return the numbers of a tier, ``"standard"`` or ``"tight"``."""
    record = thresholds_record()
    common = {name: number for name, number in record.items() if not isinstance(number, dict)}
    return Thresholds(**common, **record[tier])
