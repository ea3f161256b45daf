"""Verdicts on two tables: by a tolerance, by further runs, at events; and a comparison's files."""

import json
import shlex

import numpy as np
import pytest

import sixbar as package

TIME = np.arange(101) * 0.01
X = np.sin(9 * TIME)
CODES = {
    "a.csv a.csv": (3, "indeterminate"),
    "a.csv b.csv --allow-indeterminate": (0, "indeterminate"),
    "a.csv b.csv --tolerance 1e-3 --allow-indeterminate": (1, "differ"),
    "a.csv b.csv --tolerance 1e-3 --share 0.99 --time-tolerance 1e-9": (0, "agree"),
    "a.csv b.csv --tolerance 0.0099 --absolute": (1, "differ"),  # b is off by 0.01
    "a.csv b.csv --tolerance 0.0101 --absolute": (0, "agree"),
    "a.csv f.csv --tolerance 1e-9 --channels x": (0, "agree"),  # only f has a force
    "a.csv end.csv --tolerance 1e-9 --common-time": (0, "compared from 0 to 0.89 s"),
    "f.csv g.csv --tolerance 0.5": (1, "differ"),  # the first is constant: only equal numbers agree
    "e.csv a.csv --tolerance 1e-3 --at-events left": (1, "differ"),
    "e.csv a.csv --tolerance 1e-3 --at-events right": (0, "agree"),
    # A limit that decides nothing gives a warning.
    "a.csv b.csv --share 0.9": (3, "--share has no effect without a tolerance"),
    "a.csv b.csv --tolerance 1 --finer-a a.csv --finer-b b.csv": (0, "--tolerance has no effect: the unc"),
    "a.csv b.csv --finer-a a.csv --finer-b b.csv": (0, "a: runs at two settings are equal"),
}
REFUSALS = {
    "a.csv hole.csv": "0.39|0.6 s|20 rows",
    "e.csv a.csv": "0.5 s|repeated",
    "a.csv hole.csv --common-time": "20 rows",
    "a.csv f.csv --channels x,force": "no common channel force",
    "a.csv a.csv --channels x,": "channels.1 = '' must not be empty",
    "a.csv b.csv --common-time --finer-a a.csv --finer-b b.csv": "further runs require equal times",
    "a.csv b.csv --finer-a end.csv --finer-b b.csv": "a finer: its times differ from those of a",
    "a.csv f.csv": "'force'|compare = [...] there leaves it out",
    "a.csv empty.csv": "empty.csv: is empty",
    "a.csv blocks.csv": "line 4 is text: save one block per file",
    "one.csv a.csv": "one: its events have no column largest_depth",
    "a.csv folder": "folder: is a folder",
    "folder folder --finer-a a.csv --finer-b a.csv": "two folders",
}


@pytest.fixture(scope="module")
def tables(make):
    """Table b is off a by 0.01 at 0.37 s; e has 0.5 s twice, first off by 0.3; f, g a force; others holes."""
    sixbar = make()
    sixbar.table("a.csv", time=TIME, x=X)
    sixbar.table("b.csv", time=TIME, x=X + 0.01 * (np.arange(101) == 37))
    sixbar.table("e.csv", time=np.insert(TIME, 50, TIME[50]), x=np.insert(X, 50, X[50] + 0.3))
    sixbar.table("f.csv", time=TIME, x=X, force=0 * X)
    sixbar.table("g.csv", time=TIME, x=X, force=0 * X + 1e-9)
    for name, gap in (("one", [40]), ("hole", range(40, 60)), ("end", range(90, 101))):
        sixbar.table(f"{name}.csv", time=np.delete(TIME, gap), x=np.delete(X, gap))
    sixbar.write("one.events.csv", "corner,start,end,normal_speed,impulse,peak_force\nll,0.1,0.2,1,1,1\n")
    sixbar.table("folder/a.csv", time=TIME, x=X)
    sixbar.write("empty.csv", "\n")
    sixbar.write("blocks.csv", "time,x\n0,1\n1,2\ntime,x\n0,1\n")
    sixbar.write("m.toml", "[gate]\nrms_scaled = 1.0\n")
    return sixbar


@pytest.mark.parametrize("pair", REFUSALS)
def test_what_cannot_be_compared_never_agrees(pair, tables):
    tables.refusal(f"compare {pair} --tolerance 1", *REFUSALS[pair].split("|"))


@pytest.mark.parametrize("arguments", CODES)
def test_exit_codes_verdicts_and_warnings(arguments, tables):
    code, message = CODES[arguments]
    process = tables("compare", *arguments.split(), code=code)
    assert message in process.out + process.err
    assert ("no effect" in process.err) == ("no effect" in message)
    assert process.out.count("coverage") == 2 * ("finer" in arguments)  # a tolerance has no coverage
    assert process.lines[-1] == "reports/out/compare/report.html"
    assert (tables.folder / process.lines[-1]).is_file()


