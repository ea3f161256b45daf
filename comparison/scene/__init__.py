"""Scenes: read from TOML, validated, and converted to the mapping that a model takes.

`loading` reads them; `overrides` changes their keys, and names what is changed; `schema` defines the keys.
`shipped` holds the shipped scenes.
"""

from comparison.scene.loading import (
    Scene,
    SceneError,
    digest,
    load_scene,
    parse_set,
    scene_from_mapping,
    shipped_scenes,
)
from comparison.scene.overrides import command_line, name_with
from comparison.scene.schema import RandomInput, Reliability

__all__ = [
    "RandomInput",
    "Reliability",
    "Scene",
    "SceneError",
    "command_line",
    "digest",
    "load_scene",
    "name_with",
    "parse_set",
    "scene_from_mapping",
    "shipped_scenes",
]
