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
    from comparison.verdict.compare import Runs, compare, recorded_scene
    from comparison.words.verdicts import reason, scene_reason

    __tracebackhide__ = True  # the line to show is the test's
    labels = (
        str(a) if isinstance(a, str | Path) else "table a",
        str(b) if isinstance(b, str | Path) else "table b",
    )
    try:
        first, second = _read(a), _read(b)
        loaded, warnings = (load_scene(scene), ()) if scene is not None else recorded_scene(first, second)
        if tolerance is None and loaded is not None:
            tolerance = loaded.tolerance
        result = compare(
            Runs(first),
            Runs(second),
            scene=loaded,
            tolerance=tolerance,
            share=share,
            time_tolerance=0.0 if loaded is None else loaded.time_tolerance,
            gate=None if loaded is None else loaded.gate,
            labels=labels,
            warnings=warnings,
        )
    except TableError as error:
        raise AssertionError(f"cannot compare: {error}") from None
    if result.verdict == "agree" or (result.verdict == "indeterminate" and allow_indeterminate):
        return
    on = "" if loaded is None else f" on scene {loaded.name!r}"
    lines = [f"{' and '.join(labels)}{on}: {result.verdict}: {scene_reason(result)}"]
    lines += [
        f"  {name}: {channel.verdict}: {reason(channel)}"
        for name, channel in result.channels.items()
        if channel.verdict == "differ"
    ]
    raise AssertionError("\n".join([*lines, *(f"  warning: {warning}" for warning in result.warnings)]))


def _read(results: Results) -> Table:
    import pandas as pd

    from comparison.tables.table import Table
    from comparison.tables.table_files import read

    if isinstance(results, Table | pd.DataFrame):
        return results if isinstance(results, Table) else Table(results)
    return read(results)
