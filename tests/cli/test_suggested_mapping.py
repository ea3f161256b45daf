"""``sixbar compare --suggest-mapping``: what it writes is right, says how sure it is, and can be used."""

import tomllib

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

POSITIONS = {"slider_x": "cm.x", "slider_y": "cm.y", "slider_angle": "rot"}
RATES = {"slider_vx": "vel.x", "slider_vy": "vel.y", "slider_omega": "omega"}
MATLAB = dict(zip([*POSITIONS, *RATES], ("x", "y", "phi", "xd", "yd", "phid"), strict=True))
NUMBERS = ("max_difference", "worst_difference", "worst_time", "rms_difference", "scale")


def rules(sixbar, name):
    return tomllib.loads(sixbar.text(name))


def adams(sixbar, name, columns):
    """A table as Adams writes it: a title, quoted names, tabs."""
    head = "Adams table: press, last run\n" + "\t".join(f'"{column}"' for column in columns) + "\n"
    rows = ("\t".join(repr(float(v)) for v in row) for row in zip(*columns.values(), strict=True))
    return sixbar.write(name, head + "\n".join([*rows, ""]))


def in_adams_units(frame):
    factors = {name: 180 / np.pi if name in ("slider_angle", "slider_omega") else 1e3 for name in MATLAB}
    named = {name: f".press.slider.{own}" for name, own in (POSITIONS | RATES).items()}
    return {
        "TIME": frame.time * 1e3,
        **{named[name]: frame[name] * factors[name] for name in MATLAB},
        ".press.MEA_7": 1e3 + np.cos(900 * frame.time),
    }


@pytest.fixture(scope="module")
def written(make):
    """Two runs of the reference with other friction, and both as MATLAB and Adams would write them."""
    sixbar = make()
    for name, samples, friction in (("ours", 1000, 0.15), ("other", 750, 0.16)):
        changes = {"drive.cycles": 0.5, "output.samples_per_cycle": samples, "friction.coefficient": friction}
        options = [word for key, value in changes.items() for word in ("--set", f"{key}={value}")]
        sixbar("run", "150rpm-0.2mm", "--model", "reference", "--out", f"{name}.csv", "-q", *options)
    ours, other = (pd.read_csv(sixbar.folder / f"{name}.csv") for name in ("ours", "other"))
    columns = {own: ours[name].to_numpy() for name, own in MATLAB.items()}
    savemat(sixbar.folder / "ours.mat", {"t": ours.time.to_numpy(), **columns, "mass": 2.0})
    adams(sixbar, "other.tab", in_adams_units(other))
    (sixbar.folder / "other.json").unlink()  # with two recorded scenes their clearance is the scale
    return sixbar


@pytest.mark.parametrize(("first", "sureness"), [("ours.mat", "likely"), ("ours.csv", "sure")])
def test_tables_of_matlab_and_adams_are_compared_as_the_models_own(first, sureness, written):
    """By the mapping as it is written: the same verdicts, differences, peaks and instants."""
    sixbar, out = written, f"{sureness}.toml"
    said = sixbar("compare", "--suggest-mapping", first, "other.tab", "--out", out, "--json").err
    assert said.splitlines()[-1] == out
    guessed = [guess["sureness"] for guess in sixbar.numbers]
    # 7 columns of each foreign table; two models differ in angular velocity by more than is sure.
    assert len(guessed) == (14 if first.endswith("mat") else 7)
    assert {sureness} <= set(guessed) <= {sureness, "likely"}
    channels = ",".join(MATLAB)
    sixbar(
        "compare",
        "ours.csv",
        "other.csv",
        "--channels",
        channels,
        "--tolerance",
        "0.01",
        "--json",
        code=1,
    )
    expected = sixbar.numbers["channels"]
    command = ["compare", first, "other.tab", "--mapping", out, "--tolerance", "0.01", "--json"]
    warned = sixbar(*command, code=1).err
    assert ".press.MEA_7" in warned  # it is not compared, and that is said
    converted = sixbar.numbers["channels"]
    assert list(converted) == list(expected) == list(MATLAB)
    for name, channel in converted.items():
        own = expected[name]
        assert channel["verdict"] == own["verdict"]
        # A conversion rounds at 2e-16 of sizes up to 0.6 m and 8 rad/s; the smallest RMS is 1e-7 of them.
        assert [channel[key] for key in NUMBERS] == pytest.approx([own[key] for key in NUMBERS], rel=1e-7)
        for key in ("peak_difference", "peak_time_difference"):
            assert channel["information"][key] == pytest.approx(own["information"][key], rel=1e-7, abs=1e-15)


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


