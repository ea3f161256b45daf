"""Baseline file: recorded results of each model, as a text file of few numbers.

It holds three runs per scene: the reference at the tight tier, Exudyn's five bodies with the scene's
settings, and its tree at the tight tier (`comparison.accuracy.levels`). Of each: settings, counters, and for
every channel some checkpoints, see `comparison.regression.record`.
"""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from comparison.files import contents, replacing
from comparison.scene import Scene, digest, load_scene, shipped_scenes

Finite = Annotated[float, Field(allow_inf_nan=False, strict=True)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False, strict=True)]
Count = Annotated[int, Field(ge=0, strict=True)]
Rate = Count | Finite | list[Finite]
Rates = dict[str, Rate | dict[str, Rate]]
Setting = str | bool | int | float

HEADER = """\
# What the models gave when this file was made. `sixbar gate` compares; `sixbar gate --update` makes it anew.
# A checkpoint is [time in s, value, threshold], the last two in the channel's unit.
"""


class BaselineError(ValueError):
    """Baseline that cannot be used or created; the message is one line."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Checkpoint(NamedTuple):
    """A value at a predictable sample."""

    time: Finite
    """s"""
    value: Finite
    threshold: Positive
    """How far another run of the same model may be from the value; both in the channel's unit."""


class RunRecord(_Part):
    """One run of a model."""

    settings: dict[str, Setting]
    """The scene's ``[solver]`` of this model, with the formulation that it chose."""
    counters: dict[str, Count]
    """Of the work, and the number of contacts."""
    spread: dict[str, Count] = {}
    """By how much the counters differ between runs from starts that are next to each other."""
    unexcited: list[str] = []
    """Channels in which nothing happens: their range is below their floor."""
    unpredictable: list[str] = []
    """Channels without a predictable sample at which something happens."""
    channels: dict[str, list[Checkpoint]]


class SceneRecord(_Part):
    """A scene and the runs of it, each by its tier."""

    source: str
    """A shipped name, or the path of a file as seen from the baseline's folder."""
    hash: str
    """Of the scene's numbers without the solvers' settings."""
    reference: dict[Literal["standard", "tight"], RunRecord] = {}
    exudyn: dict[Literal["standard", "tight"], RunRecord] = {}

    @property
    def runs(self) -> dict[tuple[str, str], RunRecord]:
        """(Model, tier) -> run."""
        return {
            (model, tier): run
            for model, tiers in (("reference", self.reference), ("exudyn", self.exudyn))
            for tier, run in tiers.items()
        }


class Detection(_Part):
    """Detection power and false-alarm rate of verdicts with `Baseline.thresholds`: counts and limits."""

    false_alarms: Rates
    detected: Rates


class Baseline(_Part):
    """The whole file."""

    platform: str
    versions: dict[str, str]
    thresholds: dict[str, Any]
    """What stood in ``thresholds.toml``."""
    detection: Detection | None = None
    scenes: Annotated[dict[str, SceneRecord], Field(min_length=1)]


def read(path: Path) -> Baseline:
    """Read a baseline.

    Raises
    ------
    BaselineError
        If there is none, or it is not what `write` writes: where, value, rule.
    """
    try:
        content = tomllib.loads(contents(path))
        written = content.pop("checksum", None)
        baseline = Baseline.model_validate(content)
    except FileNotFoundError as error:
        message = "there is no such baseline; sixbar gate --update makes one"
        raise BaselineError(f"{path}: {message}") from error
    except OSError as error:
        raise BaselineError(f"{path}: {error.strerror or error}") from error
    except ValidationError as error:
        raise BaselineError(f"{path}: {explain(error)}") from error
    except ValueError as error:  # not UTF-8, not TOML
        raise BaselineError(f"{path}: is not TOML text: {' '.join(str(error).split())}") from error
    except RecursionError as error:
        raise BaselineError(f"{path}: is nested too deeply") from error
    if written != checksum(baseline):
        fault = "has no checksum" if written is None else "was changed since: its checksum does not match"
        raise BaselineError(f"{path}: {fault}; restore it, or delete it and run sixbar gate --update")
    return baseline


