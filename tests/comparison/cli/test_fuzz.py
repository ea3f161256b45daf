"""Any input: a verdict or one line on stderr, never a traceback, an internal error or a raw escape.

HYPOTHESIS_EXAMPLES is the number of examples of each test (300), a third of it where a page is written.
"""

import os
from importlib.resources import files
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from comparison.cli import main
from comparison.scene import shipped_scenes
from comparison.scene.keys import scene_keys
from comparison.tables.table_files import write

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("empty_folder")]
EXAMPLES = int(os.environ.get("HYPOTHESIS_EXAMPLES", "300"))
all_examples = settings(
    max_examples=EXAMPLES,
    print_blob=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
fewer_examples = settings(all_examples, max_examples=EXAMPLES // 3)


@pytest.fixture
def check(capsys):
    def run(*arguments):
        code = main([*arguments])
        output = capsys.readouterr()
        assert code in (0, 1, 2, 3), (code, output.err)
        assert not [
            word for word in ("Traceback", "internal error", "\x1b") if word in output.out + output.err
        ]
        assert code != 2 or all(line.startswith("sixbar: ") for line in output.err.splitlines() or [""])

    return run


PACKAGE = Path(str(files("comparison")))
SHIPPED = [
    (PACKAGE / "scene" / "shipped" / f"{name}.toml").read_text() for name in ("paper", *shipped_scenes())
]
ODDITIES = st.sampled_from(
    [
        "1e308", "-1e308", "1e-320", "nan", "inf", "-0.0", "9" * 5000, "true", "[]", "[[]]", "{}", '""',
        "'\x1b[31m'", '"\\u0000"', "1979-05-27", "0x7fffffffffffffff", "[" * 300 + "]" * 300, "{a.b.c = 1}",
        '"~nosuchuser/x"', '"paper"', '"../../etc"', "-9223372036854775809", '"' + "a" * 300 + '"',
    ]
)  # fmt: skip


@st.composite
def damage(draw, texts):
    """A text with other bytes, with lines repeated, dropped or moved, with an odd number, or cut short."""
    content = draw(texts).encode()
    for _ in range(draw(st.integers(1, 4))):
        lines, at = content.split(b"\n"), draw(st.integers(0, len(content)))
        row = draw(st.integers(0, len(lines) - 1))
        head, equals, tail = lines[row].rpartition(b"=")
        oddity = (head + equals if head else tail + b",") + draw(ODDITIES).encode()
        rows = draw(st.sampled_from([None, b"", [], [lines[row]] * 2, [lines[0], lines[row]], [oddity]]))
        if rows is None:
            content = content[:at] + draw(st.binary(max_size=6)) + content[at + draw(st.integers(0, 1)) :]
        else:
            content = b"\n".join([*lines[:row], *rows, *lines[row + 1 :]]) if rows != b"" else content[:at]
    return content


MAPPING = (
    'compare = ["slider_x"]\n[columns]\n"time" = { channel = "time", unit = "s" }\n'
    '"slider_x" = { channel = "slider_x", unit = "m", sign = -1, offset = 0.5 }\n'
)
EVENTS = "corner,start,end,normal_speed,impulse,peak_force,largest_depth\nll,0.1,0.2,1,1,1,1e-6\n"
BASELINE = (PACKAGE.parent / "sixbar-baseline.toml").read_text()[:20_000]
COMPARE = "compare plain.csv sound.csv --out out"
COMPARE_RUNS = "compare sound.csv sound.csv --finer-b sound.csv --out out"
TARGETS = {  # file: its sound texts, none for a table, and the command that reads it when it is damaged
    "scene.toml": (SHIPPED, "plan scene.toml"),
    "map.toml": ([MAPPING], f"{COMPARE} --mapping map.toml"),
    "plain.events.csv": ([EVENTS], COMPARE),
    # No list is run: there is no such quantity.
    "list.csv": (["drive.cycles,drive.speed_rpm\n1,2\n"], "study sweep ideal --list list.csv --output none"),
    "baseline.toml": ([BASELINE], "gate --baseline baseline.toml"),
    "own.dat": ([], "plot own.dat sound.csv --channels slider_x,time,slider_vx --out own.svg"),
    **{f"own.{end}": ([], f"compare own.{end} sound.csv --out out") for end in ("csv", "mat", "parquet")},
    **{f"{kind}.csv": ([], f"{COMPARE_RUNS} --{kind}-a {kind}.csv") for kind in ("finer", "perturbed")},
}


@pytest.mark.parametrize("name", TARGETS)
@fewer_examples
@given(data=st.data())
def test_damaged_files(name, data, make_table, check):
    (texts, command), path = TARGETS[name], Path(name)
    if not Path("sound.csv").exists():  # with more samples than plain.csv, which is sound too
        write(make_table(), "sound.csv")
        Path("plain.csv").write_text(make_table().frame.iloc[::20, :4].to_csv(index=False))
    path.write_bytes(data.draw(damage(st.sampled_from(texts or [Path("plain.csv").read_text()]))))
    check(*command.split())
    path.unlink()


KEYS = [*(key.name for key in scene_keys()), "scene.extends", "solver.adams"]


@all_examples
@given(values=st.dictionaries(st.sampled_from(KEYS), ODDITIES, min_size=1, max_size=3))
def test_values_on_the_command_line(values, check):
    check("plan", "both-clearances", *(f"--set={key}={value}" for key, value in values.items()))
