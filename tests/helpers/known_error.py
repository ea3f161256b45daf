"""A model whose error is known: in proportion to its tolerance, beside what the motion makes of its start."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from comparison.execution.run import Outcome
from comparison.scene import load_scene
from comparison.tables.table import Table

USUAL = load_scene("150rpm-0.2mm")
SAMPLES = 1001


def steady(phase):
    """Return a magnification that stays one."""
    return np.ones_like(phase)


def growing(phase):
    """Return a magnification of 1e8 in the second half of the run: nothing can be known there."""
    return np.where(phase < 0.5, 1.0, 1e8)


@dataclass
class KnownError:
    """Runs scenes by the reference's settings; `asked` are the tolerances in the order in which they ran."""

    magnification: Callable[[np.ndarray], np.ndarray] = steady
    """Of both the error of a step and a shift of the start, by share of the run."""
    error: float = 10.0
    """Of slider_x at a magnification of one, over the tolerance."""
    rough: float = np.inf
    """Tolerance above which a run parts from its neighbours in the second half, whatever the motion."""
    fails: Callable[[float], str] = lambda _: ""
    asked: list[float] = field(default_factory=list)

    def __call__(self, scenes):
        return [self._one(scene) for scene in scenes]

    def _one(self, scene):
        tolerance = scene.data["solver"]["reference"]["tolerance"]
        self.asked.append(tolerance)
        if status := self.fails(tolerance):
            return Outcome(status, "as told")
        phase = np.linspace(0.0, 1.0, SAMPLES)
        magnified = self.magnification(phase) * np.where((tolerance > self.rough) & (phase > 0.5), 1e8, 1.0)
        shift = scene.data["initial"]["slider_offset"] - USUAL.data["initial"]["slider_offset"]
        off = (self.error * tolerance * (1.0 + np.sin(7.0 * phase) ** 2) + shift) * magnified
        columns = {"time": phase * scene.duration, "slider_x": exact() + off}
        return Outcome("success", table=Table(pd.DataFrame(columns), provenance={"model": "reference"}))


def exact():
    """Return slider_x without error, m."""
    return -0.55 + 2e-4 * np.sin(2.0 * np.pi * np.linspace(0.0, 1.0, SAMPLES))
