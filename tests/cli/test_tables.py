"""Tables of other programs: values, units and names that are read, and tables that are refused.

Most have three columns, time, x and v.
"""

import numpy as np
import pandas as pd
import pytest

from sixbar import compare

TIME = np.arange(11) * 0.1
X, V = np.sin(TIME).round(6), np.cos(TIME).round(6)


def rows(columns=(TIME, X, V)):
    return "\n".join(",".join(f"{value:.6f}" for value in row) for row in zip(*columns, strict=True)) + "\n"


TABLE = "time,x,v\n" + rows()
LAST = "0.841471"  # the last number of x
UNITS = {
    "time,x,v\nms,in,cm/s\n": ((1e3, 1 / 0.0254, 100), "time,x [m],v [m/s]\n"),
    "time,x [deg],v (N mm)\n": ((1, 180 / np.pi, 1e3), "time,x,v\ns,rad,N m\n"),
}


@pytest.mark.parametrize("head", UNITS)
def test_units_are_converted_to_those_of_the_first_table(head, sixbar):
    factors, other = UNITS[head]
    columns = [column * factor for column, factor in zip((TIME, X, V), factors, strict=True)]
    lines = (",".join(map(repr, row)) for row in np.transpose(columns).tolist())
    a = sixbar.write("a.csv", head + "\n".join(lines))
    b = sixbar.write("b.csv", other + rows())
    # Conversions round at 2e-16; a factor that is wrong is off by more than a hundredth.
    result = compare(sixbar.folder / b, sixbar.folder / a, tolerance=1e-9)
    assert result.verdict == "agree"
    assert result.channels["x"].unit in other


NO_TABLES = [
    *((TABLE.replace(LAST, bad), "x|row 11") for bad in ("nan", "inf", "")),
    (TABLE.replace("x,v", "x,w"), "'v'"),
    (TABLE.replace("0.500000,0.479426", "0.4,0.5"), "0.4 s|row 6"),
    ("time,x,v\n0,1,1\n1.01,2,2\n1.00,3,3\n2,4,4\n", "time does not increase in data row 3: 1.01 s, then"),
    ("time,x,v\n" + rows(((TIME / 4).round(1), X, V)), "too few digits"),
    (TABLE + TABLE, "line 13"),
    ("time,x,v\n0,1,2\n", "b: 1 data rows"),
    ("\x89HDF\r\n\x1a\n" + "0" * 100, "b.csv: |HDF5"),
    ("\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + "0" * 600, "b.csv: |Excel"),
    ("MATLAB 7.3 MAT-file".ljust(116) + "\0" * 8 + "\0\2IM".ljust(388, "\0") + "\x89HDF\r\n\x1a\n", "-v7"),
]


@pytest.mark.parametrize(("text", "pieces"), NO_TABLES, ids=[repr(text[-50:]) for text, _ in NO_TABLES])
def test_what_is_no_table_of_numbers_is_refused(text, pieces, sixbar):
    sixbar.write("plain.csv", TABLE)
    sixbar.write("b.csv", text.encode("latin-1"))
    sixbar.refusal("compare plain.csv b.csv --tolerance 1", "b", *pieces.split("|"))


MAPPING = """[channels]
knee = {unit = "deg", scale = 60.0, angle = true}
moment = {unit = "N m", factor = 736.0}
[a]
knee_r = {channel = "knee"}
h = {channel = "moment"}
[b]
"#2" = {channel = "knee", unit = "rad"}
h = {channel = "moment", unit = "N m"}
"""


def test_a_mapping_defines_channels_of_its_own(sixbar):
    mapping = sixbar.folder / sixbar.write("own.toml", MAPPING)
    knee = 30 * np.sin(TIME)
    a = pd.DataFrame({"time": TIME, "knee_r [deg]": knee, "h [N m]": X})

    def comparison(bend, tolerance):
        # Whole revolutions of an angle do not matter.
        angle = np.radians(knee + bend) + 2 * np.pi
        b = pd.DataFrame({"time": TIME, "p": angle, "h": X})
        return compare(a, b, mapping=mapping, tolerance=tolerance)

    result = comparison(0.0, 1e-9)  # conversions round at 1e-15
    assert result.verdict == "agree"
    assert (result.channels["knee"].unit, result.channels["knee"].scale) == ("deg", 60.0)
    # Both have it per body weight: its scale is the range of the first, times the factor.
    assert result.channels["moment"].scale == pytest.approx(736 * np.ptp(X), rel=1e-12)
    # Allowed are 0.3 and 0.6 degrees.
    assert comparison(0.5, 0.005).channels["knee"].verdict == "differ"
    assert comparison(0.5, 0.01).verdict == "agree"
