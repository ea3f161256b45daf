"""Two models whose errors are draws, for the confirmation by ensembles."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from comparison.accuracy.uncertainty import Runs
from comparison.scene import Scene, digest
from comparison.tables.table import Table
from comparison.verdict.compare import compare
from comparison.verdict.confirmation import confirm

MODELS = ("reference", "exudyn")
LOCAL = 1e-6  # of the amplitude: error of a level, from which u follows
COARSE = {"output.samples_per_cycle": 100, "output.groups": []}
ONSET = 0.6  # of the run: where magnified errors begin


EVENTS = pd.DataFrame([{"corner": "ul", "start": 0.01, "end": 0.011, "normal_speed": 0.1, "impulse": 0.02}])
EVENTS = EVENTS.assign(peak_force=40.0, largest_depth=1e-6)


@dataclass
class Fake:
    """Two models whose error after some time is a draw of each start: the truth times 1 + error."""

    signals: Callable[..., dict[str, np.ndarray]]
    scene: Scene
    draw: Callable[[np.random.Generator], float]
    """Relative error, late in the run, of one whose start was moved."""
    bias: tuple[float, float] = (0.0, 0.0)  # of either model, late in the run, whatever the start
    succeed: int | None = None  # number of runs of an ensemble that do; None: all

    def table(self, late_error, error=0.0):
        data = self.scene.data
        samples = round(data["drive"]["cycles"] * data["output"]["samples_per_cycle"]) + 1
        errors = error + np.where(np.arange(samples) >= ONSET * samples, late_error, 0.0)
        return Table(pd.DataFrame(self.signals(self.scene.data, 0.0, errors)), EVENTS)

    def family(self, side, late_error=0.0):
        """Return runs that lie together, by chance or since there are no others."""
        late_error += self.bias[side]
        return Runs(
            self.table(late_error),
            finer=self.table(late_error, LOCAL / 10),
            coarser=self.table(late_error, 10 * LOCAL / 10),
            perturbed=self.table(late_error, LOCAL + 1e-9),
            other_perturbed=self.table(late_error, LOCAL - 1e-9),
            refinement=(10.0, 1.0),
        )

    def run(self, starts, model):
        bias = self.bias[MODELS.index(model)]
        seeds = [int(digest([start.hash, model])[:8], 16) for start in starts]
        tables = [self.table(bias + self.draw(np.random.default_rng(seed))) for seed in seeds]
        return tables[: self.succeed]

    def confirmed(self, b=0.0):
        runs = self.family(0), self.family(1, b)
        before = compare(*runs, scene=self.scene, labels=MODELS)
        return before, confirm(before, runs, scene=self.scene, models=MODELS, run=self.run)


def wide(rng):
    """Errors over four decades: five of them may well lie together."""
    return float(rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(-8.0, -4.0))


def narrow(rng):
    """Errors that the family shows."""
    return float(LOCAL / 10 * rng.standard_normal())
