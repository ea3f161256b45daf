"""Models of the campaign that play back what a test wants."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd

from comparison.execution.run import Outcome
from comparison.models import MODELS


class Models:
    """Runs that are sines, see `fake_model.signals`; how many of each model, how much they differ."""

    def __init__(self, make_table):
        self.make, self.asked = make_table, dict.fromkeys(MODELS, 0)
        self.stretch = dict.fromkeys(MODELS, 0.0)
        self.status: dict[str, Outcome] = {}
        self.spoil = {model: (lambda table: table) for model in MODELS}
        self.of_settings = lambda *_: 0.0

    def __call__(self, scene, model):
        self.asked[model] += 1
        if model in self.status:
            return self.status[model]
        solver = scene.data["solver"][model]
        stretch = self.stretch[model] + self.of_settings(model, solver)
        table = self.make(error=10 * solver["tolerance"], stretch=stretch, of=scene)
        # In contact all the time: no sample to begin anew from, which a sine would not know of.
        touching = {"corner": ["ll"], "start": [0.0], "end": [scene.duration], "normal_speed": [0.1]}
        events = pd.DataFrame(touching | {"impulse": [0.1], "peak_force": [1.0], "largest_depth": [1e-6]})
        return Outcome("success", table=self.spoil[model](replace(table, events=events)))
