"""The paper's conditions by both models: two turns densely, many turns, the ideal mechanism."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

from comparison.accuracy.tiers import tight
from comparison.execution.run import MODELS, Job, Progress, run_all, successful
from comparison.scene import Scene, load_scene
from comparison.studies.shared.errors import error, second_cycle
from comparison.tables.arrays import Array, BoolArray
from comparison.tables.table import Table

CENTRAL, PIN = "150rpm-0.2mm", "crank-pin"
SLIDER = (CENTRAL, "69GPa", "poisson-0.33", "90rpm-0.1mm", "90rpm-0.5mm", "300rpm-0.2mm")
SCENES = (*SLIDER, PIN)
CHANNELS = ("slider_y", "slider_vy", "slider_ay")

SAMPLES = 10_000
"""A turn, of the two turns: 40 us apart at 150 rpm, where half of the contacts last more than 200 us."""
LONG_SAMPLES = 1000
CYCLES = 100
"""Of the central case, as in Figs. 14 and 15."""
FEWER = 30
"""Of the other cases, which the paper does not follow so long; they take Exudyn 0.8 s each."""
MEMBERS = 4
NUDGE = 1e-6
"""m, of the slider's start from one member to the next: half a per cent of the clearance."""
PIN_NUDGE = 1e-7
"""Degrees of the crank from one member to the next: less than 1e-9 m of the ideal slider."""
TWIN = 1e-9
"""Of the clearance, by which the twin starts elsewhere."""


@dataclass(frozen=True)
class Runs:
    """Tables of all runs.

    Attributes
    ----------
    short
        (scene, model) -> two turns of each member.
    ideal
        (scene, model) -> two turns of the ideal mechanism, of the same times.
    long
        (scene, model) -> many turns of a scene with clearance at the slider.
    twin
        Model -> the central case's many turns from a start close by.
    finer
        Model -> the same from the same start at its closest settings.
    pin
        (scene, model) -> two turns with clearance at the crank pin, with the forces in the joints.
    """

    short: dict[tuple[str, str], list[Table]]
    ideal: dict[tuple[str, str], Table]
    long: dict[tuple[str, str], Table]
    twin: dict[str, Table]
    finer: dict[str, Table]
    pin: dict[tuple[str, str], Table]

    def errors(self, scene: str, model: str, channel: str, member: int = 0) -> Array:
        """Return actual - ideal over the two turns, shape (n,)."""
        return error(self.short[scene, model][member], self.ideal[scene, model], channel)

    def long_errors(self, scene: str, model: str, channel: str) -> Array:
        """Return actual - ideal over many turns, one row a turn, shape (turns, LONG_SAMPLES)."""
        return by_turn(self.long[scene, model], channel) - self.one_turn(scene, model, channel)

    def one_turn(self, scene: str, model: str, channel: str) -> Array:
        """Return the ideal mechanism's turn at the samples of the many, shape (LONG_SAMPLES,)."""
        return self.ideal[scene, model].values(channel)[: SAMPLES : SAMPLES // LONG_SAMPLES]


def by_turn(run: Table, channel: str) -> Array:
    """Return a channel of many turns, one row a turn; the last sample, which starts another, is left out."""
    return run.values(channel)[:-1].reshape(-1, LONG_SAMPLES)


def second(run: Table) -> BoolArray:
    """Return where the two turns are in their second."""
    return second_cycle(run.time, float(run.time[-1]) / 2)


def short_scene(name: str, member: int = 0) -> Scene:
    """Return two turns of a condition, at the models' closest settings."""
    scene = load_scene(
        name,
        {"drive.cycles": 2.0, "output.groups": ["accelerations"], "output.samples_per_cycle": SAMPLES},
    )
    mechanism = scene.data["mechanism"]
    start = (
        ("mechanism.crank_angle_deg", mechanism["crank_angle_deg"] + member * PIN_NUDGE)
        if name == PIN
        else ("initial.slider_offset", mechanism["reference_offset"] + member * NUDGE)
    )
    return _tight(scene.with_values(dict([start])))


def ideal_scene(name: str) -> Scene:
    """Return two turns of the ideal mechanism at the times of a condition.

    Constraints alone move it: Exudyn needs no smaller steps than the samples for 1e-7 m/s and 1e-6 m/s^2.
    """
    scene = load_scene(name)
    return load_scene(
        "ideal",
        {
            "drive.speed_rpm": scene.data["drive"]["speed_rpm"],
            "output.samples_per_cycle": SAMPLES,
            "solver.exudyn.step": scene.period / SAMPLES,
        },
    )


def long_scene(name: str, offset: float = 0.0) -> Scene:
    """Return many turns of a condition, the start moved by ``offset`` (m)."""
    base = load_scene(name).data["mechanism"]["reference_offset"]
    return load_scene(
        name,
        {
            "drive.cycles": float(CYCLES if name == CENTRAL else FEWER),
            "output.groups": [],
            "output.samples_per_cycle": LONG_SAMPLES,
            "initial.slider_offset": base + offset,
            "solver.exudyn.formulation": "tree",
        },
    )


def pin_scene() -> Scene:
    """Return two turns with clearance at the crank pin and the forces in the joints.

    Exudyn's five bodies need the scene's own step: at 1 us they never lift the pin off its bearing in the
    second turn, at 0.25 us it flies for 6 % of the time, with the reference for 4 %.
    """
    return load_scene(
        PIN, {"drive.cycles": 2.0, "output.groups": ["joints"], "output.samples_per_cycle": SAMPLES}
    )


def simulate(n_jobs: int, on_progress: Progress | None) -> Runs:
    """Run everything in one go.

    Raises
    ------
    RunError
        If one of them does not succeed.
    """
    pairs = list(product(SCENES, MODELS))
    apart = TWIN * float(load_scene(CENTRAL).data["clearance"]["slider"])
    members = {
        (scene, model, k): Job(short_scene(scene, k), model) for scene, model in pairs for k in range(MEMBERS)
    }
    ideal = {(scene, model): Job(ideal_scene(scene), model) for scene, model in pairs}
    long = {(scene, model): Job(long_scene(scene), model) for scene, model in product(SLIDER, MODELS)}
    twin = {model: Job(long_scene(CENTRAL, apart), model) for model in MODELS}
    pin = {(PIN, model): Job(pin_scene(), model) for model in MODELS}
    finer = {model: Job(_tight(long_scene(CENTRAL)), model) for model in MODELS}
    jobs = [
        *members.values(),
        *ideal.values(),
        *long.values(),
        *twin.values(),
        *finer.values(),
        *pin.values(),
    ]
    tables = map(successful, run_all(jobs, n_jobs, on_progress), jobs)
    of_members = {key: next(tables) for key in members}
    return Runs(
        {pair: [of_members[*pair, k] for k in range(MEMBERS)] for pair in pairs},
        {key: next(tables) for key in ideal},
        {key: next(tables) for key in long},
        {model: next(tables) for model in twin},
        {model: next(tables) for model in finer},
        {key: next(tables) for key in pin},
    )


def _tight(scene: Scene) -> Scene:
    closest = tight(scene, MODELS)
    if closest is None:
        raise ValueError("the models of this study have a tight tier")
    return closest
