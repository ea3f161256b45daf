"""Text of a new scene file, which explains the keys that are changed most."""

import os
import re
import textwrap
from contextlib import suppress
from functools import reduce
from pathlib import Path
from typing import Any

from comparison.scene.keys import scene_keys
from comparison.scene.loading import BASE, SceneError, load_scene, shipped_scenes
from comparison.scene.overrides import readable, toml
from comparison.scene.schema import NAME

_SECTIONS = (
    "drive", "joints", "clearance", "contact", "friction", "load", "environment", "initial", "output",
    "mechanism",
)  # fmt: skip
_HEAD = """\
# Scene of sixbar. What is not written here has the value of the scene that this
# one extends; "sixbar keys" lists all keys. SI units except where a key says so.
"""


def new_scene(path: Path, source: str) -> str:
    """Return the TOML text of a file that extends a scene and writes its values out, with comments.

    Raises
    ------
    SceneError
        Where ``source`` is no scene, or the file's name cannot be that of a scene.
    """
    if not re.match(NAME, path.stem):
        raise SceneError(f"{path}: a scene's name must be letters, digits and . _ + = - only")
    data: Any = load_scene(source).data
    extends = source
    if source not in (BASE, *shipped_scenes()):
        extends = str(Path(source).expanduser().absolute())
        with suppress(ValueError):  # on another drive
            extends = os.path.relpath(extends, path.parent.absolute())
    lines = [_HEAD, "[scene]", f"extends = {toml(Path(extends).as_posix())}", f"title = {toml(path.stem)}"]
    keys = [key for name in _SECTIONS for key in scene_keys() if key.name.startswith(f"{name}.")]
    for key in keys:
        section, _, own = key.name.rpartition(".")
        if f"[{section}]" not in lines:
            lines += ["", f"[{section}]"]
        rule = ", ".join(filter(None, (key.unit, key.bounds)))
        value = reduce(dict.__getitem__, key.name.split("."), data)
        lines += textwrap.wrap(key.description, 80, initial_indent="# ", subsequent_indent="#   ")
        given = f"# {own} =" if value is None else f"{own} = {readable(value)}"  # nothing is no value of TOML
        lines.append(f"{given}{f'  # {rule}' if rule else ''}")
    return "\n".join(lines) + "\n"
