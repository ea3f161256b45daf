"""``sixbar compare --suggest-mapping``: what it writes is right, says what it rests on, and can be used."""

import tomllib

import numpy as np
import pandas as pd
import pytest

POSITIONS = {"slider_x": "cm.x", "slider_y": "cm.y", "slider_angle": "rot"}
RATES = {"slider_vx": "vel.x", "slider_vy": "vel.y", "slider_omega": "omega"}
ALL = POSITIONS | RATES
NUMBERS = ("max_difference", "worst_difference", "worst_time", "rms_difference", "scale")


def rules(sixbar, name):
    return tomllib.loads(sixbar.text(name))


def adams(sixbar, name, columns):
    """A table as Adams writes it: a title, quoted names, tabs."""
    head = "Adams table: press, last run\n" + "\t".join(f'"{column}"' for column in columns) + "\n"
    rows = ("\t".join(repr(float(v)) for v in row) for row in zip(*columns.values(), strict=True))
    return sixbar.write(name, head + "\n".join([*rows, ""]))


def in_adams_units(frame):
    factors = {name: 180 / np.pi if name in ("slider_angle", "slider_omega") else 1e3 for name in ALL}
    named = {name: f".press.slider.{own}" for name, own in ALL.items()}
    return {
        "TIME": frame.time * 1e3,
        **{named[name]: frame[name] * factors[name] for name in ALL},
        ".press.MEA_7": 1e3 + np.cos(900 * frame.time),
    }


@pytest.fixture(scope="module")
def written(make):
    """Two runs of the reference with other friction, the second one also as Adams would write it."""
    sixbar = make()
    for name, samples, friction in (("ours", 1000, 0.15), ("other", 750, 0.16)):
        changes = {"drive.cycles": 0.5, "output.samples_per_cycle": samples, "friction.coefficient": friction}
        options = [word for key, value in changes.items() for word in ("--set", f"{key}={value}")]
        sixbar("run", "150rpm-0.2mm", "--model", "reference", "--out", f"{name}.csv", "-q", *options)
    other = pd.read_csv(sixbar.folder / "other.csv")
    adams(sixbar, "other.tab", in_adams_units(other))
    (sixbar.folder / "other.json").unlink()  # with two recorded scenes their clearance is the scale
    return sixbar


def test_a_table_of_adams_is_compared_as_the_models_own(written):
    """By the mapping as it is written: the same verdicts, differences, peaks and instants."""
    sixbar, out = written, "suggested.toml"
    said = sixbar("compare", "--suggest-mapping", "ours.csv", "other.tab", "--out", out, "--json").err
    assert said.splitlines()[-1] == out
    # The two chatter with angular velocities that are 80 % (RMS) apart.
    near = [name for name in ALL if name != "slider_omega"]
    assert {rule["channel"] for rule in sixbar.numbers} == {"time", *near}
    options = ["--tolerance", "0.01", "--json"]
    sixbar("compare", "ours.csv", "other.csv", "--channels", ",".join(near), *options, code=1)
    expected = sixbar.numbers["channels"]
    warned = sixbar("compare", "ours.csv", "other.tab", "--mapping", out, *options, code=1).err
    assert ".press.MEA_7" in warned  # it is not compared, and that is said
    converted = sixbar.numbers["channels"]
    assert list(converted) == list(expected) == near
    for name, channel in converted.items():
        own = expected[name]
        assert channel["verdict"] == own["verdict"]
        if name == "slider_angle":  # interpolated without its rate
            continue
        # A conversion rounds at 2e-16 of sizes up to 0.6 m and 8 rad/s; the smallest RMS is 1e-7 of them.
        assert [channel[key] for key in NUMBERS] == pytest.approx([own[key] for key in NUMBERS], rel=1e-7)


TIME = np.arange(801) * 1e-3
MOTION = {
    "slider_x": 1e-4 * np.sin(9 * TIME) - 0.55,
    "slider_y": 0.19 + 0.01 * np.cos(7 * TIME),
    "slider_angle": 1e-3 * np.sin(5 * TIME),
}
UNITS = {
    "ms mm deg": ("TIME,X,Y,PHI", (1e3, 1e3, 1e3, 180 / np.pi)),
    "s cm rev": ("t,x,y,theta", (1, 100, 100, 1 / (2 * np.pi))),
    "stated": ("Time [us],X [in],Y [in],ROT [deg]", (1e6, 1 / 0.0254, 1 / 0.0254, 180 / np.pi)),
    "of no name": ("t,q1,q2,q3", (1, 1e3, 1e3, 180 / np.pi)),
}


def ours(sixbar):
    """A table of this project: a record stands beside it."""
    sixbar.write("ours.json", "{}")
    return sixbar.table("ours.csv", time=TIME, **MOTION)


