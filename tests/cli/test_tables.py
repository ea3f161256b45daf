"""Tables of other programs: what is read, in which units and by which names, and what is refused.

Three columns, time, x and v.
"""

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

TIME = np.arange(11) * 0.1
X, V = np.sin(TIME).round(6), np.cos(TIME).round(6)


def rows(separator=",", show="{:.6f}".format, columns=(TIME, X, V)):
    return "\n".join(separator.join(map(show, row)) for row in zip(*columns, strict=True)) + "\n"


def digits(value):
    return repr(float(value))


PLAIN = "time,x,v\n" + rows()
LAST = "0.841471"  # the last number of x
TEXTS = {
    "decimal-comma.csv": "time;x;v\n" + rows(";", lambda value: f"{value:.6f}".replace(".", ",")),
    "broken-title.csv": '"Press\nrun 7"\n' + PLAIN,
    "utf-16.csv": ("Größe\n" + PLAIN).encode("utf-16"),
}


def binary(name, folder):
    frame, path = pd.DataFrame({"time": TIME, "x": X, "v": V}), folder / name
    if path.suffix == ".parquet":
        frame.to_parquet(path)
    elif path.suffix == ".xlsx":
        pytest.importorskip("openpyxl")
        frame.to_excel(path, index=False)
    else:
        savemat(path, dict(frame.items()))
    return path.rename(folder / "recognised-by-its-content.dat").name


@pytest.mark.parametrize("name", [*TEXTS, "a.parquet", "a.mat", "a.xlsx"])
def test_every_number_of_a_dialect_is_read(name, sixbar):
    """The other table is off by 0.01 in its last number alone: all are compared, and that one differs."""
    name = sixbar.write(name, TEXTS[name]) if name in TEXTS else binary(name, sixbar.folder)
    sixbar.write("other.csv", PLAIN.replace(LAST, "0.851471"))
    sixbar("compare", name, "other.csv", "--tolerance", "1e-3", "--json", code=1)
    numbers = sixbar.numbers
    x, v = (numbers["channels"][channel] for channel in "xv")
    assert (numbers["samples"], list(numbers["channels"])) == (11, ["x", "v"])
    assert (x["verdict"], x["outside"], x["worst_time"]) == ("differ", 1, pytest.approx(1.0, rel=1e-15))
    # Both have six decimals: they round at 1e-16, and a digit that is lost is 1e-6.
    assert (x["max_difference"], v["max_difference"]) == pytest.approx((0.01, 0.0), abs=1e-9)


UNITS = {
    "time,x [mm],v (mm/s)\n": ((1, 1e3, 1e3), "time,x [m],v [m/s]\n"),
    "time,x,v\nms,in,cm/s\n": ((1e3, 1 / 0.0254, 100), "time,x [m],v [m/s]\n"),
    "time,x,v\n[s],[deg],[deg/s]\n": ((1, 180 / np.pi, 180 / np.pi), "time,x,v\ns,rad,rad/s\n"),
    "time,x [kN],v [N mm]\n": ((1, 1e-3, 1e3), "time,x [N],v [N m]\n"),
}


@pytest.mark.parametrize("head", UNITS)
def test_units_are_converted_to_those_of_the_first_table(head, sixbar):
    factors, other = UNITS[head]
    scaled = [column * factor for column, factor in zip((TIME, X, V), factors, strict=True)]
    sixbar.write("a.csv", head + rows(",", digits, scaled))
    sixbar.write("b.csv", other + rows())
    # Conversions round at 2e-16; a factor that is wrong is off by more than a hundredth.
    sixbar("compare", "b.csv", "a.csv", "--tolerance", "1e-9", "--json")
    assert sixbar.numbers["channels"]["x"]["unit"].replace("²", "^2") in other


NO_TABLES = [
    *((PLAIN.replace(LAST, bad), "x|row 11") for bad in ("nan", "inf", "")),
    (PLAIN.replace("x,v", "x,w"), "'v'"),
    ("time,x\n" + rows(columns=(TIME, X)), "'v'"),
    ("time,x,v\n" + rows(columns=(TIME[::-1], X, V)), "b: time|row 2"),
    (PLAIN.replace("0.500000,0.479426", "0.4,0.5"), "0.4 s|row 6"),
    (PLAIN + PLAIN, "line 13"),
    ("time,x,v\n0,1,2\n", "b: 1 data rows"),
    ("\x89HDF\r\n\x1a\n" + "0" * 100, "b.csv: |HDF5"),
    ("\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + "0" * 600, "b.csv: |Excel"),
    ("MATLAB 7.3 MAT-file".ljust(116) + "\0" * 8 + "\0\2IM".ljust(388, "\0") + "\x89HDF\r\n\x1a\n", "-v7"),
]


@pytest.mark.parametrize(("text", "pieces"), NO_TABLES, ids=[repr(text[-50:]) for text, _ in NO_TABLES])
def test_what_is_no_table_of_numbers_is_refused(text, pieces, sixbar):
    sixbar.write("plain.csv", PLAIN)
    sixbar.write("b.csv", text.encode("latin-1"))
    sixbar.refused("compare plain.csv b.csv --tolerance 1", "b", *pieces.split("|"))


OWN = """[channels]
knee = {unit = "deg", scale = 60.0, angle = true, rate = "speed"}
speed = {unit = "deg/s"}
moment = {unit = "N m", factor = 736.0}
[a]
knee_r = {channel = "knee"}
w = {channel = "speed"}
h = {channel = "moment"}
[b]
"#2" = {channel = "knee", unit = "rad"}
"#3" = {channel = "speed", unit = "rad/s"}
h = {channel = "moment", unit = "N m"}
"""


def test_a_mapping_defines_channels_of_its_own(sixbar):
    sixbar.write("own.toml", OWN)
    knee, speed = 30 * np.sin(TIME), 30 * np.cos(TIME)
    sixbar.table("a.csv", **{"time": TIME, "knee_r [deg]": knee, "w [deg/s]": speed, "h [N m]": X})
    # Whole revolutions of an angle do not matter.
    sixbar.table("b.csv", time=TIME, p=np.radians(knee) + 2 * np.pi, q=np.radians(speed), h=X)
    command = ["compare", "a.csv", "b.csv", "--mapping", "own.toml", "--json", "--tolerance"]
    sixbar(*command, "1e-9")  # conversions round at 1e-15
    channels = sixbar.numbers["channels"]
    assert (channels["knee"]["unit"], channels["knee"]["scale"]) == ("deg", 60.0)
    # Both have it per body weight: its scale is the range of the first, as the factor makes it.
    assert channels["moment"]["scale"] == pytest.approx(736 * np.ptp(X), rel=1e-12)
    sixbar.table("b.csv", time=TIME, p=np.radians(knee + 0.5), q=np.radians(speed), h=X)
    assert "knee" in sixbar(*command, "0.005", code=1).out  # allowed are 0.3 degrees
    sixbar(*command, "0.01")
