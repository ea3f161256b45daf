"""Tables as other programs write them, and functions that require them to be read or refused."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from comparison.tables.foreign import open_source, read_tables
from comparison.tables.mapping import Mapping, load_mapping
from comparison.tables.table import TableError

TIME = np.arange(0, 11) / 1000
FRAME = pd.DataFrame(
    {"time": TIME, "slider_y": 0.1 * np.cos(400 * TIME), "slider_angle": 1e-3 * np.sin(400 * TIME)}
)


def text(header):
    columns = FRAME["time"] * 1e3, FRAME["slider_y"] * 1e3, np.degrees(FRAME["slider_angle"])
    rows = (",".join(repr(float(v)) for v in row) for row in zip(*columns, strict=True))
    return "\n".join([header, *rows, ""])


def put(name, content):
    path = Path(name)
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def read_pair(a, b=None, mapping=None):
    """Read two files, or one that stands for both, by the text of a mapping."""
    rules = Mapping() if mapping is None else load_mapping(put("map.toml", mapping))
    files = [a, b] if b else [open_source(a, rules.dialect.of("a"))] * 2
    (first, second), warnings = read_tables(files, ["a", "b"], rules)
    return first, second, warnings


def refused(rule, a, b=None, mapping=None):
    """Require one line with all pieces of a rule."""
    with pytest.raises(TableError) as error:
        read_pair(a, b, mapping)
    message = str(error.value)
    assert "\n" not in message
    assert not [piece for piece in rule.split("|") if piece not in message], message