def test_the_numbers_are_written_for_programs(tables):
    options = ["--tolerance", "1e-3", "--out", "c", "--json"]
    lines = tables("compare", "a.csv", "b.csv", *options, code=1).err.splitlines()
    assert lines[0].split()[:3] == ["channel", "verdict", "max"]
    assert "c/report.html" in lines
    numbers = tables.numbers
    assert (numbers["verdict"], numbers["labels"], numbers["samples"]) == ("differ", ["a", "b"], 101)
    assert numbers["decisive_channel"] == "x"
    assert numbers["command"] == "sixbar compare a.csv b.csv --tolerance 0.001"
    (channel,) = numbers["channels"].values()
    assert (channel["outside"], channel["worst_time"], channel["unit"]) == (1, 0.37, "")
    # Sums of a few doubles of up to 1; the sign is that of the first less the second.
    expected = {"max_difference": 0.01, "worst_difference": -0.01, "worst_threshold": 1e-3 * np.ptp(X)}
    assert {name: channel[name] for name in expected} == pytest.approx(expected, rel=1e-9)
    # The root of the mean square over time: a triangle of one sample's spacing on either side would be 2/3.
    assert 0.5 < channel["rms_difference"] ** 2 / (0.01**2 / 100) < 1.5
    assert all(text in tables.text("c/report.html") for text in ("differ", numbers["command"]))


