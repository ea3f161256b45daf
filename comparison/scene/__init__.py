"""Scenes: read from TOML, validated, and converted to the mapping that a model takes."""

from comparison.scene.keys import command_line, name_with
from comparison.scene.loading import (
    Scene,
    SceneError,
    as_scene,
    digest,
    load_scene,
    parse_set,
    scene_from_mapping,
    shipped_scenes,
)
from comparison.scene.schema import Reliability

__all__ = [
    "Reliability",
    "Scene",
    "SceneError",
    "as_scene",
    "command_line",
    "digest",
    "load_scene",
    "name_with",
    "parse_set",
    "scene_from_mapping",
    "shipped_scenes",
]
