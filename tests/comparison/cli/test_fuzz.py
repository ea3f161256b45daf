"""Any input: a verdict or one line on stderr, never a traceback, an internal error or a raw escape.

Scenes, mappings, tables and arguments are damaged at random. A failure prints what reproduces it. The number
of examples of each test is HYPOTHESIS_EXAMPLES, else 300, a third of it where tables are compared and a
page is written. How many inputs were tried, and how they ended, is printed at the end.
"""

import contextlib
import io
import os
from collections import Counter
from importlib.resources import files
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from comparison.cli import main
from comparison.scene import load_scene, shipped_scenes
from comparison.tables.table_files import write

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("elsewhere")]
EXAMPLES = int(os.environ.get("HYPOTHESIS_EXAMPLES", "300"))
many = settings(
    max_examples=EXAMPLES,
    print_blob=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
costly = settings(many, max_examples=EXAMPLES // 3)
TRIED = Counter()
"""Inputs by the exit code that they had."""


@pytest.fixture(scope="module", autouse=True)
def _reported(request):
    yield
    with request.config.pluginmanager.getplugin("capturemanager").global_and_fixture_disabled():
        print(f"\n{TRIED.total()} fuzzed inputs by their exit codes: {dict(TRIED)}")  # noqa: T201


SHIPPED = [
    Path(str(files("comparison.scene.shipped").joinpath(f"{name}.toml"))).read_text()
    for name in ("paper", *shipped_scenes())
]
ODD = st.sampled_from(
    [
        "1e308", "-1e308", "1e-320", "nan", "inf", "-0.0", "9" * 400, "9" * 5000, "true", "[]", "[[]]", "{}",
        '""', "'\x1b[31m'", '"\\u0000"', "1979-05-27", "0x7fffffffffffffff", "[" * 300 + "]" * 300,
        '"' + "a" * 300 + '"',
        "{a.b.c = 1}", '"~nosuchuser/x"', '"paper"', '"../../etc"', "1e400", "-9223372036854775809",
    ]
)  # fmt: skip
KEYS = [
    f"{section}.{key}"
    for section, part in load_scene("both-clearances").data.items()
    if isinstance(part, dict)
    for key in part
]
KEYS += ["compare.tolerance", "reliability.bins", "scene.extends", "solver.adams"]


def held(arguments):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(arguments)
    TRIED[code] += 1
    said, lines = out.getvalue() + err.getvalue(), err.getvalue().splitlines()
    assert code in (0, 1, 2, 3), (code, lines)
    assert not [never for never in ("Traceback", "internal error", "\x1b") if never in said]
    assert code != 2 or (lines and all(line.startswith("sixbar: ") for line in lines))


@st.composite
def damaged(draw, texts):
    """A text with bytes changed, lines repeated, dropped or swapped, or cut."""
    content = bytearray(draw(texts).encode())
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, max(0, len(content) - 1)))
        kind = draw(st.sampled_from(["bytes", "cut", "line", "drop", "repeat", "number"]))
        lines = content.split(b"\n")
        row = draw(st.integers(0, len(lines) - 1))
        if kind == "bytes":
            content[at : at + draw(st.integers(0, 1))] = draw(st.binary(max_size=6))
        elif kind == "cut":
            del content[at:]
        elif kind == "number":
            head, _, tail = lines[row].rpartition(b"=")
            lines[row] = (head + b"= " if head else tail + b",") + draw(ODD).encode()
            content = bytearray(b"\n".join(lines))
        else:
            changed = {"drop": [], "repeat": [lines[row]] * 2, "line": [lines[0], lines[row]]}
            lines[row : row + 1] = changed[kind]
            content = bytearray(b"\n".join(lines))
    return bytes(content)


MAPPING = (
    'compare = ["slider_x"]\n[columns]\n"time" = { channel = "time", unit = "s" }\n'
    '"slider_x" = { channel = "slider_x", unit = "m", sign = -1, offset = 0.5 }\n'
)
EVENTS = "corner,start,end,normal_speed,impulse,peak_force,largest_depth\nll,0.1,0.2,1,1,1,1e-6\n"
POINTS = "drive.speed_rpm,friction.coefficient\n100,0.1\n200,0.2\n"
BASELINE = (Path(str(files("comparison"))).parent / "sixbar-baseline.toml").read_text()[:20_000]
TABLE, COMPARE = "", "compare plain.csv sound.csv --out out"
FURTHER = "compare sound.csv sound.csv --finer-b sound.csv --out out"
TARGETS = {
    "scene.toml": (st.sampled_from(SHIPPED), "plan scene.toml"),
    "map.toml": (MAPPING, f"{COMPARE} --mapping map.toml"),
    "plain.events.csv": (EVENTS, COMPARE),
    # No list is run: there is no such quantity.
    "list.csv": (POINTS, "study sweep ideal --list list.csv --output none --out out"),
    "baseline.toml": (BASELINE, "gate --baseline baseline.toml"),
    "own.dat": (TABLE, "plot own.dat sound.csv --channels slider_x,time,slider_vx --out own.svg"),
    **{f"own.{end}": (TABLE, f"compare own.{end} sound.csv --out out") for end in ("csv", "mat", "parquet")},
    **{f"{kind}.csv": (TABLE, f"{FURTHER} --{kind}-a {kind}.csv") for kind in ("finer", "perturbed")},
}
"""File -> its sound text, and the command that is given when that is damaged."""


@pytest.fixture
def text(make_table):
    """The text of a table, which stands here whole as plain.csv, and with more samples as sound.csv."""
    write(make_table(), "sound.csv")
    text = make_table().frame.iloc[::20, :4].to_csv(index=False)
    Path("plain.csv").write_text(text)
    return text


@pytest.mark.parametrize("name", TARGETS)
@costly
@given(data=st.data())
def test_damaged_files(name, data, text):
    sound, command = TARGETS[name]
    sound = st.just(sound or text) if isinstance(sound, str) else sound
    Path(name).write_bytes(data.draw(damaged(sound)))
    held(command.split())
    Path(name).unlink()


@many
@given(values=st.dictionaries(st.sampled_from(KEYS), ODD, min_size=1, max_size=3))
def test_values_on_the_command_line(values):
    held(["plan", "both-clearances", *(f"--set={key}={value}" for key, value in values.items())])