@pytest.mark.parametrize("other_sampling", [1, 4])
@pytest.mark.parametrize("head", UNITS)
@pytest.mark.parametrize("order", ["ours first", "ours second"])
def test_units_follow_from_the_data_whichever_table_is_known(head, other_sampling, order, sixbar):
    names, factors = UNITS[head]
    columns = [np.asarray(c)[::other_sampling] for c in (TIME, *MOTION.values())]
    scaled = [column * factor for column, factor in zip(columns, factors, strict=True)]
    sixbar.table("b.csv", **dict(zip(names.split(","), scaled, strict=True)))
    files = [ours(sixbar), "b.csv"][:: 1 if order == "ours first" else -1]
    sixbar("compare", "--suggest-mapping", *files, "--out", "m.toml")
    sixbar("compare", *files, "--mapping", "m.toml", "--tolerance", "1e-9", "--absolute", "--json")
    assert list(sixbar.numbers["channels"]) == list(MOTION)


def test_what_is_doubtful_is_a_comment_until_it_is_edited(sixbar):
    """To the left and from the guide: unit and sign follow from the data, the offset is written by hand."""
    columns = {"TIME": TIME, ".X": -(MOTION["slider_x"] + 0.55) * 1e3, ".q2": MOTION["slider_y"] * 1e3}
    adams(sixbar, "adams.tab", columns)
    ended = sixbar("compare", "--suggest-mapping", ours(sixbar), "adams.tab")
    assert ended.lines[-1] == "adams.mapping.toml"
    assert any(line.startswith("doubtful") and ".X is slider_x (mm)" in line for line in ended.lines)
    written = rules(sixbar, "adams.mapping.toml")
    assert (written["compare"], list(written["b"])) == (["slider_y"], ["TIME", ".q2"])
    command = ["compare", "ours.csv", "adams.tab", "--mapping", "adams.mapping.toml", "--tolerance", "1e-6"]
    sixbar(*command, "--json")
    assert list(sixbar.numbers["channels"]) == ["slider_y"]
    text = sixbar.text("adams.mapping.toml")
    for line in ('"slider_x",', '[b.".X"]', 'channel = "slider_x"', 'unit = "mm"', "sign = -1"):
        text = text.replace(f"# {line}", line, 1)
    sixbar.write("adams.mapping.toml", text.replace("sign = -1", "sign = -1\noffset = -550.0", 1))
    sixbar(*command, "--json")
    assert list(sixbar.numbers["channels"]) == ["slider_x", "slider_y"]
    sixbar.refused("compare --suggest-mapping ours.csv adams.tab", "adams.mapping.toml", "not overwritten")


rng = np.random.default_rng(7)
OPEN = {
    "another motion": {"q1": np.sin(31 * TIME), "q2": rng.normal(size=801)},
    "a constant": {"force_1": 0 * TIME + 3, "q2": 0 * TIME},
    "a name that the data contradict": {"q1": TIME, "slider.x": np.cos(20 * TIME)},
}


