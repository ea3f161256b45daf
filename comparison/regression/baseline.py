"""Baseline file: recorded results of each model, as a text file of few numbers.

Three runs per scene: the reference at the tight tier, Exudyn's five bodies with the scene's settings, and its
tree at the tight tier. Of each: settings, counters, and some checkpoints (`comparison.regression.record`).
"""

import json
import os
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from comparison.files import contents, write_text
from comparison.scene import Scene, digest, load_scene, shipped_scenes
from comparison.scene.overrides import explain

Model = TypeVar("Model", bound=BaseModel)
Finite = Annotated[float, Field(allow_inf_nan=False, strict=True)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False, strict=True)]
Count = Annotated[int, Field(ge=0, strict=True)]
Rate = Count | Finite | list[Finite]
Rates = dict[str, Rate | dict[str, Rate]]
Which = tuple[str, str]
"""A model and a tier."""

HEADER = """\
# What the models gave when this file was made. `sixbar gate` compares; `sixbar gate --update` makes it anew.
# A checkpoint is [time in s, value, threshold], the last two in the channel's unit.
"""


class BaselineError(ValueError):
    """Baseline that cannot be used or created; the message is one line."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Checkpoint(NamedTuple):
    """A value at a predictable sample (time in s), and how far another run of the model may be from it."""

    time: Finite
    value: Finite
    threshold: Positive


class RunRecord(_Part):
    """One run of a model."""

    settings: dict[str, str | bool | int | float]  # the scene's of this model, with the formulation it chose
    counters: dict[str, Count]  # of the work, and the number of contacts
    spread: dict[str, Count] = {}  # by how much they differ between runs from starts next to each other
    unexcited: list[str] = []  # channels in which nothing happens: their range is below their floor
    unpredictable: list[str] = []  # channels without a predictable sample at which something happens
    channels: dict[str, list[Checkpoint]]


class SceneRecord(_Part):
    """A scene, the hash of its numbers without the solvers' settings, and its runs by their tier."""

    source: str  # a shipped name, or the path of a file as seen from the baseline's folder
    hash: str
    reference: dict[Literal["standard", "tight"], RunRecord] = {}
    exudyn: dict[Literal["standard", "tight"], RunRecord] = {}

    @property
    def runs(self) -> dict[Which, RunRecord]:
        """Its runs by model and tier."""
        models = {"reference": self.reference, "exudyn": self.exudyn}
        return {(model, tier): run for model, tiers in models.items() for tier, run in tiers.items()}


class Detection(_Part):
    """Detection power and false-alarm rate of verdicts with `Baseline.thresholds`: counts and limits."""

    false_alarms: Rates
    detected: Rates


class Baseline(_Part):
    """The whole file; ``thresholds`` is what stood in ``thresholds.toml``."""

    checksum: str = ""  # of the numbers; read and written, and empty in between
    platform: str
    versions: dict[str, str]
    thresholds: dict[str, Any]
    detection: Detection | None = None
    scenes: Annotated[dict[str, SceneRecord], Field(min_length=1)]


def read(path: Path) -> Baseline:
    """Read a baseline; a `BaselineError` where there is none, or it is not what `write` writes."""
    baseline = parsed(path, "TOML", tomllib.loads, Baseline)
    if baseline.checksum != checksum(baseline):
        fault = "was changed since: its checksum does not match" if baseline.checksum else "has no checksum"
        raise BaselineError(f"{path}: {fault}; restore it, or delete it and run sixbar gate --update")
    return baseline.model_copy(update={"checksum": ""})


def parsed(path: Path, kind: str, load: Callable[[str], Any], model: type[Model]) -> Model:
    """Read a file of a kind; a `BaselineError` tells why it is none, of a bad value where, and the rule."""
    try:
        return model.model_validate(load(contents(path)))
    except FileNotFoundError:
        fault = "there is no such baseline; sixbar gate --update makes one"
    except OSError as error:
        fault = error.strerror or str(error)
    except RecursionError:
        fault = "is nested too deeply"
    except ValidationError as error:  # before its base class ValueError
        fault = explain(error, model)
    except ValueError as error:
        fault = f"is not {kind} text: {' '.join(str(error).split())}"
    raise BaselineError(f"{path}: {fault}")


def checksum(baseline: Baseline) -> str:
    """Return a hash of the numbers, whatever the layout of the text."""
    return digest(baseline.model_dump(mode="json", exclude={"checksum"}))


def physics_hash(scene: Scene) -> str:
    """Hash of a scene's numbers without the solvers' settings, which the baseline holds itself."""
    return digest({key: part for key, part in scene.data.items() if key not in ("scene", "solver")})[:16]


def source(scene: Scene, folder: Path) -> str:
    """Return where to find a scene again: its shipped name, or its path relative to a folder."""
    if scene.source in shipped_scenes():
        return scene.source
    return Path(os.path.relpath(Path(scene.source).expanduser(), folder)).as_posix()


def scenes_of(baseline: Baseline, folder: Path) -> tuple[list[Scene], list[str]]:
    """Load the scenes of a baseline in a folder; the second list names those that no longer exist."""
    found, gone = [], []
    for name, scene in baseline.scenes.items():
        if scene.source in shipped_scenes():
            found.append(load_scene(scene.source))
        elif (folder / scene.source).is_file():
            found.append(load_scene(folder / scene.source))
        else:
            gone.append(name)
    return found, gone


def write(baseline: Baseline, path: Path) -> Path:
    """Write a baseline under a temporary name first; equal ones give the same bytes."""
    lines = [HEADER, f"checksum = {_value(checksum(baseline))}"]
    lines += [f"{key} = {_value(getattr(baseline, key))}" for key in ("platform", "versions", "thresholds")]
    if baseline.detection is not None:
        lines += ["\n[detection]", *(f"{name} = {_value(rates)}" for name, rates in baseline.detection)]
    for name, scene in baseline.scenes.items():
        section = f"scenes.{_value(name)}"
        lines += [f"\n[{section}]", f"source = {_value(scene.source)}", f"hash = {_value(scene.hash)}"]
        for (model, tier), run in scene.runs.items():
            lines.append(f"\n[{section}.{model}.{tier}]")
            for key in ("settings", "counters", "spread", "unexcited", "unpredictable"):
                if (value := getattr(run, key)) or key in ("settings", "counters"):
                    lines.append(f"{key} = {_value(value)}")
            lines.append(f"\n[{section}.{model}.{tier}.channels]")
            for channel, points in run.channels.items():
                lines += [f"{channel} = [", *(f"  {_value([*point])}," for point in points), "]"]
    write_text("\n".join(lines) + "\n", path)
    return path


def _value(value: object) -> str:
    """Return a value as TOML in one line."""
    if isinstance(value, Mapping):
        keys = {key: key.replace("_", "").replace("-", "") for key in value}
        bare = {key: key if text.isalnum() and key.isascii() else _value(key) for key, text in keys.items()}
        return f"{{ {', '.join(f'{bare[key]} = {_value(part)}' for key, part in value.items())} }}"
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    # JSON's texts, numbers and truth values are TOML's, which escapes one character more.
    return json.dumps(value, ensure_ascii=False, allow_nan=False).replace("\x7f", "\\u007f")
