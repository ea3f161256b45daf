"""Seeded faults, from ``faults.toml``: wrong numbers, copies of a model with wrong code, spoiled tables."""

import os
import sys
import tomllib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from importlib import invalidate_caches
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from shutil import copytree, ignore_patterns
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd

from comparison.accuracy.levels import TIERS
from comparison.accuracy.uncertainty import Runs
from comparison.models import GROUP, MODELS, OURS, load
from comparison.scene import Scene, load_scene
from comparison.scene.keys import flat
from comparison.studies.shared.scenes import at_tier
from comparison.tables.table import Table

RECORDS: dict[str, Any] = tomllib.loads(
    files("comparison.studies.trust").joinpath("faults.toml").read_text("utf-8")
)
KINDS = {"number": "parameters", "code": "code", "table": "tables"}
"""Kind of a fault in the catalogue -> its place in the words of the page."""
DELAY = 1e-4  # s, a quarter of the usual sample


@dataclass(frozen=True, kw_only=True)
class Fault:
    """One entry of the catalogue."""

    kind: str  # one of `KINDS`
    name: str
    scene: str = "press"
    key: str = ""  # of a wrong number, which is ``value``, or ``factor`` times the right one
    value: float | None = None
    factor: float = 1.0
    model: str = ""  # of wrong code: in its ``file``, ``new`` for ``old``, as a model of its own, ``engine``
    engine: str = ""
    file: str = ""
    old: str = ""
    new: str = ""
    tier: str = ""  # the only tier that runs this code, where the other one has code of its own
    spoil: str = ""  # of a wrong table: one of `SPOILS`
    shows: tuple[str, ...] = ()  # channels that must be among those that differ at the tight tier
    unexcited: str = ""  # a channel that must be called unexcited instead
    missed: str = ""  # why it is not detected, where that is so

    def faulty_scene(self, scene: Scene) -> Scene:
        """Return a scene as the faulty model runs it."""
        if self.kind != "number":
            return scene
        value = self.factor * flat(scene.data)[self.key] if self.value is None else self.value
        return scene.with_values({self.key: value})

    @property
    def places(self) -> list[tuple[str, str]]:
        """Models and tiers in which it is looked for; numbers not in five bodies, as these are slow."""
        only = self.model or ("exudyn" if self.kind == "table" else "")
        return [
            (model, tier)
            for tier in ([self.tier] if self.tier else TIERS)
            for model in ([only] if only else MODELS)
            if self.kind != "number" or (model, tier) != ("exudyn", "standard")
        ]


def catalogue(*kinds: str) -> list[Fault]:
    """Return the faults, only those of some `KINDS` if asked, in the order of the file."""
    return [
        Fault(kind=kind, **(row | {"shows": tuple(row.get("shows", ()))}))
        for kind in kinds or KINDS
        for row in RECORDS[kind]
    ]


@cache
def scenes(tier: str) -> dict[str, Scene]:
    """Return the scenes of the catalogue with the settings of a tier."""
    values = RECORDS["scene"].items()
    return {name: at_tier(load_scene("150rpm-0.2mm", changes), tier) for name, changes in values}


# ---- wrong code


class CatalogueError(ValueError):
    """A change that does not fit the sources as they are now."""


def faulty_source(fault: Fault) -> str:
    """Return the text of a faulty source file; refuse a place that has moved on."""
    text = (package(fault.model) / fault.file).read_text("utf-8")
    if (count := text.count(fault.old)) != 1:
        raise CatalogueError(
            f"{fault.engine}: {fault.old!r} is {count} times in {fault.file} of the {fault.model} model"
        )
    return text.replace(fault.old, fault.new)


def package(module: str) -> Path:
    """Return the folder of a package, also of one of our models by the model's name."""
    spec = find_spec(OURS[module].module if module in OURS else module)
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).parent


