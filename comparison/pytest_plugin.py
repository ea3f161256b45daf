"""Pytest fixture for external projects: assert that a table agrees with another one, or with an expected one.

pytest loads this module at every start where the package is installed; only pytest is imported until the
fixture is used. PYTEST_DONT_REWRITE
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from comparison.tables.arguments import Results
    from comparison.tables.dialect import Source
    from comparison.tables.mapping import Mapping
    from comparison.tables.table import Table
    from comparison.verdict.results import SceneComparison

_WRITABLE = (".csv", ".parquet")  # endings of the tables that can be written
_OBTAINED = "obtained"  # folder beside an expected table, for the files of a failing test
# Endings of the files in it.
_COMPANIONS = (".csv", ".events.csv", ".pulses.csv", ".extrema.csv", ".json", ".html")


@dataclass(frozen=True)
class _Session:
    """Absolute paths of expected tables that tests of this session have written, or disagreed with."""

    updates: set[Path | None] = field(default_factory=set)
    failures: set[Path | None] = field(default_factory=set)


_SESSION = pytest.StashKey[_Session]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that writes the expected tables anew."""
    group = parser.getgroup("sixbar")
    group.addoption(
        "--sixbar-update",
        action="store_true",
        help="write the expected tables of assert_agree anew, from those that the tests obtain",
    )


@pytest.fixture
def assert_agree(request: pytest.FixtureRequest) -> Callable[..., None]:
    """Return a function that fails the test unless two tables agree, see ``docs/ci.md``.

    ``assert_agree(expected, obtained, *, scene=None, mapping=None, allow_indeterminate=False, **options)``:
    the tables are paths, `comparison.tables.table.Table` or pandas data frames; the options are those of
    `comparison.verdict.channel.Criteria`. Where ``expected`` is a path and there is no file, the table is
    written from ``obtained``, and the test fails this once; ``--sixbar-update`` writes it anew, by the first
    of several tests. Warnings of the comparison are those of pytest where the test passes.
    """
    return partial(_assert_agree, request.node)


def _assert_agree(
    node: pytest.Item,
    expected: Results,
    obtained: Results,
    *,
    scene: Any = None,
    mapping: Any = None,
    allow_indeterminate: bool = False,
    **options: Any,
) -> None:
    from comparison.scene import SceneError
    from comparison.tables.table import TableError

    __tracebackhide__ = True  # the line to show is the test's
    arguments = {"scene": scene, "mapping": mapping, "options": options}
    pair = _Pair(expected, obtained, arguments, node, allow_indeterminate=allow_indeterminate)
    update = bool(node.config.getoption("--sixbar-update")) and pair.key not in pair.session.updates
    try:
        if pair.expected_path is not None and (update or not pair.expected_path.exists()):
            pair.write_expected()
            pair.session.updates.add(pair.key)
            if update:
                return
            text = f"{pair.expected_path} was missing, and is written from {pair.labels[1]}"
            raise AssertionError(f"{text}: check it, and test again")
        failure = pair.failure()
    except (TableError, SceneError, OSError) as error:
        raise AssertionError(f"cannot compare: {error}") from None
    if failure:
        raise AssertionError(failure)


