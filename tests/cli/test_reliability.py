"""Reliability of tables of other programs, of motions whose errors, and so R by the paper, are known."""

import numpy as np
import pytest
from scipy.io import savemat
from scipy.stats import norm

CYCLE = 0.5  # of the crank, s
TIME = np.arange(1001) * 1e-3  # two cycles
PHASE = 4 * np.pi * TIME
Y, VY, AY = 0.1 * np.sin(PHASE), 0.4 * np.pi * np.cos(PHASE), -1.6 * np.pi**2 * np.sin(PHASE)
RAMP = np.append(100 * np.mod(TIME[:-1], CYCLE) / CYCLE, 100)  # error of acceleration, m/s^2, in every cycle
COLUMNS = {"t": TIME, "y": 1e3 * (Y + 5e-5), "acc": 1e3 * (AY + RAMP)}
MAPPING = """
columns.t = { channel = "time", unit = "s" }
a.y = { channel = "slider_y", unit = "mm" }
a.acc = { channel = "slider_ay", unit = "mm/s^2" }
b.down = { channel = "slider_y", unit = "mm", sign = -1 }
ideal.y = { channel = "slider_y", unit = "m" }
ideal.v = { channel = "slider_vy", unit = "m/s" }
ideal.acc = { channel = "slider_ay", unit = "m/s^2" }
"""
COMMAND = "reliability a.csv b.tab --ideal ideal.csv --mapping names.toml"
FINER = ["--period", CYCLE, "--finer-a", "a.csv", "--finer-b"]


def expected(limits, mean, deviation):
    """Eqs. 35-37."""
    lower, upper = limits
    return norm.cdf(((upper + lower) / 2 - mean) / np.hypot((upper - lower) / 6, deviation))


def write(sixbar, name, error):
    pairs = zip(TIME.tolist(), (-1e3 * (Y + error)).tolist(), strict=True)
    sixbar.write(name, "Run 7\nt\tdown\n" + "".join(f"{t!r}\t{y!r}\n" for t, y in pairs))


@pytest.fixture
def tables(sixbar):
    """One table is off by 50 um and the ramp, the other one, of positions alone, by 80 um."""
    sixbar.table("a.csv", **COLUMNS)
    write(sixbar, "b.tab", 8e-5)
    for name, time in (("ideal", TIME), ("late", TIME + 0.1)):
        sixbar.table(f"{name}.csv", t=time, y=Y, v=VY, acc=AY)
    sixbar.write("names.toml", MAPPING)
    return sixbar


def test_two_foreign_tables(tables):
    savemat(tables.folder / "a.mat", COLUMNS)
    process = tables(*COMMAND.replace("a.csv", "a.mat").split(), "--period", CYCLE, "--json", code=3)
    assert "Not computed: acceleration, where slider_ay is missing: b.tab." in process.err
    assert "The limits are those of scene 'paper'. The crank cycle takes 0.5 s." in process.err
    assert "Undecided: the numerical error of displacement is not known." in process.err
    numbers = tables.numbers
    assert (numbers["verdict"], numbers["period"]) == ("undecided", CYCLE)
    assert numbers["missing"] == {"velocity": ["a.mat", "b.tab"], "acceleration": ["b.tab"]}
    displacement, acceleration = numbers["quantities"].values()
    # Constant errors: nothing differs between cycles or samples. 1e-11: of round-off of 0.1 m, over 33 um.
    for label, error in (("a", 5e-5), ("b", 8e-5)):
        values, exact = displacement["models"][label], expected((0, 2e-4), error, 0)
        assert values["reliability"] == pytest.approx([exact] * 10, abs=1e-11)
        assert values["smallest_interval"] == pytest.approx([exact, exact], abs=1e-11)
        assert values["mean"] == pytest.approx([error] * 10, abs=1e-15)
    difference = expected((0, 2e-4), 5e-5, 0) - expected((0, 2e-4), 8e-5, 0)
    assert displacement["difference"] == pytest.approx(difference, abs=1e-11)
    # Uniformly distributed between the ends of a tenth of the ramp; the square, linear between 50 samples
    # there, is too large by a sixth of the square of a step.
    (values,), means = acceleration["models"].values(), 5 + 10 * np.arange(10)
    assert values["mean"][:9] == pytest.approx(means[:9], rel=1e-9)
    assert values["deviation"][:9] == pytest.approx([10 * np.sqrt(1 / 12 + 1 / 50**2 / 6)] * 9, rel=1e-9)
    exact = expected((0, 150), means, 10 / np.sqrt(12))
    # The square moves R by 1e-5 of it at most; the fall at the end of the first cycle is between two samples,
    # half a step of 50, which every second sample tells.
    assert values["reliability"][:9] == pytest.approx(exact[:9], abs=1e-4)
    assert values["reliability"][9] == pytest.approx(exact[9], abs=2e-2)
    assert np.subtract(values["high"], values["low"])[:9].max() < 1e-2
    assert "a.mat: too few samples: with every second one R changes by " in process.err
    assert (values["smallest_at_deg"], acceleration["angle_deg"][9]) == (360, 360)