@contextmanager
def install_copies(faults: Sequence[Fault]) -> Iterator[None]:
    """Install a copy of a model for each fault in its code, for this process and the workers it starts.

    A copy is the package under another name, registered as any package with a model is.
    """
    with TemporaryDirectory(prefix="sixbar-") as folder:
        for fault in faults:
            source, name = package(fault.model), fault.engine
            copytree(source, Path(folder, name), ignore=ignore_patterns("__pycache__"))
            Path(folder, name, fault.file).write_text(faulty_source(fault), "utf-8")
            for path in Path(folder, name).rglob("*.py"):
                path.write_text(path.read_text("utf-8").replace(source.name, name), "utf-8")
            record = Path(folder, f"{name}-1.dist-info")
            record.mkdir()
            (record / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1\n", "utf-8")
            (record / "entry_points.txt").write_text(f"[{GROUP}]\n{name} = {name}:simulate\n", "utf-8")
        sys.path.insert(0, folder)
        invalidate_caches()
        try:
            yield
        finally:
            sys.path.remove(folder)
            invalidate_caches()


def load_copy(engine: str) -> None:
    """Import a copy so that its compiled kernels are kept beside it, and vanish with it."""
    before = os.environ.get("NUMBA_CACHE_DIR")
    os.environ["NUMBA_CACHE_DIR"] = str(package(engine).parent)
    try:
        load(engine)
    finally:
        del os.environ["NUMBA_CACHE_DIR"]
        if before is not None:
            os.environ["NUMBA_CACHE_DIR"] = before


# ---- wrong tables: faults of a recorder or a careless hand, alike in all of a model's tables


def spoil_runs(name: str, a: Runs, b: Runs) -> tuple[Runs, Runs]:
    """Return the runs of two sides with the tables of the second, or of both, spoiled; "" spoils nothing."""
    if not name:
        return a, b
    return (_map_tables(a, SPOILS[name]) if name == "both constant" else a), _map_tables(b, SPOILS[name])


def _map_tables(runs: Runs, change: Callable[[pd.DataFrame], pd.DataFrame]) -> Runs:
    changes: dict[str, Any] = {
        name: replace(table, frame=change(table.frame))
        for name, table in vars(runs).items()
        if isinstance(table, Table)
    }
    return replace(runs, **changes)


def _late_values(frame: pd.DataFrame) -> pd.DataFrame:
    time = frame["time"].to_numpy()
    at = np.maximum(time - DELAY, time[0])
    return frame.assign(**{name: np.interp(at, time, frame[name]) for name in frame.columns.drop("time")})


def _row_twice(frame: pd.DataFrame) -> pd.DataFrame:
    middle = len(frame) // 2
    return pd.concat([frame[: middle + 1], frame[middle:]], ignore_index=True)


def _held_value(frame: pd.DataFrame) -> pd.DataFrame:
    return _row_twice(frame).drop(len(frame) // 2 + 2).reset_index(drop=True).assign(time=frame["time"])


def _swapped_corners(frame: pd.DataFrame) -> pd.DataFrame:
    exchange = {"corner_ll": "corner_lr", "corner_lr": "corner_ll"}
    return frame.rename(columns=lambda name: exchange.get(name[:9], name[:9]) + name[9:])


def _constant(frame: pd.DataFrame) -> pd.DataFrame:
    return frame.assign(slider_y=frame["slider_y"].iloc[0])


# By the name that the catalogue gives them.
SPOILS: dict[str, Callable[[pd.DataFrame], pd.DataFrame]] = {
    "nan": lambda frame: frame.assign(slider_vy=frame["slider_vy"].mask(frame.index == len(frame) // 2)),
    "no channel": lambda frame: frame.drop(columns="corner_ur_friction"),
    "truncated": lambda frame: frame.iloc[:-2],
    "zero force": lambda frame: frame.assign(
        **dict.fromkeys(frame.filter(regex="^corner_.*_(normal|friction)$").columns, 0.0)
    ),
    "late times": lambda frame: frame.assign(time=frame["time"] + DELAY),
    "late values": _late_values,
    "row twice": _row_twice,
    "held value": _held_value,
    "millimetres": lambda frame: frame.assign(slider_x=1e3 * frame["slider_x"]),
    "swapped corners": _swapped_corners,
    "sign": lambda frame: frame.assign(slider_omega=-frame["slider_omega"]),
    "constant": _constant,
    "both constant": _constant,
}
