"""``sixbar compare --suggest-mapping``: the mapping is right, states its evidence, and can be used."""

import tomllib

import numpy as np
import pytest

from sixbar import compare

TIME = np.arange(801) * 1e-3
MOTION = {
    "slider_x": 1e-4 * np.sin(9 * TIME) - 0.55,
    "slider_y": 0.19 + 0.01 * np.cos(7 * TIME),
    "slider_angle": 1e-3 * np.sin(5 * TIME),
    "slider_vx": 9e-4 * np.cos(9 * TIME),
}
UNITS = {
    "ms mm deg": ("TIME,X,Y,PHI,VX", (1e3, 1e3, 1e3, 180 / np.pi, -1e3)),
    "stated": (
        "Time [us],X [in],Y [in],ROT [deg],VX [in/s]",
        (1e6, *[1 / 0.0254] * 2, 180 / np.pi, 1 / 0.0254),
    ),
    "of no name": ("t,q1,q2,q3,q4", (1, 1e3, 1e3, 180 / np.pi, 1e3)),
}


def project_table(sixbar):
    """A table of this project: a record stands beside it."""
    sixbar.write("ours.json", "{}")
    return sixbar.table("ours.csv", time=TIME, **MOTION)


@pytest.mark.parametrize("head", UNITS)
@pytest.mark.parametrize("order", [1, -1])
def test_units_follow_from_the_data_whichever_table_is_known(head, order, sixbar):
    names, factors = UNITS[head]
    columns = (np.asarray(column)[::4] for column in (TIME, *MOTION.values()))
    values = [column * factor for column, factor in zip(columns, factors, strict=True)]
    sixbar.table("b.csv", **dict(zip(names.split(","), values, strict=True)))
    files = [project_table(sixbar), "b.csv"][::order]
    sixbar("compare", "--suggest-mapping", *files, "--out", "m.toml")
    first, second, mapping = (sixbar.folder / name for name in (*files, "m.toml"))
    result = compare(first, second, mapping=mapping, tolerance=1e-9, absolute=True)
    assert (result.verdict, [*result.channels]) == ("agree", [*MOTION])


def test_a_table_of_this_project_is_in_seconds_however_long_the_other_one_is(sixbar):
    y = MOTION["slider_y"]
    sixbar.table("ours.csv", time=TIME[:401], slider_y=y[:401])
    sixbar.write("ours.json", '{"model": "mine"}')
    sixbar.table("b.csv", TIME=TIME * 1e3, q=y * 1e3)
    for files in (("ours.csv", "b.csv"), ("b.csv", "ours.csv")):
        sixbar("compare", "--suggest-mapping", *files, "--out", f"{files[0]}.toml")
        mapping = tomllib.loads(sixbar.text(f"{files[0]}.toml"))
        (side,) = {"a", "b"} & mapping.keys()  # the other table needs no rule
        assert [rule["unit"] for rule in mapping[side].values()] == ["ms", "mm"]


CASES = {
    "another motion": {"q1": np.sin(31 * TIME), "q2": np.cos(900 * TIME)},
    "a constant": {"force_1": 0 * TIME + 3, "q2": 0 * TIME},
    "a name that the data contradict": {"q1": TIME, "slider.x": np.cos(20 * TIME)},
    "an offset": {"X": -(MOTION["slider_x"] + 0.55) * 1e3},
}


@pytest.mark.parametrize("case", CASES)
def test_what_the_data_do_not_show_is_listed(case, sixbar):
    sixbar.table("b.tab", TIME=TIME * 1e3, **CASES[case])
    process = sixbar("compare", "--suggest-mapping", project_table(sixbar), "b.tab")
    assert process.lines[-1] == "b.mapping.toml"
    mapping = tomllib.loads(sixbar.text("b.mapping.toml"))
    assert ("compare" not in mapping, set(mapping["b"])) == (True, {"TIME"})
    rest = sixbar.text("b.mapping.toml").partition("# Not assigned")[2]
    assert all(name in rest for name in (*CASES[case], *MOTION))
    sixbar.refusal("compare --suggest-mapping ours.csv b.tab", "b.mapping.toml", "not overwritten")


@pytest.mark.parametrize("names", ["t,x,y,phi t,px,py,phi_2", "time,x,y,q time,x,y,q", "t,a,b,c t,d,e,f"])
def test_two_tables_without_units_are_compared_as_numbers(names, sixbar):
    """The mapping as written defines channels of its own; a difference is found."""
    for name, header, change in zip(["a.csv", "b.csv"], names.split(), [0, 1e-3], strict=True):
        x, y, angle, _ = MOTION.values()
        columns = (TIME, x, y, angle * (1 + change))
        sixbar.table(name, **dict(zip(header.split(","), columns, strict=True)))
    sixbar("compare", "--suggest-mapping", "a.csv", "b.csv")
    a, b, mapping = (sixbar.folder / name for name in ("a.csv", "b.csv", "b.mapping.toml"))
    channels = compare(a, b, mapping=mapping, tolerance=1e-4).channels
    assert [channel.verdict for channel in channels.values()] == ["agree", "agree", "differ"]
    assert [*channels] == names.split()[0].split(",")[1:]


@pytest.mark.parametrize(("name", "increases"), [("t_ms", True), ("mark", False)])
def test_a_time_of_another_name_is_the_first_column_that_increases(sixbar, name, increases):
    """Without such a column nothing is assigned."""
    rows = "".join(f"{k if increases else k % 2},{k % 7}\n" for k in range(50))
    for table in "ab":
        sixbar.write(f"{table}.csv", f"{name},x\n{rows}")
    sixbar("compare", "--suggest-mapping", "a.csv", "b.csv")
    mapping = tomllib.loads(sixbar.text("b.mapping.toml"))
    assert (mapping["a"][name]["channel"] == "time") if increases else "a" not in mapping


def test_a_table_whose_dialect_is_stated_is_suggested_with_it(sixbar):
    rows = "".join(f"{n};{n % 7 + 1}.500\n" for n in range(50))
    sixbar.write("b.csv", "time;q\n" + rows)
    sixbar.write("dialect.toml", '[dialect.b]\ndecimal = "."\n')
    sixbar.table("a.csv", time=np.arange(50), p=np.arange(50) % 7 + 1.5)
    sixbar.refusal("compare --suggest-mapping a.csv b.csv", "state decimal", "in [dialect] of a mapping")
    sixbar("compare", "--suggest-mapping", "a.csv", "b.csv", "--mapping", "dialect.toml")
    a, b, mapping = (sixbar.folder / name for name in ("a.csv", "b.csv", "b.mapping.toml"))
    result = compare(a, b, mapping=mapping, tolerance=1e-9)
    assert (result.verdict, [*result.channels]) == ("agree", ["p"])
