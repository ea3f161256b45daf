"""The random scenes: shipped ones whose start is moved and of which keys are drawn (``population.toml``)."""

import tomllib
from collections.abc import Mapping
from fnmatch import filter as matching
from functools import cache
from importlib.resources import files
from math import cos, pi, sin, sqrt
from typing import Any

import numpy as np

from comparison.accuracy import uncertainty
from comparison.models import MODELS
from comparison.scene import Scene, load_scene, shipped_scenes
from comparison.scene.keys import flat
from comparison.scene.schema import PARTNERS
from comparison.studies.trust.faults import Fault
from comparison.tables.channels import has_load

DATA: dict[str, Any] = tomllib.loads(
    files("comparison.studies.trust").joinpath("population.toml").read_text("utf-8")
)
LINKAGES: dict[str, Any] = DATA["linkages"]
_shipped = cache(load_scene)


def of_users(number: int) -> bool:
    """Return True if a scene of the population has few keys drawn, as users change them."""
    return number % 2 == 0


def random_scene(number: int, seed: int = DATA["seed"]) -> Scene:
    """Draw one scene of the population; the same one every time."""
    rng, names = np.random.default_rng([seed, number]), scenes_with_clearance()
    change = user_scene if of_users(number) else extreme_scene
    return move_start(change(_shipped(names[number // 2 % len(names)]), rng), DATA["moved"], rng)


@cache
def scenes_with_clearance() -> list[str]:
    """Name the shipped scenes in which a joint has clearance."""
    return [name for name in shipped_scenes() if _shipped(name).loose]


def user_scene(scene: Scene, rng: np.random.Generator) -> Scene:
    """Return a scene with one to a few keys drawn, as a user changes them; each key is equally probable."""
    rules = key_rules(scene, "users")
    count = int(rng.integers(1, DATA["most_keys"] + 1))
    keys = map(str, rng.choice(list(rules), size=count, replace=False))
    return _draw(scene, {key: rules[key] for key in keys}, rng)


def extreme_scene(scene: Scene, rng: np.random.Generator) -> Scene:
    """Return a scene with all keys drawn, up to the extremes."""
    return _draw(scene, key_rules(scene, "extremes"), rng)


def key_rules(scene: Scene, group: str) -> dict[str, Any]:
    """Return the keys that a scene uses, of "users" or "extremes", with the rule to draw each."""
    parts = ["all", *scene.loose]
    if "slider" in parts:
        parts.append(scene.data["contact"]["law"])
    if has_load(scene.data):
        parts.append("load")
    return {key: rule for part in parts for key, rule in DATA[group].get(part, {}).items()}


def _draw(scene: Scene, rules: Mapping[str, Mapping[str, Any]], rng: np.random.Generator) -> Scene:
    state, values = flat(scene.data), dict[str, object]()
    # A start is drawn between the walls of the clearance and the slider that are drawn.
    for key in sorted(rules, key=lambda key: key.startswith("initial.")):
        partners = [partner for partner in PARTNERS if f"{key}.{partner}" in state]
        if partners:
            each = {partner: _value(rng, state, f"{key}.{partner}", rules[key]) for partner in partners}
            values[key] = each
        else:
            state[key] = values[key] = _value(rng, state, key, rules[key])
    return scene.with_values(values)


def _value(rng: np.random.Generator, state: Mapping[str, Any], key: str, rule: Mapping[str, Any]) -> object:
    def log(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(*np.log([low, high]))))

    match dict(rule):
        case {"log": [low, high], **rest}:
            return log(low, high) * (-1.0 if rng.uniform() < rest.get("reversed", 0.0) else 1.0)
        case {"uniform": [low, high]}:
            return float(rng.uniform(low, high))
        case {"times": factor}:
            return state[key] * log(1.0 / factor, factor)
        case {"clearances": share, "length": power}:
            reach = share * state["clearance.slider"] / state["mechanism.slider.length"] ** power
            return float(rng.uniform(-reach, reach))
        case {"choice": values}:
            return rng.choice(values).item()
        case {"other": [first, second]}:
            return first if state[key] == second else second
    raise ValueError(f"population.toml: {key}: {rule}")


def move_start(scene: Scene, share: float, rng: np.random.Generator) -> Scene:
    """Return the scene with its start moved by up to a share of the clearance.

    The slider, uniformly in the disc of offset and angle times its length; where only the crank pin has
    clearance the crank, to either side.
    """
    clearance = scene.data["clearance"]
    if uncertainty.movable(scene) != "slider":
        return uncertainty.move_start(scene, share * clearance["crank_pin"] * rng.uniform(-1.0, 1.0), 0.0)
    shift = share * clearance["slider"] * sqrt(rng.uniform())
    direction = rng.uniform(0.0, 2.0 * pi)
    return uncertainty.move_start(scene, shift * cos(direction), shift * sin(direction))


def random_linkage(number: int, seed: int = LINKAGES["seed"]) -> tuple[Scene, Fault, str]:
    """Draw a linkage up to its first contacts, a fault in one of its numbers, and the model that has it."""
    rng, spec = np.random.default_rng([seed, number]), LINKAGES
    name = spec["scenes"][number % len(spec["scenes"])]
    scene = _shipped(name).with_values({"output.groups": ["accelerations", "joints", "contacts"]})
    if not scene.loose:
        scene = scene.with_values({f"clearance.{rng.choice([*scene.data['pin']])}.size": 1e-4})
    rules = {key: rule for each, rule in spec["all"].items() for key in matching(flat(scene.data), each)}
    scene = _draw(scene, rules | spec["of"].get(name, {}), rng)
    reach, scales = spec["start"], uncertainty.clearance_scales(scene).items()
    scene = uncertainty.shift_start(
        scene, {state: scale * rng.uniform(-reach, reach) for state, scale in scales}
    )
    keys = [key for key in rules if not key.startswith(("drive", "initial", "contact.damping"))]
    key, model = str(rng.choice(keys)), str(rng.choice(MODELS))
    factor = 1.0 + rng.uniform(*spec["fault"]) * rng.choice([-1.0, 1.0])
    fault = Fault(kind="number", name=f"{key} {100 * (factor - 1.0):+.1f} %", key=key, factor=factor)
    end, samples = spec["end"], spec["samples"]
    span = {"output.duration": end, "output.samples": samples, "solver.exudyn.step": end / samples / 10}
    if "speed_rpm" in scene.data["drive"]:
        a_turn = round(samples * scene.period / end)
        span = {"drive.cycles": samples / a_turn, "output.samples_per_cycle": a_turn}
    return scene.with_values(span | {"scene.name": f"{name}-{number}"}), fault, model
