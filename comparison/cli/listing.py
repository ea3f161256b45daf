"""``sixbar scenes`` and ``sixbar channels``: what there is to simulate and to compare."""

from __future__ import annotations

import json as json_format
from typing import Annotated, Any

import typer

from comparison.cli.layout import columns
from comparison.cli.options import AsJson, scene_names


def scenes(json: AsJson = False) -> int:
    """List the shipped scenes: name, speed, clearance, title."""
    from comparison.scene import load_scene, shipped_scenes

    found = [load_scene(name) for name in shipped_scenes()]
    if json:
        listed = [
            {
                "name": scene.name,
                "title": scene.title,
                "description": scene.description,
                "speed_rpm": scene.data["drive"]["speed_rpm"],
                "cycles": scene.data["drive"]["cycles"],
                "clearance": _clearances(scene.data),
                "hash": scene.hash,
            }
            for scene in found
        ]
        return _print_json(listed)
    rows = [("scene", "speed", "clearance", "title")]
    for scene in found:
        sizes = [f"{size * 1e3:g} mm" for size in _clearances(scene.data).values()]
        speed = f"{scene.data['drive']['speed_rpm']:g} rpm"
        rows.append((scene.name, speed, " + ".join(sizes) or "no clearance", scene.title))
    for line in columns(rows, right=(1,)):
        typer.echo(line)
    return 0


def channels(
    scene: Annotated[
        str | None,
        typer.Argument(help="Only those that this scene asks for.", autocompletion=scene_names),
    ] = None,
    json: AsJson = False,
) -> int:
    """List the channels of a table: name, unit, meaning, and group in a scene's output.groups."""
    from comparison.scene import load_scene
    from comparison.tables.channels import channels as all_channels
    from comparison.tables.channels import expected

    known = all_channels()
    names = list(known) if scene is None else expected(load_scene(scene).data)
    found = [known[name] for name in names]
    if json:
        return _print_json([vars(channel) for channel in found])
    rows = [("channel", "unit", "group", "quantity")]
    rows += [(channel.name, channel.unit, channel.group, channel.label) for channel in found]
    for line in columns(rows):
        typer.echo(line)
    return 0


def _clearances(data: dict[str, Any]) -> dict[str, float]:
    """Return the clearance (m) of each joint that has one."""
    return {
        joint: float(data["clearance"][joint])
        for joint in ("slider", "crank_pin")
        if data["joints"][joint] == "clearance"
    }


def _print_json(value: object) -> int:
    typer.echo(json_format.dumps(value, indent=1, ensure_ascii=False, allow_nan=False))
    return 0