def test_the_tolerance_and_the_scale_may_be_the_scenes(sixbar):
    """The scale of x is the clearance, 0.2 mm; ``[compare]`` in the scene gives the share of it."""
    scene = '[scene]\nextends = "150rpm-0.2mm"\n[output]\ngroups = []\nsamples_per_cycle = 50\n'
    sixbar.write("none.toml", scene)
    sixbar.write("some.toml", f"{scene}[compare]\ntolerance = 1e-2\n")
    time = np.arange(101) * 0.4 / 50
    names = ("slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
    others = {name: np.sin(20 * time) for name in names}
    for name, error in (("p", 0.0), ("q", 1e-6)):
        sixbar.table(f"{name}.csv", time=time, slider_x=1e-3 * np.sin(20 * time) + error, **others)

    p, q, none, some = (sixbar.folder / name for name in ("p.csv", "q.csv", "none.toml", "some.toml"))
    cases = ((none, None, "indeterminate"), (some, None, "agree"), (some, 1e-3, "differ"))
    for scene, tolerance, verdict in cases:
        result = package.compare(p, q, scene=scene, tolerance=tolerance)
        assert (result.verdict, result.channels["slider_x"].scale) == (verdict, 2e-4)
    sixbar("compare", "p.csv", "q.csv", "--scene", "some.toml")
    sixbar.refusal("compare p.csv q.csv --scene ideal", "slider_ax")


def test_what_is_left_out_on_purpose_is_not_listed(sixbar):
    """A velocity left out still interpolates its position, by a cubic: a line errs by 9e-4 and more."""
    columns = {"slider_x": np.sin(9 * TIME), "slider_vx": 9 * np.cos(9 * TIME)}
    sixbar.table("p.csv", time=TIME, **columns, slider_y=TIME, force=TIME)
    sixbar.table("q.csv", time=TIME[::2], **{name: column[::2] for name, column in columns.items()})
    sixbar.table("u.csv", time=TIME, **columns, slider_x_u=0 * TIME + 1e-9)  # as of run --uncertainty
    sixbar.table("v.csv", time=TIME, **columns)
    p, q, u, v = (sixbar.folder / f"{name}.csv" for name in "pquv")
    result = package.compare(p, q, channels=["slider_x"], tolerance=1e-6)
    assert (result.verdict, [*result.channels]) == ("agree", ["slider_x"])
    assert "force" not in "".join(result.warnings)
    for pair in ("u.csv p.csv", "p.csv u.csv"):
        sixbar.refusal(f"compare {pair} --tolerance 1", "'force'")
    assert [*package.compare(u, v, tolerance=1e-9).channels] == [*columns]


@pytest.mark.parametrize(
    "command", ["a.csv end.csv --common-time --period 0.7", "e.csv a.csv --at-events left"]
)
def test_the_command_of_a_report_repeats_what_was_asked(command, tables):
    """The command gives the numbers of the first call, whatever the options were."""
    options = (
        "--tolerance 0.0123456789 --absolute --share 0.95 --time-tolerance 0.02 --channels x --mapping m.toml"
    )
    output = tables("compare", *command.split(), *options.split(), "--json").out
    program, *arguments = shlex.split(tables.numbers["command"])
    assert (program, len(arguments)) == ("sixbar", 1 + len(command.split()) + len(options.split()))
    assert tables(*arguments, "--json").out == output


def test_further_runs_judge_by_their_uncertainty_and_the_order_that_is_stated(sixbar):
    """Two programs with errors of opposite sign that a finer setting divides by four: u is known."""
    for name, sign, fault in (("p", 1, 0), ("q", -1, 0), ("r", -1, 1e-3)):
        for end, size in (("", 1.0), ("-fine", 0.25), ("-coarse", 4.0), ("-moved", 4.001)):
            y = 0.1 * np.sin(9 * TIME) + fault * np.cos(3 * TIME) + sign * size * 1e-6 * np.cos(5 * TIME)
            sixbar.table(f"{name}{end}.csv", time=TIME, y=y)

    ends = {"finer": "fine", "coarser": "coarse", "perturbed": "moved"}

    def compare(other, kinds, *options, code=0):
        sides = [(kind, *side) for kind in kinds.split() for side in (("a", "p"), ("b", other))]
        further = [f"--{kind}-{side}={name}-{ends[kind]}.csv" for kind, side, name in sides]
        return sixbar("compare", "p.csv", f"{other}.csv", "--json", *further, *options, code=code).err

    assert "perturbed" in compare("q", "finer")  # there are no perturbed runs
    assert (sixbar.numbers["verdict"], sixbar.numbers["channels"]["y"]["coverage"]) == ("agree", 1.0)
    # The models are 2e-6 apart at most; their errors, and so their uncertainties, are 1e-6 and more.
    assert sixbar.numbers["channels"]["y"]["max_difference"] == pytest.approx(2e-6, rel=1e-3)
    assert 0 < sixbar.numbers["ratio"] <= 1
    ratios = {}
    for order in ("2,2", "2,4"):
        options = [f"--refinement-a={order}", f"--refinement-b={order}"]
        compare("q", "finer coarser perturbed perturbed", *options)
        ratios[order] = sixbar.numbers["channels"]["y"]["largest_ratio"]
    # That an error falls by 4 is trusted at order 2; at order 4 it is not, and u is larger by 1.8 (measured).
    assert ratios["2,2"] > 1.2 * ratios["2,4"]
    options = ["--refinement-a", "2,2", "--refinement-b=2,2", "--period", "0.7"]
    assert "perturbed" not in compare("r", "finer coarser perturbed perturbed", *options, code=1)
    # Without an ensemble a difference beyond the uncertainty stands, unconfirmed.
    assert sixbar.numbers["confirmation"]["outcome"] == "unconfirmed"
    assert "--period 0.7" in sixbar.numbers["command"]


UNTIL = {
    "": (3, "agree until 6.0 s of 9.99: --until states how long is enough"),
    "--until 6": (0, "agree until 6.0 s of 9.99."),
    "--until any": (0, "agree until 6.0 s of 9.99."),
    "--until 8 --allow-indeterminate": (0, "agree until 6.0 s of 9.99: 8 s are demanded"),
    "--until 0": (2, "until = 0 must be > 0, or 'any'"),
}


def test_how_long_two_programs_have_to_agree_is_a_demand_apart(sixbar):
    """The finer runs part from their base at 6 s by a tenth of the scale."""
    time = np.arange(1000) * 0.01
    for name, error in (("p", 1e-9), ("q", -1e-9)):
        for end, size, distance in (("", 1.0, 0.0), ("-fine", 0.25, 0.2)):
            y = np.sin(9 * time) + size * error * np.cos(5 * time) + distance * (time > 6.0)
            sixbar.table(f"{name}{end}.csv", time=time, y=y)
    command = "compare p.csv q.csv --finer-a p-fine.csv --finer-b q-fine.csv --json"
    for options, (code, words) in UNTIL.items():
        assert words in " ".join(sixbar(*command.split(), *options.split(), code=code).err.split())
    sixbar(*command.split(), code=3)
    numbers = sixbar.numbers
    assert (numbers["verdict"], numbers["exit_code"], numbers["until"]) == ("agree", 3, 6.0)
    # A window is a hundredth of half a period, pi / 9 s, but a sample at least.
    assert numbers["window"] == pytest.approx(np.pi / 900, rel=0.1)
    # Half of the samples have a smaller threshold, of 2 * 3 * 0.75e-9 * sqrt(2) at most, a scale of 2.
    assert 1e-9 < numbers["channels"]["y"]["resolution"] < 4e-9
    assert "--until has no effect" in sixbar("compare", "p.csv", "q.csv", "--tolerance=1", "--until=8").err


def test_the_peak_of_a_force_is_the_extremum_that_is_recorded_and_not_a_sample(sixbar):
    for name, peak in (("p", 59.0), ("q", 60.5)):
        sixbar.table(f"{name}.csv", time=TIME, corner_ll_normal=39 * (TIME == 0.5))
        extremum = {"min": 0.0, "time_of_min": 0.0, "max": peak, "time_of_max": 0.5}
        sixbar.write(f"{name}.json", json.dumps({"extrema": {"corner_ll_normal": extremum}}))
    sixbar("compare", "p.csv", "q.csv", "--tolerance", "1", "--json")
    information = sixbar.numbers["channels"]["corner_ll_normal"]["information"]
    assert (information["peak_a"], information["peak_difference"]) == (59.0, 1.5)