@pytest.mark.parametrize("head", UNITS)
@pytest.mark.parametrize("order", [1, -1])
def test_units_follow_from_the_data_whichever_table_is_known(head, order, sixbar):
    names, factors = UNITS[head]
    columns = (np.asarray(column)[::4] for column in (TIME, *MOTION.values()))
    scaled = [column * factor for column, factor in zip(columns, factors, strict=True)]
    sixbar.table("b.csv", **dict(zip(names.split(","), scaled, strict=True)))
    files = [ours(sixbar), "b.csv"][::order]
    sixbar("compare", "--suggest-mapping", *files, "--out", "m.toml")
    sixbar("compare", *files, "--mapping", "m.toml", "--tolerance", "1e-9", "--absolute", "--json")
    assert list(sixbar.numbers["channels"]) == list(MOTION)


def test_a_table_of_this_project_is_in_seconds_however_long_the_other_one_is(sixbar):
    half = TIME[:401]
    sixbar.table("ours.csv", time=half, slider_y=MOTION["slider_y"][:401])
    sixbar.write("ours.json", '{"model": "mine"}')
    sixbar.table("b.csv", TIME=TIME * 1e3, q=MOTION["slider_y"] * 1e3)
    for files in (("ours.csv", "b.csv"), ("b.csv", "ours.csv")):
        sixbar("compare", "--suggest-mapping", *files, "--out", f"{files[0]}.toml")
        written = rules(sixbar, f"{files[0]}.toml")
        (side,) = {"a", "b"} & written.keys()  # the other table needs no rule
        assert [rule["unit"] for rule in written[side].values()] == ["ms", "mm"]


OPEN = {
    "another motion": {"q1": np.sin(31 * TIME), "q2": np.cos(900 * TIME)},
    "a constant": {"force_1": 0 * TIME + 3, "q2": 0 * TIME},
    "a name that the data contradict": {"q1": TIME, "slider.x": np.cos(20 * TIME)},
    "an offset": {"X": -(MOTION["slider_x"] + 0.55) * 1e3},
}


@pytest.mark.parametrize("case", OPEN)
def test_what_the_data_do_not_show_is_listed(case, sixbar):
    adams(sixbar, "b.tab", {"TIME": TIME * 1e3, **OPEN[case]})
    ended = sixbar("compare", "--suggest-mapping", ours(sixbar), "b.tab")
    assert ended.lines[-1] == "b.mapping.toml"
    written = rules(sixbar, "b.mapping.toml")
    assert ("compare" not in written, set(written["b"])) == (True, {"TIME"})
    left = sixbar.text("b.mapping.toml").partition("# Not assigned")[2]
    assert all(name in left for name in (*OPEN[case], *MOTION))
    sixbar.refused("compare --suggest-mapping ours.csv b.tab", "b.mapping.toml", "not overwritten")


@pytest.mark.parametrize("names", ["t,x,y,phi t,px,py,phi_2", "time,x,y,q time,x,y,q", "t,a,b,c t,d,e,f"])
def test_two_tables_without_units_are_compared_as_numbers(names, sixbar):
    """Of channels of one's own, by the mapping as it is written; what differs is found."""
    for name, own, change in zip(["a.csv", "b.csv"], names.split(), [0, 1e-3], strict=True):
        data = dict(zip(own.split(","), (TIME, *MOTION.values()), strict=True))
        data[own.split(",")[-1]] = data[own.split(",")[-1]] * (1 + change)
        sixbar.table(name, **data)
    sixbar("compare", "--suggest-mapping", "a.csv", "b.csv")
    command = "compare a.csv b.csv --mapping b.mapping.toml --tolerance 1e-4 --json"
    sixbar(*command.split(), code=1)
    channels = sixbar.numbers["channels"]
    assert [channel["verdict"] for channel in channels.values()] == ["agree", "agree", "differ"]
    assert list(channels) == names.split()[0].split(",")[1:]


def test_a_name_of_the_press_without_a_unit_is_in_si(sixbar):
    """As without a mapping; the other table's unit follows from it."""
    sixbar.table("a.csv", t=TIME, y=MOTION["slider_y"] * 1e3)
    sixbar.table("b.csv", t=TIME, slider_y=MOTION["slider_y"])
    sixbar("compare", "--suggest-mapping", "a.csv", "b.csv", "--json")
    guess = next(guess for guess in sixbar.numbers if guess["column"] == "y")
    assert (guess["channel"], guess["unit"]) == ("slider_y", "mm")


def test_a_table_whose_dialect_is_stated_is_suggested_with_it(sixbar):
    rows = "".join(f"{n};{n % 7 + 1}.500\n" for n in range(50))
    sixbar.write("b.csv", "time;q\n" + rows)
    sixbar.write("dialect.toml", '[dialect.b]\ndecimal = "."\n')
    sixbar.table("a.csv", time=np.arange(50), p=np.arange(50) % 7 + 1.5)
    sixbar.refused("compare --suggest-mapping a.csv b.csv", "state decimal", "in [dialect] of a mapping")
    sixbar("compare", "--suggest-mapping", "a.csv", "b.csv", "--mapping", "dialect.toml")
    command = "compare a.csv b.csv --mapping b.mapping.toml --tolerance 1e-9 --json"
    sixbar(*command.split())
    assert list(sixbar.numbers["channels"]) == ["p"]
