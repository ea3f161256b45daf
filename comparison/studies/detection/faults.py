"""Misses: faults seeded into one model or into its tables, of which the gate must tell every one.

The catalogue is data, ``faults.toml``. A fault is detected where the verdict is "differ", or where
there is none because the tables cannot be compared.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Literal

from comparison.accuracy.levels import TIERS
from comparison.models import MODELS
from comparison.scene import Scene, load_scene
from comparison.studies.detection.copies import Change
from comparison.studies.detection.pairs import Pair
from comparison.studies.detection.tasks import Found, Side
from comparison.studies.shared.scenes import at_tier, leaves

Kind = Literal["number", "code", "table"]
KINDS: tuple[Kind, ...] = ("number", "code", "table")
DETECTED = ("differ", "cannot compare")


@dataclass(frozen=True, kw_only=True)
class Fault(Change):
    """One row of the catalogue: a wrong number or table, or a change of code."""

    kind: Kind
    name: str
    scene: str = "press"
    key: str = ""
    """Of a wrong number: the scene's key."""
    value: float | None = None
    factor: float | None = None
    spoil: str = ""
    """Of a wrong table: see `comparison.studies.detection.tables`."""
    tier: str = ""
    """Of wrong code: the only tier that runs it, where the other one has code of its own."""
    shows: tuple[str, ...] = ()
    """Channels that must be among those that differ at the tight tier."""
    unexcited: str = ""
    """A channel that must be called unexcited instead."""
    missed: str = ""
    """Why it is not detected, where that is so."""

    def given(self, scene: Scene) -> Scene:
        """Return the scene as a model with a wrong number is given it."""
        if self.kind != "number":
            return scene
        return scene.with_values({self.key: self.wrong(scene)})

    def wrong(self, scene: Scene) -> float:
        """Return the wrong number."""
        if self.value is not None:
            return self.value
        return (self.factor or 1.0) * float(leaves(scene.data)[self.key])


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
        other = MODELS[1 - MODELS.index(self.model)]
        faulty = Side(self.fault.given(scene), self.model, self.fault.engine)
        return Pair(scene, Side(scene, other), faulty, self.tier, self.fault.spoil)

    def detected(self, found: Found) -> bool:
        """Return whether this fault is detected."""
        if self.fault.unexcited:
            verdict, _ = found["channels"].get(self.fault.unexcited, ("", 0.0))
            return bool(verdict == "unexcited")
        return found["verdict"] in DETECTED


def catalogue() -> list[Fault]:
    """Read all faults, in the order of the file."""
    record = _record()
    return [
        Fault(kind=kind, **(row | {"shows": tuple(row.get("shows", ()))}))
        for kind in KINDS
        for row in record[kind]
    ]


@cache
def scenes(tier: str) -> dict[str, Scene]:
    """Return the scenes of the catalogue with the settings of a tier."""
    found = _record()["scene"].items()
    return {name: at_tier(load_scene("150rpm-0.2mm", values), tier) for name, values in found}


def controls() -> list[Pair]:
    """Pairs without a fault, of each scene and tier: no detection counts where these differ."""
    return [
        Pair(scene, Side(scene, MODELS[0]), Side(scene, MODELS[1]), tier)
        for tier in TIERS
        for scene in scenes(tier).values()
    ]


def trials(faults: Sequence[Fault]) -> list[Trial]:
    """Where each fault is looked for.

    A wrong number in either model at the tight tier, and in the reference at the standard one: there five
    bodies are slow, and need to run but once if the fault is in the other. Code and tables where they are.
    """
    return [
        Trial(fault, model, tier)
        for fault in faults
        for tier in TIERS
        for model in MODELS
        if model == (fault.model or ("exudyn" if fault.kind == "table" else model))
        and (fault.kind != "number" or tier == "tight" or model == "reference")
        and tier == (fault.tier or tier)
    ]


def _record() -> Mapping[str, Any]:
    return tomllib.loads(files("comparison.studies.detection").joinpath("faults.toml").read_text("utf-8"))