def test_an_ideal_table_has_the_rules_of_the_program_that_wrote_it(tables):
    """A table without rules of its own takes those of its program, here of the second."""
    tables.write("names.toml", MAPPING[: MAPPING.index("ideal.y")])
    write(tables, "ideal.tab", 0.0)
    tables(*COMMAND.replace("ideal.csv", "ideal.tab").split(), "--period", CYCLE, "--json", code=3)
    models = tables.numbers["quantities"]["displacement"]["models"]
    for label, error in (("a", 5e-5), ("b", 8e-5)):
        # Round-off of 0.1 m over 33 um
        assert models[label]["reliability"] == pytest.approx([expected((0, 2e-4), error, 0)] * 10, abs=1e-11)


@pytest.mark.parametrize(
    ("change", "code", "verdict"),
    # The change enlarges the error of the first cycle and lessens that of the second. The interval, by
    # Student's distribution with one degree of freedom, is +- 12.7 of that, here of R 4.9e-4 and 4.9e-2.
    [(1e-8, 0, "agree"), (1e-6, 3, "undecided")],
)
def test_the_difference_by_finer_runs_and_cycles(change, code, verdict, tables):
    write(tables, "b.tab", 5e-5 + change * np.where(TIME < CYCLE, 1, -1))
    tables(*COMMAND.split(), *FINER, "b.tab", "--json", code=code)
    displacement = tables.numbers["quantities"]["displacement"]
    half_width = norm.pdf(1.5) * 12.706 * change / (1e-4 / 3)
    # 10 %: the sample at the end of the first cycle belongs to both of its sides.
    assert (displacement["verdict"], displacement["half_width"]) == (
        verdict,
        pytest.approx(half_width, rel=0.1),
    )


def test_exit_codes_of_a_known_and_an_unknown_difference(tables):
    process = tables(*COMMAND.split(), *FINER, "b.tab", code=1)
    assert any(row.split()[::3] == ["displacement", "differ"] and " 2.1e-01 " in row for row in process.lines)
    tables(*COMMAND.split(), "--period", CYCLE, "--allow-indeterminate")


def test_limits_and_angles_of_one_table(tables):
    command = "reliability a.csv --ideal ideal.csv --mapping names.toml --period 0.5 -v"
    process = tables(*command.split(), "--limits", "displacement=-1e-4,3e-4")
    exact = expected((-1e-4, 3e-4), 5e-5, 0)
    assert process.out.count(f" {exact:.5f}") == 3 * (10 + 1)  # R and its ends at each angle and the least
    assert "except of displacement, as given" in process.out
    angles = [line.split()[2] for line in process.lines if line.startswith("acceleration a")]
    assert angles == [*(f"{36 * (k + 1)}" for k in range(10)), "360"]


def test_the_scene_of_a_run_gives_limits_and_period(sixbar):
    head = '[scene]\nextends = "ideal"\n[drive]\nspeed_rpm = 120\ncycles = 1\n'
    sixbar.write("mine.toml", head + "[reliability]\nbins = 4\n[reliability.velocity]\nupper = 0.3\n")
    sixbar("run", "mine.toml", "--model", "reference", "--out", "mine.csv", "-q")
    process = sixbar(*["reliability", "mine.csv", "--ideal", "mine.csv", "--json"])
    assert "those of scene 'mine'. The crank cycle takes 0.5 s." in process.err
    velocity = sixbar.numbers["quantities"]["velocity"]
    assert (velocity["upper_limit"], velocity["angle_deg"]) == (0.3, [90, 180, 270, 360])
    assert velocity["models"]["a"]["smallest"] == pytest.approx(norm.cdf(3), abs=1e-12)


@pytest.mark.parametrize(
    ("rows", "code", "message"),
    [
        (slice(501), 3, "only its first 0.5 s count, where ideal.csv ends"),
        (slice(521), 3, "ideal.csv: its last 0.02 s do not count: they do not fill one of the 10 intervals"),
        (slice(None, None, 40), 3, "ideal.csv: too few samples"),
        (
            [*range(300), *range(350, 1001)],
            3,
            "ideal.csv has no row between 0.299 and 0.35 s: 50 rows are missing",
        ),
    ],
)
def test_warnings_tell_what_limits_the_result(rows, code, message, tables):
    tables.table("ideal.csv", t=TIME[rows], y=Y[rows], v=VY[rows], acc=AY[rows])
    assert message in tables(*COMMAND.split(), "--period", CYCLE, code=code).err


REFUSALS = {
    COMMAND: "period|--period or --scene",
    f"{COMMAND} --period 0": "period = 0.0 must be > 0",
    f"{COMMAND} --period 1e-3": "a.csv|interval of the crank cycle, 0.0001 s|a sample",
    f"{COMMAND} --period 11": "a.csv|interval of the crank cycle, 1.1 s|the 1 s that count",
    f"{COMMAND} --period 0.5 --scene ideal": "scene 'ideal'|0.4 s|0.5 s",
    f"{COMMAND} --period 0.5 --limits velocity=1": "'velocity=1'|two numbers",
    f"{COMMAND} --period 0.5 --limits speed=0,1": "reliability.speed",
    f"{COMMAND.replace('ideal.csv', 'late.csv')} --period 0.5": "late.csv|starts at 0.1 s|0 s",
    "reliability a.csv --mapping names.toml": "--ideal",
    "reliability a.csv --ideal ideal.csv --finer-a a.csv": "finer|two tables",
    "reliability t.csv --ideal t.csv --period 1": "t.csv|none of slider_y|--mapping",
}


@pytest.mark.parametrize("command", REFUSALS)
def test_a_mistake_is_refused_by_its_rule(command, tables):
    tables.table("t.csv", time=TIME, slider_x=Y)
    tables.refusal(command, *REFUSALS[command].split("|"))