@pytest.mark.parametrize("case", OPEN)
def test_what_the_evidence_does_not_show_is_not_assigned(case, sixbar):
    adams(sixbar, "b.tab", {"TIME": TIME * 1e3, **OPEN[case]})
    sixbar("compare", "--suggest-mapping", ours(sixbar), "b.tab", "--json")
    assert "sure" not in {guess["sureness"] for guess in sixbar.numbers if guess["channel"] != "time"}
    written = rules(sixbar, "b.mapping.toml")
    assert "compare" not in written
    assert set(written.get("b", {})) <= {"TIME"}
    # Every column stands in the file: in a rule, in one that is commented out, or in the list of the others.
    assert all(name in sixbar.text("b.mapping.toml") for name in (*OPEN[case], *MOTION))


@pytest.mark.parametrize("names", ["t,x,y,phi t,px,py,phi_2", "time,x,y,q time,x,y,q", "t,a,b,c t,d,e,f"])
def test_two_tables_without_units_are_compared_as_numbers(names, sixbar):
    """Of channels of one's own, by the mapping as it is written; what differs is found."""
    for name, own, change in zip(["a.csv", "b.csv"], names.split(), [0, 1e-3], strict=True):
        data = dict(zip(own.split(","), (TIME, *MOTION.values()), strict=True))
        data[own.split(",")[-1]] = data[own.split(",")[-1]] * (1 + change)
        sixbar.table(name, **data)
    sixbar("compare", "--suggest-mapping", "a.csv", "b.csv", "--json")
    assert {guess["sureness"] for guess in sixbar.numbers if guess["channel"] != "time"} == {"likely"}
    sixbar(
        "compare", "a.csv", "b.csv", "--mapping", "b.mapping.toml", "--tolerance", "1e-4", "--json", code=1
    )
    channels = sixbar.numbers["channels"]
    assert [channel["verdict"] for channel in channels.values()] == ["agree", "agree", "differ"]
    assert list(channels) == names.split()[0].split(",")[1:]


def test_a_name_of_the_press_without_a_unit_is_in_si(sixbar):
    """As without a mapping; the other table's unit follows from it."""
    sixbar.table("a.csv", t=TIME, y=MOTION["slider_y"] * 1e3)
    sixbar.table("b.csv", t=TIME, slider_y=MOTION["slider_y"])
    sixbar("compare", "--suggest-mapping", "a.csv", "b.csv", "--json")
    guess = next(guess for guess in sixbar.numbers if guess["column"] == "y")
    assert (guess["channel"], guess["unit"], guess["sureness"]) == ("slider_y", "mm", "sure")


def test_a_table_over_the_crank_angle_has_no_time(sixbar):
    """Names and the units that are stated decide; the comparison is by the angle."""
    named = {
        "Crank.Angle [deg]": np.degrees(15 * TIME),
        "X [mm]": MOTION["slider_x"] * 1e3,
        "Y": MOTION["slider_y"],
    }
    sixbar.table("b.csv", **named)
    sixbar.table("a.csv", time=TIME, crank_angle=15 * TIME, crank_speed=0 * TIME + 15, **MOTION)
    sixbar.write("a.json", "{}")
    sixbar("compare", "--suggest-mapping", "a.csv", "b.csv", "--json")
    expected = {
        "Crank.Angle": ("crank_angle", "likely"),
        "X": ("slider_x", "likely"),
        "Y": ("slider_y", "doubtful"),
    }
    assert {guess["column"]: (guess["channel"], guess["sureness"]) for guess in sixbar.numbers} == expected


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


def test_what_is_left_over_is_named(sixbar):
    """Columns that resemble none, columns of text, and other contents of a file."""
    y = np.asarray(MOTION["slider_y"])
    savemat(
        sixbar.folder / "b.mat", {"t": TIME, "y": y, "noise": np.cos(900 * TIME), "mass": 2.0, "m": np.eye(3)}
    )
    ended = sixbar("compare", "--suggest-mapping", ours(sixbar), "b.mat", "--out", "m.toml")
    left = sixbar.text("m.toml").partition('# Not assigned of "b":')[2].replace("#", "").strip()
    assert left == "noise; mass (single number); m (matrix of 3 x 3)"
    assert "b: not assigned: noise, mass (single number), m (matrix of 3 x 3)" in ended.lines
