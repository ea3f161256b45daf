"""The paper's conditions by both models: two cycles densely, many cycles, the ideal mechanism."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice, product

import numpy as np
from numpy.typing import NDArray

from comparison.execution.run import Job, Progress, run_all, successful
from comparison.models import MODELS
from comparison.reliability.difference import ideal_scenes
from comparison.reliability.errors import SliderErrors, slider_errors
from comparison.scene import Scene, load_scene
from comparison.studies.nonlinear import chaos as nonlinear
from comparison.studies.nonlinear.methods import Exponent
from comparison.studies.shared.errors import second_cycle
from comparison.studies.shared.scenes import at_tier
from comparison.studies.shared.study import part
from comparison.tables.arrays import Array, BoolArray
from comparison.tables.table import Table

CENTRAL, PIN = "150rpm-0.2mm", "crank-pin"
SLIDER = (CENTRAL, "69GPa", "poisson-0.33", "90rpm-0.1mm", "90rpm-0.5mm", "300rpm-0.2mm")
SCENES = (*SLIDER, PIN)
CHANNELS = ("slider_y", "slider_vy", "slider_ay")

NUDGE = 1e-6
"""m, of the slider's start from one member to the next: half a per cent of the clearance."""
PIN_NUDGE = 1e-7
"""Degrees of the crank from one member to the next: less than 1e-9 m of the ideal slider."""


@dataclass(frozen=True)
class Config:
    """How much is run."""

    samples: int
    """A cycle, of the two: 40 us apart at 150 rpm, where half of the contacts last more than 200 us."""
    long_samples: int
    """A cycle, of many cycles; divides the former."""
    cycles: int
    """Of the central case, as in Figs. 14 and 15."""
    fewer: int
    """Of the other cases, which the paper does not follow so long; they take Exudyn 0.8 s each."""
    members: int
    """Runs of two cycles that differ by a nudge."""
    chaos: nonlinear.Config
    """What the study nonlinear runs of the central case."""


@dataclass(frozen=True)
class Runs:
    """Tables of all runs."""

    config: Config
    short: dict[tuple[str, str], list[Table]]
    """(scene, model) -> two cycles of each member."""
    ideal: dict[tuple[str, str], Table]
    """(scene, model) -> two cycles of the ideal mechanism, of the same times."""
    long: dict[tuple[str, str], Table]
    """(scene, model) -> many cycles of a scene with clearance at the slider."""
    pin: dict[str, Table]
    """Model -> two cycles with clearance at the crank pin, with the forces in the joints."""
    exponents: dict[nonlinear.Key, Exponent]
    """Lyapunov exponents of the central case, from the study nonlinear."""

    def errors(self, scene: str, model: str, channel: str, member: int = 0) -> Array:
        """Return actual - ideal over the two cycles, shape (n,)."""
        return self.of_two_cycles(scene, model, member).by_channel[channel]

    def of_two_cycles(self, scene: str, model: str, member: int = 0) -> SliderErrors:
        """Return the errors over the two cycles."""
        run = self.short[scene, model][member]
        return slider_errors(run, self.ideal[scene, model], float(run.time[-1]) / 2)

    def by_cycle(self, run: Table, channel: str) -> Array:
        """Return a channel of many cycles, a row each; without the last sample, which starts another."""
        return run.values(channel)[:-1].reshape(-1, self.config.long_samples)

    def long_errors(self, scene: str, model: str, channel: str) -> Array:
        """Return actual - ideal over many cycles, one row a cycle, shape (cycles, long_samples)."""
        samples, every = self.config.samples, self.config.samples // self.config.long_samples
        ideal = self.ideal[scene, model].values(channel)[:samples:every]
        return self.by_cycle(self.long[scene, model], channel) - ideal

    def pin_forces(self, model: str) -> NDArray[np.complex128]:
        """Return the force of the pin on its bearing in the second cycle as x + iy, N, shape (n,)."""
        run = self.pin[model]
        force: NDArray[np.complex128] = run.values("reaction_A_x") + 1j * run.values("reaction_A_y")
        return force[second(run)]


def second(run: Table) -> BoolArray:
    """Return where the two cycles are in their second."""
    return second_cycle(run.time, float(run.time[-1]) / 2)


def short_scene(config: Config, name: str, member: int = 0) -> Scene:
    """Return two cycles of a condition, at the models' tightest settings."""
    scene = _two_cycles(config, name, "accelerations")
    mechanism = scene.data["mechanism"]
    if name == PIN:
        start = {"mechanism.crank_angle_deg": mechanism["crank_angle_deg"] + member * PIN_NUDGE}
    else:
        start = {"initial.slider_offset": mechanism["reference_offset"] + member * NUDGE}
    return at_tier(scene.with_values(start), "tight")


def ideal_scene(config: Config, name: str) -> Scene:
    """Return two cycles of the ideal mechanism at the times of a condition."""
    ideal = ideal_scenes(short_scene(config, name), "reference")["base"]
    return ideal.with_values({"output.samples_per_cycle": config.samples})


def long_scene(config: Config, name: str) -> Scene:
    """Return many cycles of a condition."""
    values = {
        "drive.cycles": float(config.cycles if name == CENTRAL else config.fewer),
        "output.groups": [],
        "output.samples_per_cycle": config.long_samples,
        "initial.slider_offset": load_scene(name).data["mechanism"]["reference_offset"],
        "solver.exudyn.formulation": "tree",
    }
    return load_scene(name, values)


def simulate(config: Config, n_jobs: int, on_progress: Progress | None) -> Runs:
    """Run everything in one go.

    Raises
    ------
    RunError
        If one of them does not succeed.
    """
    pairs, count = list(product(SCENES, MODELS)), config.members
    # With clearance at the pin Exudyn, full (five bodies), needs the scene's own step: at 1 us it never lifts
    # the pin off its bearing in the second cycle, at 0.25 us it flies for 6 % of the time, with the reference
    # for 4 %.
    pin = _two_cycles(config, PIN, "joints")
    jobs = [
        *(Job(short_scene(config, scene, k), model) for scene, model in pairs for k in range(count)),
        *(Job(ideal_scene(config, scene), model) for scene, model in pairs),
        *(Job(long_scene(config, scene), model) for scene, model in product(SLIDER, MODELS)),
        *(Job(pin, model) for model in MODELS),
    ]
    chaos = nonlinear.measure(config.chaos, n_jobs, part(on_progress, 0.0, 0.5))
    tables = map(successful, run_all(jobs, n_jobs, part(on_progress, 0.5, 1.0)), jobs)
    return Runs(
        config,
        {pair: list(islice(tables, count)) for pair in pairs},
        dict(zip(pairs, islice(tables, len(pairs)), strict=True)),
        dict(zip(product(SLIDER, MODELS), islice(tables, len(SLIDER) * len(MODELS)), strict=True)),
        dict(zip(MODELS, tables, strict=True)),
        chaos.best,
    )


def _two_cycles(config: Config, name: str, group: str) -> Scene:
    values = {"drive.cycles": 2.0, "output.groups": [group], "output.samples_per_cycle": config.samples}
    return load_scene(name, values)
