"""What is compared: pairs without a fault, drawn as ``draws.toml`` says; seeded faults; searches."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from math import ceil, cos, pi, sin, sqrt
from typing import Any

import numpy as np

from comparison.accuracy import uncertainty
from comparison.accuracy.levels import TIERS
from comparison.execution.store import Row
from comparison.models import MODELS
from comparison.scene import Scene, load_scene, shipped_scenes
from comparison.studies.detection.faults import RECORDS, Fault, scenes
from comparison.studies.detection.pairs import DETECTED, HALVINGS, Bits, Pair, Search, Side
from comparison.studies.shared.scenes import at_tier, clearance_and_start, leaves, log_uniform

SEED, OWN_SEED = 21112025, 13062025
SHARE = 0.02  # of the clearance, by which a start is moved at most
MOST = 1.25  # draws for each one that is to be decided, at most
MOST_KEYS = 3
# Which model gets the change whose smallest is sought, at which tier.
PLACES = (("reference", "tight"), ("exudyn", "tight"), ("reference", "standard"))
# Model and tier of the tables whose bits are compared.
HASHED = tuple((model, tier) for tier in TIERS for model in MODELS)
_shipped = cache(load_scene)


@dataclass(frozen=True)
class Kind:
    """Comparisons without a fault: of a model with itself, or of both, see ``draws.toml``."""

    label: str
    tier: str
    draws: int
    changed: bool = False
    model: str = ""
    setting: str = ""
    cycles: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Rounding:
    """A variant of rounding: variables of the environment, and whether copies run that are rearranged."""

    name: str
    environment: tuple[tuple[str, str], ...] = ()
    rearranged: bool = False

    def side(self, scene: Scene, model: str) -> Side:
        """Return the side of a model under this variant."""
        return Side(scene, model, f"{model}_rearranged" if self.rearranged else "")


BOTH, OWN = ([Kind(**row) for row in RECORDS[name]] for name in ("both", "own"))
# The first one is what the others are held against.
ROUNDINGS = tuple(
    Rounding(**(row | {"environment": tuple(row.get("environment", {}).items())}))
    for row in RECORDS["rounding"]
)


def own_pairs(kind: Kind) -> list[Pair]:
    """Draw all pairs of a model with itself; the same ones every time."""
    number = [other.label for other in OWN].index(kind.label)
    return [own_pair(kind, np.random.default_rng([OWN_SEED, number, draw])) for draw in range(kind.draws)]


def own_pair(kind: Kind, rng: np.random.Generator) -> Pair:
    """Draw a scene, and a start beside its own with another setting: numerically another run, no more."""
    base, ranges = _shipped("150rpm-0.2mm"), RECORDS["own_ranges"]
    start = clearance_and_start(rng, ranges["clearance"], base.data["mechanism"]["slider"]["length"])
    values: dict[str, object] = {
        **start,
        "drive.speed_rpm": log_uniform(rng, ranges["speed_rpm"]),
        "drive.cycles": round(float(rng.uniform(*kind.cycles)), 3),
        "contact.restitution": float(rng.uniform(*ranges["restitution"])),
        "contact.youngs_modulus": log_uniform(rng, ranges["modulus"]),
        "friction.coefficient": float(rng.uniform(*ranges["friction"])),
    }
    scene = at_tier(base.with_values(values), kind.tier)
    beside = moved(scene, uncertainty.PERTURBATION, rng)
    setting = scene.data["solver"][kind.model][kind.setting] * log_uniform(rng, ranges["factors"])
    other = beside.variant({f"solver.{kind.model}.{kind.setting}": setting})
    return Pair((Side(scene, kind.model), Side(other, kind.model)), kind.tier)


def moved(scene: Scene, share: float, rng: np.random.Generator) -> Scene:
    """Return the scene with its start moved by up to a share of the clearance.

    The slider, uniformly in the disc of offset and angle times its length; where only the crank pin has
    clearance the crank, to either side.
    """
    clearance = scene.data["clearance"]
    if uncertainty.movable(scene) != "slider":
        return uncertainty.moved(scene, share * clearance["crank_pin"] * rng.uniform(-1.0, 1.0), 0.0)
    shift = share * clearance["slider"] * sqrt(rng.uniform())
    direction = rng.uniform(0.0, 2.0 * pi)
    return uncertainty.moved(scene, shift * cos(direction), shift * sin(direction))


def both_pair(kind: Kind, rounding: Rounding, number: int) -> Pair:
    """Draw one comparison of both models under a variant of rounding; the same one every time."""
    place = [kind.label for kind in BOTH].index(kind.label), ROUNDINGS.index(rounding)
    shipped = scenes_with_clearance()
    rng = np.random.default_rng([SEED, *place, number])
    scene = _shipped(shipped[(number + place[1]) % len(shipped)])
    if kind.changed:
        scene = changed(scene, rng)
    scene = at_tier(moved(scene, SHARE, rng), kind.tier)
    sides = tuple(rounding.side(scene, model) for model in MODELS)
    return Pair(sides, kind.tier, environment=rounding.environment)


@cache
def scenes_with_clearance() -> list[str]:
    """Name the shipped scenes in which a joint has clearance."""
    return [name for name in shipped_scenes() if "clearance" in _shipped(name).data["joints"].values()]


def keys(scene: Scene) -> dict[str, Any]:
    """Return the keys that users change, with how each is drawn: not those that the scene does not use."""
    changes, joints = RECORDS["changes"], scene.data["joints"]
    loose = [changes[joint] for joint in ("slider", "crank_pin") if joints[joint] == "clearance"]
    return {key: how for part in (changes["all"], *loose) for key, how in part.items()}


def changed(scene: Scene, rng: np.random.Generator) -> Scene:
    """Return a scene with one to `MOST_KEYS` keys drawn anew, with equal probability each."""
    ways = keys(scene)
    count = int(rng.integers(1, MOST_KEYS + 1))
    chosen = map(str, rng.choice(list(ways), size=count, replace=False))
    return scene.with_values({key: _value(rng, scene.data, key, ways[key]) for key in chosen})


def _value(rng: np.random.Generator, data: Mapping[str, Any], key: str, how: Mapping[str, Any]) -> object:
    before: Any = leaves(data).get(key)
    match dict(how):
        case {"log": bounds, **rest}:
            value = log_uniform(rng, bounds)
            return -value if rest and rng.uniform() < rest["reversed"] else value
        case {"uniform": bounds}:
            return float(rng.uniform(*bounds))
        case {"times": factor}:
            times = log_uniform(rng, (1.0 / factor, factor))
            if before is None:  # a material of each partner
                section, _, name = key.partition(".")
                return {partner: value * times for partner, value in data[section][name].items()}
            return before * times
        case {"clearances": share, "length": power}:
            reach = share * data["clearance"]["slider"] / data["mechanism"]["slider"]["length"] ** power
            return float(rng.uniform(-reach, reach))
        case {"choice": values}:
            return int(rng.choice(values))
        case {"other": [first, second]}:
            return first if before == second else second
    raise ValueError(f"draws.toml: {key}: {how}")


def sample(
    kind: Kind, roundings: Sequence[Rounding], find: Callable[[Sequence[tuple[Rounding, int]]], Sequence[Row]]
) -> dict[Rounding, list[Row]]:
    """Draw until each variant has its equal share of decided comparisons, at most `MOST` times as many.

    ``find`` returns a row for each variant and number that it is asked for.
    """
    wanted = ceil(kind.draws / len(roundings))
    most = ceil(MOST * wanted)
    drawn: dict[Rounding, list[Row]] = {rounding: [] for rounding in roundings}
    while True:
        asked = [
            (rounding, number)
            for rounding, rows in drawn.items()
            for number in range(len(rows), min(most, len(rows) + wanted - decided(rows)))
        ]
        if not asked:
            return drawn
        for (rounding, _), row in zip(asked, find(asked), strict=True):
            drawn[rounding].append(row)


def decided(rows: Sequence[Row]) -> int:
    """Count the comparisons with a verdict: enough of the run is predictable for one."""
    return sum(row["verdict"] != "indeterminate" for row in rows)


def bits(roundings: Sequence[Rounding]) -> list[Bits]:
    """Return what is hashed of the variants, one after the other: of each as many as there are `HASHED`."""
    return [
        Bits((variant.side(scenes(tier)["press"], model),), variant.environment)
        for variant in roundings
        for model, tier in HASHED
    ]


def hashes(roundings: Sequence[Rounding], rows: Sequence[Row]) -> dict[Rounding, tuple[str, ...]]:
    """Return the hashes of each variant from the rows of `bits`; of a run that failed, why."""
    texts = iter([str(row.get("bits", row["reason"])) for row in rows])
    return {variant: tuple(next(texts) for _ in HASHED) for variant in roundings}


def effective(measured: Mapping[Rounding, tuple[str, ...]], tier: str) -> list[Rounding]:
    """Return the variants that give runs of their own at a tier: the first, and each unlike all before it."""
    known: dict[tuple[str, ...], Rounding] = {}
    for rounding, texts in measured.items():
        own = tuple(text for text, place in zip(texts, HASHED, strict=True) if place[1] == tier)
        known.setdefault(own, rounding)
    return list(known.values())


# ---- with a fault


@dataclass(frozen=True)
class Trial:
    """A fault in one model, looked for at one tier."""

    fault: Fault
    model: str
    tier: str

    @property
    def pair(self) -> Pair:
        """The other model as it is, against this one."""
        scene = scenes(self.tier)[self.fault.scene]
        faulty = Side(self.fault.given(scene), self.model, self.fault.engine)
        return Pair((Side(scene, _other(self.model)), faulty), self.tier, self.fault.spoil)

    def detected(self, row: Row) -> bool:
        """Return whether this fault is detected."""
        if self.fault.unexcited:
            return bool(row["channels"].get(self.fault.unexcited, [""])[0] == "unexcited")
        return row["verdict"] in DETECTED


def _other(model: str) -> str:
    return MODELS[1 - MODELS.index(model)]


def trials(faults: Sequence[Fault]) -> list[Trial]:
    """Return where each fault is looked for; a wrong number not in five bodies, which are slow."""
    return [
        Trial(fault, model, tier)
        for fault in faults
        for tier in TIERS
        for model in MODELS
        if model == (fault.model or ("exudyn" if fault.kind == "table" else model))
        and (fault.kind != "number" or tier == "tight" or model == "reference")
        and tier == (fault.tier or tier)
    ]


def controls() -> list[Pair]:
    """Pairs without a fault, of each scene and tier: no detection counts where these differ."""
    return [
        Pair(tuple(Side(scene, model) for model in MODELS), tier)
        for tier in TIERS
        for scene in scenes(tier).values()
    ]


def searches(halvings: int = HALVINGS) -> list[Search]:
    """Return the searches for the smallest change of all numbers: for each one a place."""
    return [
        Search((Side(scene, _other(model)), Side(scene, model)), number["key"], tier, halvings)
        for number in RECORDS["smallest"].values()
        for model, tier in PLACES
        for scene in [scenes(tier)[number["scene"]]]
    ]
