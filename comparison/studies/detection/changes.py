"""What users change: a shipped scene with one to three of its keys drawn anew, and its start moved.

Each key is drawn from a range that is plausible for the press; a key that the scene does not use (the
clearance of an ideal joint) is not drawn. A user changes a parameter and validates: this is the population on
which the standard tier's false alarms are counted.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from comparison.scene import Scene
from comparison.studies.shared.scenes import log_uniform

MOST_KEYS = 3
Draw = Callable[[np.random.Generator, Mapping[str, Any]], Any]


def _uniform(low: float, high: float) -> Draw:
    return lambda rng, _: float(rng.uniform(low, high))


def _log(low: float, high: float) -> Draw:
    return lambda rng, _: log_uniform(rng, (low, high))


def _times(key: str, factor: float) -> Draw:
    """Draw between a ``factor``-th of the scene's value and that many times it."""
    section, *rest = key.split(".")

    def draw(rng: np.random.Generator, data: Mapping[str, Any]) -> float:
        value = data[section]
        for name in rest:
            value = value[name]
        return float(value) * log_uniform(rng, (1.0 / factor, factor))

    return draw


def _share(clearance: float, length: float) -> Draw:
    """Draw up to a share of the slider's clearance, over its length to a power."""

    def draw(rng: np.random.Generator, data: Mapping[str, Any]) -> float:
        reach = clearance * data["clearance"]["slider"] / data["mechanism"]["slider"]["length"] ** length
        return float(rng.uniform(-reach, reach))

    return draw


def _speed(rng: np.random.Generator, _: Mapping[str, Any]) -> float:
    return log_uniform(rng, (60.0, 400.0)) * (-1.0 if rng.uniform() < 0.2 else 1.0)


def _other_law(_: np.random.Generator, data: Mapping[str, Any]) -> str:
    return "hertz-corners" if data["contact"]["law"] == "foundation" else "foundation"


BOTH: dict[str, Draw] = {
    "drive.speed_rpm": _speed,
    "drive.cycles": _times("drive.cycles", 1.5),
    "contact.youngs_modulus": _times("contact.youngs_modulus", 3.0),
    "contact.poisson": _uniform(0.2, 0.4),
    "contact.restitution": _uniform(0.5, 0.95),
    "contact.impact_speed_floor": _log(1e-5, 1e-3),
    "friction.coefficient": _uniform(0.0, 0.4),
    "friction.transition_speed": _log(5e-4, 1e-2),
    "environment.gravity": _uniform(-15.0, 15.0),
    "mechanism.crank_angle_deg": _uniform(0.0, 360.0),
    "mechanism.crank.length": _times("mechanism.crank.length", 1.1),
    "mechanism.rod4.length": _times("mechanism.rod4.length", 1.03),
    "mechanism.rod4.mass": _times("mechanism.rod4.mass", 2.0),
    "mechanism.slider.mass": _times("mechanism.slider.mass", 2.0),
    "output.samples_per_cycle": lambda rng, _: int(rng.choice((500, 2000))),
}
"""Keys of every scene with a clearance, and how each is drawn, SI."""
AT_SLIDER: dict[str, Draw] = {
    "clearance.slider": _log(0.05e-3, 0.6e-3),
    "contact.corner_radius": _log(0.3e-3, 3e-3),
    "contact.law": _other_law,
    "mechanism.slider.inertia": _times("mechanism.slider.inertia", 2.0),
    "mechanism.slider.length": _times("mechanism.slider.length", 1.25),
    "initial.slider_offset": _share(0.9, 0.0),
    "initial.slider_angle": _share(0.5, 1.0),
    "initial.slider_vx": _uniform(-0.05, 0.05),
    "initial.slider_omega": _uniform(-1.0, 1.0),
}
"""Keys of a scene with clearance at the slider."""
AT_CRANK_PIN: dict[str, Draw] = {
    "clearance.crank_pin": _log(0.05e-3, 0.4e-3),
    "clearance.journal_radius": _log(5e-3, 20e-3),
}
"""Keys of a scene with clearance at the crank pin."""


def changed(scene: Scene, rng: np.random.Generator) -> Scene:
    """Return a scene with one to `MOST_KEYS` keys drawn anew, with equal probability each."""
    joints = scene.data["joints"]
    keys = BOTH | (AT_SLIDER if joints["slider"] == "clearance" else {})
    keys |= AT_CRANK_PIN if joints["crank_pin"] == "clearance" else {}
    count = int(rng.integers(1, MOST_KEYS + 1))
    chosen = rng.choice(list(keys), size=count, replace=False)
    return scene.with_values({str(key): keys[str(key)](rng, scene.data) for key in chosen})
