"""``sixbar scenes``, ``channels``, ``plan``, ``keys``, ``new``: scenes, channels, keys and plans."""

from dataclasses import asdict
from itertools import chain
from pathlib import Path
from typing import Annotated

import typer

from comparison.cli import console
from comparison.cli.console import columns, print_json, say, say_wrapped, warn, wrapped


def scenes(json: console.AsJson = False) -> int:
    """List the shipped scenes."""
    from comparison.scene import load_scene, shipped_scenes
    from comparison.scene.loading import shipped_linkages

    linkages = [*map(load_scene, shipped_linkages())]
    records = [
        {
            "name": scene.name,
            "title": scene.title,
            "description": scene.description,
            "speed_rpm": scene.data["drive"].get("speed_rpm"),
            "cycles": scene.data["drive"].get("cycles"),
            "clearance": {joint: scene.clearance(joint) for joint in reversed(scene.loose)},
            "hash": scene.hash,
        }
        for scene in (*map(load_scene, shipped_scenes()), *linkages)
    ]
    if json:
        return print_json(records)
    rows = [("scene", "speed", "clearance", "title")]
    for scene in records[: -len(linkages)]:
        sizes = " + ".join(f"{size * 1e3:g} mm" for size in scene["clearance"].values())
        rows.append((scene["name"], f"{scene['speed_rpm']:g} rpm", sizes or "none", scene["title"]))
    say(*columns(rows, right=(1,)))
    others = [(scene.name, f"{scene.duration:g} s", scene.title) for scene in linkages]
    say("", *columns([("linkage", "time", "title"), *others], right=(1,)))
    return 0


def channels(
    scene: Annotated[
        str | None, typer.Argument(metavar="SCENE", hidden=True, autocompletion=console.scene_names)
    ] = None,
    json: console.AsJson = False,
) -> int:
    """List the channels of a table with unit and group.

    The groups are those of a scene's output.groups. SCENE selects the channels that it requests.
    """
    from comparison.scene import load_scene
    from comparison.tables.channels import expected, known_channels

    data = None if scene is None else load_scene(scene).data
    definitions = known_channels(data or {})
    selection = [definitions[name] for name in (definitions if data is None else expected(data))]
    if json:
        return print_json([vars(channel) for channel in selection])
    rows = [("channel", "unit", "group", "quantity")]
    say(*columns([*rows, *((each.name, each.unit, each.group, each.label) for each in selection)]))
    return 0


def plan(scene: console.SceneName, overrides: console.Overrides = None, json: console.AsJson = False) -> int:
    """Show what each model integrates for a scene, and the cost.

    The plan also names what a model leaves out, and why, and the keys whose values differ from those of the
    scene that this one extends (in brackets). It refuses a scene that a model refuses.
    SCENE: a shipped scene or the path of a TOML file.
    """
    from comparison.accuracy.levels import plan as plan_run
    from comparison.execution.run import check_forces
    from comparison.models import MODELS
    from comparison.scene import load_scene, parse_set
    from comparison.scene.loading import extension, heavy_load
    from comparison.words.accuracy import changes_line, channels_line, plan_lines

    setup = load_scene(scene, parse_set(overrides or []))
    forces = [check_forces(setup, model) for model in MODELS]
    loads = [line for each in forces if (line := heavy_load(setup.data, each))]
    warn((*setup.warnings, *loads[:1]))
    plans = [plan_run(setup, model) for model in MODELS]
    if json:
        return print_json([asdict(each) for each in plans])
    lines = [channels_line(setup), changes_line(*extension(setup)), *chain(*map(plan_lines, plans))]
    say_wrapped(*filter(None, lines), rest=" " * 14)
    return 0


def keys(
    pattern: Annotated[str | None, typer.Argument(metavar="PATTERN", hidden=True)] = None,
    linkage: Annotated[bool, console.option(None, "Keys of a linkage of your own.", "--linkage")] = False,
    json: console.AsJson = False,
) -> int:
    """List the keys of a scene: default, unit, description, bounds, source.

    PATTERN selects the keys that contain it in name or description. Defaults are those of a scene that
    extends "paper". The source is the place where the paper prints the value; an "identified" value follows
    from what it prints, a "chosen" one is this project's.
    """
    from comparison.scene import SceneError
    from comparison.scene.keys import did_you_mean, readable, scene_keys
    from comparison.scene.linkage import LinkageKeys
    from comparison.scene.schema import SceneKeys

    schema, fragment = LinkageKeys if linkage else SceneKeys, (pattern or "").lower()
    matches = [key for key in scene_keys(schema) if fragment in f"{key.name}\n{key.description}".lower()]
    if not matches:
        raise SceneError(
            f"no key of a scene has {pattern!r} in its name or description{did_you_mean(fragment, schema)}"
        )
    if json:
        return print_json([key._asdict() for key in matches])
    for key in matches:
        default = "" if key.default is None else f" = {readable(key.default)} {key.unit}".rstrip()
        unit = key.unit if key.default is None else ""
        notes = "; ".join(filter(None, (unit, key.bounds, key.source)))
        say_wrapped(f"{key.name}{default}{f' ({notes})' if notes else ''}", rest="    ")
        say(*wrapped(key.description, first="    "))
    return 0


def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", hidden=True)],
    scene: Annotated[
        str,
        console.option(
            "SCENE",
            "Shipped scene or path of a TOML file that it starts from.",
            "--from",
            autocompletion=console.scene_names,
        ),
    ] = console.MAIN,
) -> int:
    """Write a scene file with the keys that are changed most, each explained.

    FILE: its path, ending in .toml; a file that exists is never overwritten. The new scene equals the one
    that it starts from until a value is changed.
    """
    from comparison.scene.loading import new_scene

    path = console.check_output(file, ".toml")
    text = new_scene(path, scene)
    if path.exists():
        raise typer.BadParameter(f"{path}: exists, and is not overwritten")
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("x", encoding="utf-8") as stream:
        stream.write(text)
    say(str(path))
    return 0
