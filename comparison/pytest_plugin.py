"""Pytest fixture for external projects: assert that a table agrees with another one, or with an expected one.

pytest loads this module at every start where the package is installed; only pytest is imported until the
fixture is used. PYTEST_DONT_REWRITE
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    import pandas as pd

    from comparison.tables.table import Table

    Results = str | Path | Table | pd.DataFrame

_WRITTEN = (".csv", ".parquet")  # endings of the tables that are written where they are missing


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that writes the expected tables anew."""
    group = parser.getgroup("sixbar")
    group.addoption(
        "--sixbar-update",
        action="store_true",
        help="write the expected tables of assert_agree anew, from what the tests give it",
    )


@pytest.fixture
def assert_agree(request: pytest.FixtureRequest) -> Callable[..., None]:
    """Return a function that fails the test unless two tables agree, see ``docs/ci.md``.

    ``assert_agree(a, b, *, scene=None, mapping=None, allow_indeterminate=False, **options)``: ``a`` and ``b``
    are paths of tables, `comparison.tables.table.Table` or pandas data frames; the options are those of
    `comparison.verdict.recorded.compare_files`. Where ``b`` is a path and there is no
    file, the table is written from ``a``, and the test fails this once; ``--sixbar-update`` writes it anew.
    """
    return partial(_assert_agree, update=bool(request.config.getoption("--sixbar-update")))


def _assert_agree(
    a: Results,
    b: Results,
    *,
    update: bool,
    scene: str | Path | None = None,
    mapping: str | Path | None = None,
    allow_indeterminate: bool = False,
    **options: Any,
) -> None:
    from comparison.scene import load_scene
    from comparison.tables.mapping import load_mapping
    from comparison.tables.table import TableError
    from comparison.verdict.recorded import compare
    from comparison.words.verdicts import reason, why

    __tracebackhide__ = True  # the line to show is the test's
    labels = (
        str(a) if isinstance(a, str | Path) else "table a",
        str(b) if isinstance(b, str | Path) else "table b",
    )
    try:
        options["scene"] = None if scene is None else load_scene(scene)
        options["mapping"] = None if mapping is None else load_mapping(Path(mapping))
        if isinstance(b, str | Path) and Path(b).suffix in _WRITTEN and (update or not Path(b).exists()):
            _write(a, labels[0], Path(b), options)
            if update:
                return
            raise AssertionError(
                f"{b} was missing, and is written from {labels[0]}: check it, and test again"
            )
        result = compare(a, b, labels=labels, **options)
    except TableError as error:
        raise AssertionError(f"cannot compare: {error}") from None
    if result.verdict == "agree" or (result.verdict == "indeterminate" and allow_indeterminate):
        return
    on = "" if result.scene is None else f" on scene {result.name!r}"
    lines = [f"{' and '.join(labels)}{on}: {result.verdict}: {why(result)}"]
    lines += [
        f"  {name}: {channel.verdict}: {reason(channel)}"
        for name, channel in result.channels.items()
        if channel.verdict == "differ"
    ]
    raise AssertionError("\n".join([*lines, *(f"  warning: {warning}" for warning in result.warnings)]))


def _write(results: Results, label: str, path: Path, options: dict[str, Any]) -> None:
    """Write the table that is expected: in SI, with the names of channels."""
    from comparison.tables.foreign import as_source, read_tables
    from comparison.tables.table import check
    from comparison.tables.table_files import write

    rows, only, abscissa = options.get("at_events"), options.get("channels"), options.get("abscissa", "time")
    sources = [as_source(results, label)]
    (table,), _ = read_tables(sources, ["a"], options["mapping"], rows, only=only, abscissa=abscissa)
    check(table, table.channels, name=label)
    table = replace(table, frame=table.frame.rename(columns={"time": abscissa}))
    write(table, path)
