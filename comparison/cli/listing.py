"""``sixbar scenes``, ``sixbar channels`` and ``sixbar plan``: what there is to simulate and to compare."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer

from comparison.cli import options
from comparison.cli.console import columns, print_json, say, say_wrapped, warn


def scenes(json: options.AsJson = False) -> int:
    """List the shipped scenes."""
    from comparison.scene import load_scene, shipped_scenes

    listed = [
        {
            "name": scene.name,
            "title": scene.title,
            "description": scene.description,
            "speed_rpm": scene.data["drive"]["speed_rpm"],
            "cycles": scene.data["drive"]["cycles"],
            "clearance": {
                joint: float(scene.data["clearance"][joint])
                for joint in ("slider", "crank_pin")
                if scene.data["joints"][joint] == "clearance"
            },
            "hash": scene.hash,
        }
        for scene in map(load_scene, shipped_scenes())
    ]
    if json:
        return print_json(listed)
    rows = [("scene", "speed", "clearance", "title")]
    for scene in listed:
        sizes = " + ".join(f"{size * 1e3:g} mm" for size in scene["clearance"].values())
        rows.append((scene["name"], f"{scene['speed_rpm']:g} rpm", sizes or "none", scene["title"]))
    say(*columns(rows, right=(1,)))
    return 0


def channels(
    scene: Annotated[
        str | None, typer.Argument(metavar="SCENE", hidden=True, autocompletion=options.scene_names)
    ] = None,
    json: options.AsJson = False,
) -> int:
    """List the channels of a table with unit and group.

    The groups are those of a scene's output.groups. With SCENE only the channels that it requests.
    """
    from comparison.scene import load_scene
    from comparison.tables.channels import channels as all_channels
    from comparison.tables.channels import expected

    known = all_channels()
    listed = [known[name] for name in (known if scene is None else expected(load_scene(scene).data))]
    if json:
        return print_json([vars(channel) for channel in listed])
    rows = [("channel", "unit", "group", "quantity")]
    say(*columns([*rows, *((each.name, each.unit, each.group, each.label) for each in listed)]))
    return 0


def plan(scene: options.SceneName, overrides: options.Overrides = None, json: options.AsJson = False) -> int:
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
    lines = [channels_line(loaded), *(line for planned in plans for line in plan_lines(planned))]
    say_wrapped(*lines, rest=" " * 14)
    return 0
