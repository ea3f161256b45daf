"""Pytest fixture for external projects: assert that two tables agree on a scene.

pytest loads this module at every start where the package is installed; only pytest is imported until the
fixture is used. PYTEST_DONT_REWRITE
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    import pandas as pd

    from comparison.tables.table import Table

    Results = str | Path | Table | pd.DataFrame


@pytest.fixture
def assert_agree() -> Callable[..., None]:
    """Return a function that fails the test unless two tables agree, see ``docs/ci.md``.

    ``assert_agree(a, b, *, scene=None, tolerance=None, share=1.0, allow_indeterminate=False)``: ``a`` and
    ``b`` are paths of tables, `comparison.tables.table.Table` or pandas data frames with a column ``time``;
    the others are those of ``sixbar compare``.
    """
    return _assert_agree


def _assert_agree(
    a: Results,
    b: Results,
    *,
    scene: str | Path | None = None,
    tolerance: float | None = None,
    share: float = 1.0,
    allow_indeterminate: bool = False,
) -> None:
    from comparison.scene import load_scene
    from comparison.tables.table import TableError
    from comparison.verdict.tables import compare
    from comparison.words.verdicts import reason, scene_reason

    __tracebackhide__ = True  # the line to show is the test's
    labels = (
        str(a) if isinstance(a, str | Path) else "table a",
        str(b) if isinstance(b, str | Path) else "table b",
    )
    try:
        loaded = None if scene is None else load_scene(scene)
        result = compare(a, b, scene=loaded, tolerance=tolerance, share=share, labels=labels)
    except TableError as error:
        raise AssertionError(f"cannot compare: {error}") from None
    if result.verdict == "agree" or (result.verdict == "indeterminate" and allow_indeterminate):
        return
    on = "" if result.scene is None else f" on scene {result.name!r}"
    lines = [f"{' and '.join(labels)}{on}: {result.verdict}: {scene_reason(result)}"]
    lines += [
        f"  {name}: {channel.verdict}: {reason(channel)}"
        for name, channel in result.channels.items()
        if channel.verdict == "differ"
    ]
    raise AssertionError("\n".join([*lines, *(f"  warning: {warning}" for warning in result.warnings)]))
