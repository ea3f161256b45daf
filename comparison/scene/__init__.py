"""Scenes: read from TOML, validated, and converted to the mapping that a model takes.

`loading` reads and merges them; `schema`, `fields` and `criteria` define their keys; `error_messages` phrases
validation errors; `formulation` selects the equations that a scene needs. `shipped` holds the shipped scenes.
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

__all__ = [
    "Scene",
    "SceneError",
    "digest",
    "load_scene",
    "parse_set",
    "scene_from_mapping",
    "shipped_scenes",
]
