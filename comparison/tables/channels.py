"""Channels of a result: definition, scale for differences, and selection by a scene."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from math import pi
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from comparison.scene.linkage import contacts, quantities

Array = NDArray[np.float64]
"""Values of a channel, and numbers computed from them."""
BoolArray = NDArray[np.bool_]
CORNERS = {"ll": "lower left", "lr": "lower right", "ul": "upper left", "ur": "upper right"}
PIN = "pin"
CONTACTS = CORNERS | {PIN: "crank pin"}
"""Contacts of an event table and their display names: the slider's corners and the journal at A."""
Extent = TypeVar("Extent", float, Array)
UNCERTAINTY = "_u"
"""Ending of the name of a column with the estimated error of a channel, in its unit; itself no channel."""


@dataclass(frozen=True)
class Channel:
    """Channel; the fields are explained at the top of ``channels.toml``."""

    name: str
    label: str
    unit: str
    floor: float
    sign: str = ""
    group: str = "own"
    scale: str = "range"
    round_off: float = 0.0
    rate: str | None = None
    follows: str | None = None
    gap: tuple[str, ...] = ()
    error: bool = False
    angle: bool = False
    turn: float = 2 * pi  # a revolution in the unit of an angle
    rounding: float = 0.0  # of a table's numbers to their digits, as a share of them
    given: float | None = None  # scale that the user states, in the channel's unit; None: by ``scale``

    @property
    def unscaled(self) -> bool:
        """True for an error without a stated scale: a tolerance is a share of nothing then."""
        return self.error and self.given is None

    def scale_value(self, scene: Mapping[str, Any] | None, extent: Extent) -> float | Extent:
        """Return the scale in the channel's unit; without a scene or clearance the ``extent`` of the results.

        Where only the crank pin has clearance, "clearance" is the pin's, along the guide as well: the linkage
        transmits a shift c of the pin to the slider as 0 to 2.83 c, c * tan_beta would be 13 times less.
        """
        if self.given is not None:
            return self.given
        pin = scene is not None and scene.get("joints") == {"slider": "ideal", "crank_pin": "clearance"}
        where = "crank_pin" if pin or self.scale == "clearance of the pin" else "slider"
        if self.scale == "range" or scene is None or scene["clearance"][where] == 0:
            return extent
        rule, per, _ = self.scale.partition("/(T/100)")
        value = float(scene["clearance"][where])
        if rule == "clearance/length":
            value /= float(scene["mechanism"]["slider"]["length"])
        elif rule == "clearance*tan_beta" and not pin:
            value *= float(_file()["tan_beta"])
        period = 60.0 / abs(float(scene["drive"]["speed_rpm"]))
        return value / (period / 100.0) if per else value


@cache
def channels() -> dict[str, Channel]:
    """Return all channels by name, in the order of a table's columns."""
    file = _file()
    definitions = [Channel(name=name, **keys) for name, keys in file["channel"].items()]
    for corner, words in CORNERS.items():
        for quantity, keys in file["corner"].items():
            prefix, fields = f"corner_{corner}_", dict[str, Any](label=f"{keys['label']}, {words} corner")
            if "follows" in keys:
                fields["follows"] = f"{prefix}{keys['follows']}"
            fields["gap"] = tuple(f"{prefix}{gap}" for gap in keys.get("gap", ()))
            definitions.append(Channel(f"{prefix}{quantity}", group="corners", **keys | fields))
    for joint in "OABHCF":
        for axis, keys in file["joint"].items():
            fields = {"name": f"reaction_{joint}_{axis}", "label": f"{keys['label']} at {joint}"}
            definitions.append(Channel(group="joints", **keys | fields))
    return {channel.name: channel for channel in definitions}


def known_channels(scene: Mapping[str, Any]) -> dict[str, Channel]:
    """Return the channels that a table of a scene may hold: the press's, and those of its linkage."""
    fields = quantities(scene) if "body" in scene else {}
    return channels() | {name: Channel(name, **keys) for name, keys in fields.items() if keys}


def places(scene: Mapping[str, Any]) -> list[str]:
    """Return the contacts of a scene as event tables name them: of the press, or "PIN" and "GUIDE.ll"."""
    return contacts(scene) if "body" in scene else [*CONTACTS]


def corners_of(place: str, scene: Mapping[str, Any]) -> list[str]:
    """Return the corners of the contact of this name: under the law foundation both of its side."""
    of_side = place != PIN and scene.get("contact", {}).get("law") == "foundation"
    return [f"{end}{place[1]}" for end in "lu"] if of_side else [place]


def has_load(scene: Mapping[str, Any]) -> bool:
    """Return whether a workpiece pushes the slider."""
    return bool(scene["load"]["force"] or scene["load"]["table"])


def is_uncertainty(column: str) -> bool:
    """Return whether a column is the estimated error of a channel of the press."""
    return column.endswith(UNCERTAINTY) and column.removesuffix(UNCERTAINTY) in channels()


def expected(scene: Mapping[str, Any]) -> list[str]:
    """Return the names of the channels that a scene requests, without ``time``."""
    if "body" in scene:
        return [*quantities(scene)]
    groups, joints = {"motion", *scene["output"]["groups"]}, scene["joints"]
    absent = ["corner_" if joints["slider"] == "ideal" else "guide_"]
    absent += ["journal_"] * (joints["crank_pin"] == "ideal")
    absent += ["energy_load"] * (not has_load(scene))
    items = channels().items()
    return [name for name, channel in items if channel.group in groups and not name.startswith(tuple(absent))]


@cache
def _file() -> dict[str, Any]:
    return tomllib.loads(files("comparison.tables").joinpath("channels.toml").read_text("utf-8"))