@dataclass(frozen=True)
class _Pair:
    """An expected table, and the one that a test obtained."""

    expected: Results
    obtained: Results
    arguments: dict[str, Any]  # scene, mapping and options, as the test gives them
    node: pytest.Item
    allow_indeterminate: bool = field(kw_only=True)

    @property
    def labels(self) -> tuple[str, str]:
        """Names of the two in messages."""
        pairs = ((self.expected, "table expected"), (self.obtained, "table obtained"))
        first, second = (str(one) if isinstance(one, str | Path) else name for one, name in pairs)
        return first, second

    @property
    def session(self) -> _Session:
        """Files of the tests of this session."""
        return self.node.config.stash.setdefault(_SESSION, _Session())

    @property
    def test(self) -> str:
        """Name of the test for pytest, as seen from the folder in which it was started."""
        path = Path(os.path.relpath(self.node.path, self.node.config.invocation_params.dir)).as_posix()
        return f"{path}::{self.node.nodeid.partition('::')[2]}"

    @property
    def expected_path(self) -> Path | None:
        """Path of the expected table; None if it cannot be written."""
        path = Path(self.expected) if isinstance(self.expected, str | Path) else None
        return path if path and path.suffix.lower() in _WRITABLE else None

    @property
    def key(self) -> Path | None:
        """Absolute path of the expected table."""
        return self.expected_path and self.expected_path.resolve()

    @property
    def obtained_path(self) -> Path | None:
        """Path of the table that a failing test leaves beside the expected one."""
        return self.expected_path and self.expected_path.parent / _OBTAINED / f"{self.expected_path.stem}.csv"

    @cached_property
    def mapping(self) -> Mapping | None:
        """The rules for the columns."""
        from comparison.tables.arguments import as_mapping

        return as_mapping(self.arguments["mapping"])

    @cached_property
    def source(self) -> Source:
        """The table obtained, before its columns are converted."""
        from comparison.tables.arguments import as_source
        from comparison.tables.foreign import open_source

        source = as_source(self.obtained, self.labels[1])
        if not isinstance(source, Path):
            return source
        return open_source(source, None if self.mapping is None else self.mapping.dialect.of("b"))

    def compare(self, expected: Results, label: str) -> SceneComparison:
        """Compare a table with the one obtained."""
        from comparison.verdict.recorded import compare

        return compare(
            expected,
            self.obtained,
            scene=self.arguments["scene"],
            mapping=self.mapping,
            labels=(label, "obtained"),
            **self.arguments["options"],
        )

    def passes(self, result: SceneComparison) -> bool:
        """Return whether a verdict is no failure."""
        return result.verdict == "agree" or (self.allow_indeterminate and result.verdict == "indeterminate")

    def failure(self) -> str:
        """Return the reason of a failure, empty if the test passes; write or delete its files."""
        from comparison.tables.table import TableError
        from comparison.words.verdicts import reason, why

        try:
            result = self.compare(self.expected, "expected")
        except TableError as error:
            return "\n".join([f"cannot compare: {error}", *self.write_obtained(None)])
        if self.passes(result):
            self.remove_obtained()
            for warning in result.warnings:
                self.node.warn(UserWarning(f"{' and '.join(self.labels)}: {warning}"))
            return ""
        on = "" if result.scene is None else f" on scene {result.name!r}"
        lines = [f"{' and '.join(self.labels)}{on}: {result.verdict}: {why(result)}"]
        lines += [
            f"  {channel.channel}: differ: {reason(channel)}" for channel in result.with_verdict("differ")
        ]
        if indeterminate := [channel.channel for channel in result.with_verdict("indeterminate")]:
            lines.append(f"  indeterminate: {', '.join(indeterminate)}")
        lines += [f"  warning: {warning}" for warning in result.warnings]
        return "\n".join([*lines, *self.write_obtained(result)])

    def write_obtained(self, result: SceneComparison | None) -> list[str]:
        """Write the table obtained and a report; return lines with their paths and how to accept it."""
        from comparison.files import write_text
        from comparison.report.page import origin, render
        from comparison.tables.table import TableError

        if self.obtained_path is None:
            return []
        self.session.failures.add(self.key)
        try:
            self.source  # noqa: B018
        except TableError:  # cannot be read, which the message says already
            return []
        try:
            lines = [f"  obtained: {_write(self.table(), self.obtained_path)}"]
            if result is not None:
                page = self.obtained_path.with_suffix(".html")
                title, command = f"{self.labels[0]} and the table of {self.test}", f"pytest {self.test}"
                write_text(render([result], title=title, command=command, origin=origin()), page)
                lines.append(f"  report: {page}")
        except (TableError, OSError) as error:
            return [f"  obtained: {error}"]
        if result is not None and result.verdict == "indeterminate":  # an update would be refused
            return lines
        if self.key in self.session.updates:
            return [*lines, "  another test of this session wrote the expected table"]
        return [*lines, f"  to accept it: pytest --sixbar-update {shlex.quote(self.test)}"]

    def remove_obtained(self) -> None:
        """Remove the files of a failure before this session."""
        if self.obtained_path is None or not self.obtained_path.parent.is_dir():
            return
        if self.key in self.session.failures:
            return
        for end in _COMPANIONS:
            with suppress(OSError):
                (self.obtained_path.parent / f"{self.obtained_path.stem}{end}").unlink()
        with suppress(OSError):  # other tests may have files there
            self.obtained_path.parent.rmdir()

    def write_expected(self) -> None:
        """Write the expected table; raise a `TableError` instead if it could not be compared afterwards."""
        from comparison.tables.table import TableError
        from comparison.words.verdicts import why

        path = self.expected_path
        assert path is not None
        table = self.table()
        if path.suffix.lower() != ".csv" and [name for name in table.names if name.endswith("]")]:
            raise TableError(f"{path}: a Parquet file states no units, {self.labels[1]} does: name it .csv")
        with TemporaryDirectory() as folder:
            try:
                result = self.compare(_write(table, Path(folder, path.name)), "expected")
            except TableError as error:
                raise TableError(f"{str(error).replace(folder, '')}; {path} is not written") from None
        if not self.passes(result):
            would = "differ" if result.verdict == "differ" else "be indeterminate"
            raise TableError(f"{path} is not written: read again, it would {would}: {why(result)}")
        _write(table, path)
        self.remove_obtained()

    def table(self) -> Table:
        """Return the table obtained with its own names, units and signs, the units in the names.

        If the mapping has rules for the second table alone, which would not hold for the expected one, it has
        the channels' names and units.
        """
        import pandas as pd

        from comparison.tables.channels import channels
        from comparison.tables.foreign import read_tables
        from comparison.tables.table import Table, TableError
        from comparison.verdict.channel import Criteria

        source = self.source
        columns = {column.name: column for column in source.columns if column.text is None}
        units = {name: column.unit for name, column in columns.items()}
        frame = pd.DataFrame({name: column.numbers for name, column in columns.items()})
        if self.mapping is not None and self.mapping.b:
            criteria = Criteria(**self.arguments["options"])
            rows, only = criteria.at_events, criteria.channels
            (table,), _ = read_tables([source], ["b"], self.mapping, rows, only=only)
            if not table.channels:
                rule = f"{self.mapping.file} assigns none of its columns to a channel"
                raise TableError(f"{source.path}: {rule}")
            definitions = channels() | table.overrides
            frame = table.frame
            units = {"time": "s", **{name: definitions[name].unit for name in table.channels}}
        elif source.time_name == "#1":
            frame, units = frame.rename(columns={"#1": "time"}), {}
        names = {name: f"{name} [{unit}]" for name, unit in units.items() if unit}
        companions = source.companions
        return Table(
            frame.rename(columns=names),
            companions.events,
            companions.extrema,
            companions.provenance,
            pulses=companions.pulses,
            cycle_extrema=companions.cycle_extrema,
        )


def _write(table: Table, path: Path) -> Path:
    """Write a table, with companions only if it has any: another program may use those names."""
    from comparison.files import replacing
    from comparison.tables.table_files import write

    if table.provenance or table.extrema or table.events is not None:
        return write(table, path)
    with replacing(path) as part:
        if path.suffix.lower() == ".csv":
            table.frame.to_csv(part, index=False)
        else:
            table.frame.to_parquet(part, index=False)
    for end in (".events.csv", ".pulses.csv", ".extrema.csv"):  # an earlier table's
        path.with_suffix(end).unlink(missing_ok=True)
    return path