def checksum(baseline: Baseline) -> str:
    """Return a hash of the numbers, whatever the layout of the text."""
    return digest(baseline.model_dump(mode="json"))


def explain(error: ValidationError) -> str:
    """Say where the first error is, its value and the rule."""
    first = error.errors()[0]
    where = ".".join(str(step) for step in first["loc"]) or "the file"
    if first["type"] == "missing":
        return f"{where} is missing"
    text = " ".join(repr(first["input"]).split())
    return f"{where} = {text if len(text) <= 60 else f'{text[:57]}...'}: {first['msg']}"


def write(baseline: Baseline, path: Path) -> Path:
    """Write a baseline under a temporary name first; equal ones give the same bytes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as part:
        part.write_text("\n".join(_lines(baseline)) + "\n", "utf-8")
    return path


def physics_hash(scene: Scene) -> str:
    """Hash of a scene's numbers without the solvers' settings, which the baseline holds itself."""
    return digest({key: part for key, part in scene.data.items() if key not in ("scene", "solver")})[:16]


def scenes_of(baseline: Baseline, folder: Path) -> tuple[list[Scene], list[str]]:
    """Load the scenes of a baseline that lies in a folder; the second list names those that no longer exist.

    Raises
    ------
    SceneError
        If one is there but cannot be used.
    """
    scenes, gone = [], []
    for name, scene in baseline.scenes.items():
        path = folder / scene.source
        if scene.source in shipped_scenes():
            scenes.append(load_scene(scene.source))
        elif path.is_file():
            scenes.append(load_scene(path))
        else:
            gone.append(name)
    return scenes, gone


def source(scene: Scene, folder: Path) -> str:
    """Return where to find a scene again: its shipped name, or its path relative to a folder."""
    if scene.source in shipped_scenes():
        return scene.source
    return Path(os.path.relpath(Path(scene.source).expanduser(), folder)).as_posix()


def _lines(baseline: Baseline) -> Iterator[str]:
    yield HEADER
    yield f"checksum = {_value(checksum(baseline))}"
    yield f"platform = {_value(baseline.platform)}"
    yield f"versions = {_value(baseline.versions)}"
    yield f"thresholds = {_value(baseline.thresholds)}"
    if baseline.detection is not None:
        yield "\n[detection]"
        for name, rates in baseline.detection.model_dump().items():
            yield f"{name} = {_value(rates)}"
    for name, scene in baseline.scenes.items():
        yield f"\n[scenes.{_value(name)}]"
        yield f"source = {_value(scene.source)}"
        yield f"hash = {_value(scene.hash)}"
        for (model, tier), run in scene.runs.items():
            yield f"\n[scenes.{_value(name)}.{model}.{tier}]"
            for key in ("settings", "counters", "spread", "unexcited", "unpredictable"):
                if (value := getattr(run, key)) or key in ("settings", "counters"):
                    yield f"{key} = {_value(value)}"
            yield f"\n[scenes.{_value(name)}.{model}.{tier}.channels]"
            for channel, checkpoints in run.channels.items():
                yield f"{channel} = ["
                yield from (f"  {_value(list(checkpoint))}," for checkpoint in checkpoints)
                yield "]"


def _value(value: object) -> str:
    """Return a value as TOML in one line."""
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{_key(key)} = {_value(part)}' for key, part in value.items())} }}"
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    # JSON's texts, numbers and truth values are TOML's, which escapes one character more.
    return json.dumps(value, ensure_ascii=False, allow_nan=False).replace("\x7f", "\\u007f")


def _key(key: str) -> str:
    return key if key.replace("_", "").replace("-", "").isalnum() and key.isascii() else _value(key)
