"""``sixbar keys`` and ``sixbar new``: the keys of a scene, and a file of one's own that has them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from comparison.cli import options
from comparison.cli.console import print_json, say, say_wrapped, wrapped


def keys(
    pattern: Annotated[str | None, typer.Argument(metavar="PATTERN", hidden=True)] = None,
    json: options.AsJson = False,
) -> int:
    """List the keys of a scene: default, unit, description, bounds, source.

    With PATTERN only those that have it in their name or description. Defaults are those of a scene that
    extends "paper". The source says where the paper prints the value; "identified" follows from what it
    prints, "chosen" is its own.
    """
    from comparison.scene import SceneError
    from comparison.scene.keys import did_you_mean, scene_keys
    from comparison.scene.overrides import readable

    wanted = (pattern or "").lower()
    listed = [key for key in scene_keys() if wanted in f"{key.name}\n{key.description}".lower()]
    if not listed:
        raise SceneError(
            f"no key of a scene has {pattern!r} in its name or description{did_you_mean(wanted)}"
        )
    if json:
        return print_json([key._asdict() for key in listed])
    for key in listed:
        default = "" if key.default is None else f" = {readable(key.default)} {key.unit}".rstrip()
        notes = "; ".join(filter(None, (key.bounds, key.source)))
        say_wrapped(f"{key.name}{default}{f' ({notes})' if notes else ''}", rest="    ")
        say(*wrapped(key.description, first="    "))
    return 0


def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", hidden=True)],
    scene: Annotated[
        str,
        options.option(
            "SCENE",
            "Shipped scene or path of a TOML file whose values it starts with.",
            "--from",
            autocompletion=options.scene_names,
        ),
    ] = options.MAIN,
) -> int:
    """Write a scene file with the keys that are changed most, each explained.

    FILE: its path, ending in .toml; a file that exists is never overwritten. Until a value is changed it is
    the scene that it was made from.
    """
    from comparison.scene.writing import new_scene

    path = options.to_write(file, ".toml")
    text = new_scene(path, scene)
    if path.exists():
        raise typer.BadParameter(f"{path}: exists, and is not overwritten")
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("x", encoding="utf-8") as stream:
        stream.write(text)
    say(str(path))
    return 0
