"""The settings to try for a wanted accuracy."""

from __future__ import annotations

from collections.abc import Iterator

from comparison.accuracy.levels import NAMES, finer, metres, refinement, solver_values
from comparison.accuracy.measured import front
from comparison.models import OWN
from comparison.scene import Scene

MOST_LEVELS = 4
"""To try, of a model whose finest useful setting is not known, or where the finer ones have no result."""


def settings(scene: Scene, model: str, accuracy: str | float | None) -> Iterator[Scene]:
    """Yield the scene at the settings to try, each finer than the one before.

    The first is the measured one of the shipped scene that is most like this, the last is ``strict``. Another
    package's model begins with the scene's own.

    Raises
    ------
    AccuracyError
        If the accuracy is neither a name nor a positive number, or a name for a model that has none.
    """
    if accuracy is None:
        yield scene
    elif accuracy in NAMES:
        yield scene.variant(solver_values(model, accuracy, scene))
    elif model in OWN:
        wanted = metres(accuracy)
        ((key, finest),) = solver_values(model, "strict", scene).items()
        assert isinstance(finest, float)
        known = front(scene, model)
        setting = (known and known.cheapest(wanted)) or finest
        factor, _ = refinement(model, scene)
        while setting > finest * (1 + 1e-9):
            yield scene.variant({key: setting})
            setting = float(f"{setting / factor:.12g}")
        yield scene.variant({key: finest})
    else:
        metres(accuracy)
        better: Scene | None = scene
        for _ in range(MOST_LEVELS):
            if better is None:
                return
            yield better
            better = finer(model, better)
