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
many = settings(
    max_examples=EXAMPLES,
    print_blob=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
costly = settings(many, max_examples=EXAMPLES // 3)


@pytest.fixture
def held(capsys):
    def run(*arguments):
        code = main([*arguments])
        said = capsys.readouterr()
        assert code in (0, 1, 2, 3), (code, said.err)
        assert not [
            never for never in ("Traceback", "internal error", "\x1b") if never in said.out + said.err
        ]
        assert code != 2 or all(line.startswith("sixbar: ") for line in said.err.splitlines() or [""])

    return run


PACKAGE = Path(str(files("comparison")))
SHIPPED = [
    (PACKAGE / "scene" / "shipped" / f"{name}.toml").read_text() for name in ("paper", *shipped_scenes())
]
ODD = st.sampled_from(
    [
        "1e308", "-1e308", "1e-320", "nan", "inf", "-0.0", "9" * 5000, "true", "[]", "[[]]", "{}", '""',
        "'\x1b[31m'", '"\\u0000"', "1979-05-27", "0x7fffffffffffffff", "[" * 300 + "]" * 300, "{a.b.c = 1}",
        '"~nosuchuser/x"', '"paper"', '"../../etc"', "-9223372036854775809", '"' + "a" * 300 + '"',
    ]
)  # fmt: skip


@st.composite
def damaged(draw, texts):
    """A text with bytes changed, lines repeated, dropped or moved, a number that is odd, or cut."""
    content = draw(texts).encode()
    for _ in range(draw(st.integers(1, 4))):
        lines, at = content.split(b"\n"), draw(st.integers(0, len(content)))
        row = draw(st.integers(0, len(lines) - 1))
        head, equals, tail = lines[row].rpartition(b"=")
        odd = (head + equals if head else tail + b",") + draw(ODD).encode()
        changed = draw(st.sampled_from([None, b"", [], [lines[row]] * 2, [lines[0], lines[row]], [odd]]))
        if changed is None:
            content = content[:at] + draw(st.binary(max_size=6)) + content[at + draw(st.integers(0, 1)) :]
        else:
            content = (
                b"\n".join([*lines[:row], *changed, *lines[row + 1 :]]) if changed != b"" else content[:at]
            )
    return content


MAPPING = (
    'compare = ["slider_x"]\n[columns]\n"time" = { channel = "time", unit = "s" }\n'
    '"slider_x" = { channel = "slider_x", unit = "m", sign = -1, offset = 0.5 }\n'
)
EVENTS = "corner,start,end,normal_speed,impulse,peak_force,largest_depth\nll,0.1,0.2,1,1,1,1e-6\n"
BASELINE = (PACKAGE.parent / "sixbar-baseline.toml").read_text()[:20_000]
COMPARE = "compare plain.csv sound.csv --out out"
FURTHER = "compare sound.csv sound.csv --finer-b sound.csv --out out"
TARGETS = {  # file: its sound text, else that of a table, and the command that is given when it is damaged
    "scene.toml": (SHIPPED, "plan scene.toml"),
    "map.toml": ([MAPPING], f"{COMPARE} --mapping map.toml"),
    "plain.events.csv": ([EVENTS], COMPARE),
    # No list is run: there is no such quantity.
    "list.csv": (["drive.cycles,drive.speed_rpm\n1,2\n"], "study sweep ideal --list list.csv --output none"),
    "baseline.toml": ([BASELINE], "gate --baseline baseline.toml"),
    "own.dat": ([], "plot own.dat sound.csv --channels slider_x,time,slider_vx --out own.svg"),
    **{f"own.{end}": ([], f"compare own.{end} sound.csv --out out") for end in ("csv", "mat", "parquet")},
    **{f"{kind}.csv": ([], f"{FURTHER} --{kind}-a {kind}.csv") for kind in ("finer", "perturbed")},
}


@pytest.mark.parametrize("name", TARGETS)
@costly
@given(data=st.data())
def test_damaged_files(name, data, make_table, held):
    (texts, command), path = TARGETS[name], Path(name)
    if not Path("sound.csv").exists():  # with more samples than the table that stands whole as plain.csv
        write(make_table(), "sound.csv")
        Path("plain.csv").write_text(make_table().frame.iloc[::20, :4].to_csv(index=False))
    path.write_bytes(data.draw(damaged(st.sampled_from(texts or [Path("plain.csv").read_text()]))))
    held(*command.split())
    path.unlink()


KEYS = [*(key.name for key in scene_keys()), "scene.extends", "solver.adams"]


@many
@given(values=st.dictionaries(st.sampled_from(KEYS), ODD, min_size=1, max_size=3))
def test_values_on_the_command_line(values, held):
    held("plan", "both-clearances", *(f"--set={key}={value}" for key, value in values.items()))
