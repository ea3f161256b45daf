"""Made-up motions of the paper's conditions, whose errors are known."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from comparison.models import MODELS
from comparison.scene import load_scene
from comparison.studies.nonlinear.chaos import Chaos
from comparison.studies.paper import runs
from comparison.studies.paper.study import STUDY
from comparison.tables.table import Table

CYCLES = 12
DENSE, SPARSE = 200, 50
CONFIG = runs.Config(
    samples=DENSE, long_samples=SPARSE, cycles=CYCLES, fewer=CYCLES, members=1, chaos=STUDY.small.chaos
)


def table(period, cycles, per_cycle, y=0.0, x=0.0, vy=0.0, ay=0.0, events=()):
    """A run: the ideal motion y = 0.1 cos, plus errors of shape (cycles * per_cycle + 1,) or numbers."""
    time = np.arange(cycles * per_cycle + 1) * (period / per_cycle)
    angle = 2 * np.pi * time / period
    w = 2 * np.pi / period
    frame = pd.DataFrame(
        {
            "time": time,
            "slider_x": -0.54995 + x + 0 * time,
            "slider_y": 0.112 * np.cos(angle) + y,
            "slider_vx": 0 * time,
            "slider_vy": -0.112 * w * np.sin(angle) + vy,
            "slider_ay": -0.112 * w**2 * np.cos(angle) + ay,
        }
    )
    contacts = pd.DataFrame(events, columns=["start", "peak_force"])
    extrema = {name: {"min": frame[name].min(), "max": frame[name].max()} for name in frame}
    return Table(frame, contacts, extrema)


def motions(changes=None, long=None, angles=(45,), chaos=Chaos.UNDECIDED, shape=np.sin):
    """Runs of all conditions without any error, but for some: (scene, channel) -> sizes of each member's.

    A shape is that of the errors over the cycle; a size may be a series of its own instead. The pin pushes
    its bearing at angles (deg) by turns.
    """
    short, ideal, many = {}, {}, {}
    phase = shape(2 * np.pi * np.arange(2 * DENSE + 1) / DENSE)
    for scene in runs.SCENES:
        period = load_scene(scene).period
        for model in MODELS:
            ideal[scene, model] = table(period, 2, DENSE)
            short[scene, model] = [
                table(
                    period,
                    2,
                    DENSE,
                    **{
                        channel.removeprefix("slider_"): each * phase if np.isscalar(each) else each
                        for (name, channel), each in of.items()
                        if name == scene
                    },
                )
                for of in (changes or [{}])
            ]
            many[scene, model] = table(period, CYCLES, SPARSE, **(long or {}).get(scene, {}))
    time = np.linspace(0.0, 0.8, 2 * DENSE + 1)
    # In the first cycle it pushes elsewhere.
    angle = np.radians(np.where(time < 0.399, 45, np.resize(angles, time.size)))
    push = pd.DataFrame(
        {"time": time, "reaction_A_x": 50 * np.cos(angle), "reaction_A_y": 50 * np.sin(angle)}
    )
    pin = {model: Table(push) for model in MODELS}
    return runs.Runs(CONFIG, short, ideal, many, pin, chaos, {model: [2.0] for model in MODELS})


@pytest.fixture
def made_up():
    """How motions are made up, and how long and dense they are."""
    return SimpleNamespace(motions=motions, table=table, cycles=CYCLES, dense=DENSE, sparse=SPARSE)
