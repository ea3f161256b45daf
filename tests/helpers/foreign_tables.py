"""Tables as other programs write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from comparison.tables.foreign import read_tables
from comparison.tables.mapping import Mapping
from comparison.tables.table import Table

TIME = np.arange(0, 11) / 1000


FRAME = pd.DataFrame(
    {"time": TIME, "slider_y": 0.1 * np.cos(400 * TIME), "slider_angle": 1e-3 * np.sin(400 * TIME)}
)


ROWS = [(t * 1e3, y * 1e3, np.degrees(angle)) for t, y, angle in FRAME.to_numpy()]


def text(header: str, separator: str = ",", decimal: str = ".", end: str = "\n") -> str:
    """The frame in ms, mm and deg."""
    lines = [separator.join(repr(float(v)).replace(".", decimal) for v in row) for row in ROWS]
    return header + "\n" + end.join(lines) + end


def put(name: str, content: str | bytes, encoding: str = "utf-8") -> Path:
    path = Path(name)
    path.write_bytes(content if isinstance(content, bytes) else content.encode(encoding))
    return path


def read_pair(
    a: Path, b: Path, mapping: Mapping | None = None, at_events: str | None = None
) -> tuple[Table, Table, tuple[str, ...]]:
    (first, second), warnings = read_tables([a, b], ["a", "b"], mapping, at_events)
    return first, second, warnings
