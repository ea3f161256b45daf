"""The press in Python: scenes, runs of one model, comparisons and reliability.

>>> import sixbar
>>> run = sixbar.simulate(sixbar.load_scene("ideal"))
>>> run.names[:3]
['time', 'slider_x', 'slider_y']

A name is imported when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from comparison.reliability.tables import reliability
    from comparison.report.pictures.notebook import simulate
    from comparison.scene import load_scene
    from comparison.verdict.pair import judge
    from comparison.verdict.recorded import compare
    from comparison.verdict.validate import validate

__all__ = ["compare", "judge", "load_scene", "reliability", "simulate", "validate"]

_MODULES = {
    "compare": "comparison.verdict.recorded",
    "judge": "comparison.verdict.pair",
    "load_scene": "comparison.scene",
    "reliability": "comparison.reliability.tables",
    "simulate": "comparison.report.pictures.notebook",
    "validate": "comparison.verdict.validate",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module 'sixbar' has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(_MODULES[name]), name)
    return value


def __dir__() -> list[str]:
    return __all__
