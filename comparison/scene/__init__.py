"""What is simulated: scenes read from TOML, checked, and laid out as the mapping that a model takes.

`loading` reads and merges them, `schema` with `fields` and `criteria` holds what may stand in one,
`error_messages` says in one line what is wrong, `formulation` which equations a scene needs. `shipped` are
ours.
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
