"""``sixbar scenes``, ``sixbar channels`` and ``sixbar plan``: what there is to simulate and to compare."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated, Any

import typer

from comparison.cli.console import columns, print_json, say, warn, wrapped
from comparison.cli.options import AsJson, Overrides, SceneName, scene_names

_PLAN_INDENT = 14  # of what follows the names in a plan


def scenes(json: AsJson = False) -> int:
    """List the shipped scenes."""
    from comparison.scene import load_scene, shipped_scenes

    shipped = [load_scene(name) for name in shipped_scenes()]
    if json:
        return print_json(
            [
                {
                    "name": scene.name,
                    "title": scene.title,
                    "description": scene.description,
                    "speed_rpm": scene.data["drive"]["speed_rpm"],
                    "cycles": scene.data["drive"]["cycles"],
                    "clearance": _clearances(scene.data),
                    "hash": scene.hash,
                }
                for scene in shipped
            ]
        )
    rows = [("scene", "speed", "clearance", "title")]
    for scene in shipped:
        sizes = [f"{size * 1e3:g} mm" for size in _clearances(scene.data).values()]
        speed = f"{scene.data['drive']['speed_rpm']:g} rpm"
        rows.append((scene.name, speed, " + ".join(sizes) or "none", scene.title))
    say(*columns(rows, right=(1,)))
    return 0


def channels(
    scene: Annotated[
        str | None,
        typer.Argument(metavar="SCENE", hidden=True, autocompletion=scene_names),
    ] = None,
    json: AsJson = False,
) -> int:
    """List the channels of a table with unit and group.

    The groups are those of a scene's output.groups. With SCENE only the channels that it requests.
    """
    from comparison.scene import load_scene
    from comparison.tables.channels import channels as all_channels
    from comparison.tables.channels import expected

    known = all_channels()
    names = list(known) if scene is None else expected(load_scene(scene).data)
    listed = [known[name] for name in names]
    if json:
        return print_json([vars(channel) for channel in listed])
    rows = [("channel", "unit", "group", "quantity")]
    rows += [(channel.name, channel.unit, channel.group, channel.label) for channel in listed]
    say(*columns(rows))
    return 0


def plan(scene: SceneName, overrides: Overrides = None, json: AsJson = False) -> int:
    """Show what each model integrates for a scene, and the cost.

    Also what it leaves out and why. SCENE: a shipped scene or the path of a TOML file.
    """
    from comparison.accuracy.plan import plan as plan_run
    from comparison.models import MODELS
    from comparison.scene import load_scene, parse_set
    from comparison.words.accuracy import channels_line, plan_lines

    loaded = load_scene(scene, parse_set(overrides or []))
    warn(loaded.warnings)
    plans = [plan_run(loaded, model) for model in MODELS]
    if json:
        return print_json([asdict(planned) for planned in plans])
    for text in (channels_line(loaded), *(line for planned in plans for line in plan_lines(planned))):
        say(*wrapped(text, rest=" " * _PLAN_INDENT))
    return 0


def _clearances(data: dict[str, Any]) -> dict[str, float]:
    """Return the clearance (m) of each joint that has one."""
    return {
        joint: float(data["clearance"][joint])
        for joint in ("slider", "crank_pin")
        if data["joints"][joint] == "clearance"
    }
