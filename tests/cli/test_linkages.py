"""Linkages from the command line, by both models: validation, gate, comparison, sweep, refusals."""

import json
import re
from pathlib import Path

import pytest

from comparison.regression.record import read, write

OUTPUT = "[output]\nsamples_per_cycle = 100\n[solver.exudyn]\nstep = 2e-4\n"


def test_validate_and_gate_take_a_linkage(sixbar):
    text = f'[scene]\nextends = "quick-return"\n{OUTPUT}'
    sixbar.write("own.toml", text)
    sixbar("validate", "own.toml", "--out", "report", "--json")
    (scene,) = sixbar.numbers["scenes"]
    assert not scene["warnings"]  # such as of moved starts: there are none
    assert scene["channels"]["ram.x"]["scale"] == pytest.approx(0.45)  # the rocker is longest
    page = sixbar.text("report/report.html")
    for part in ('data-body="rocker"', 'class="body slider"', "moveBodies", ">rocker</text>"):
        assert part in page, part
    assert len(sixbar.junit("report/junit.xml")) == 61  # its channels, and the verdict

    gate = ["gate", "--baseline", "base.toml"]
    sixbar("gate", "own.toml", "--update", "--baseline", "base.toml")
    assert "All" in sixbar(*gate).out
    sixbar.write("own.toml", f"{text}[body.ram]\nmass = 3.001\n")
    assert "bed.force at t =" in sixbar(*gate, code=1).out
    sixbar.write("own.toml", text)
    baseline = read(sixbar.folder / "base.toml")
    points = baseline.scenes["own"].reference["standard"].channels["crank.omega"]  # a constant
    points[0] = points[0]._replace(value=-points[0].value)
    write(baseline, sixbar.folder / "base.toml")
    assert "1 channel deviates, most of all crank.omega by 200% of its scale" in sixbar(*gate, code=1).out


def test_two_corners_that_touch_at_once_are_shown(sixbar):
    """The first contact of the free slider-crank of Flores, Leine and Glocker."""
    run = ["--set", "output.duration=3e-3", "--set", "output.samples=300", "--set", "solver.exudyn.step=1e-7"]
    sixbar("validate", "slider-crank", *run, "--out", "report", "--json")
    (scene,) = sixbar.numbers["scenes"]
    assert scene["channels"]["G.ll_gap"]["scale"] == 1e-3
    page = sixbar.text("report/report.html")
    assert "G: 1\N{NO-BREAK SPACE}mm" in page  # the clearance enlarged
    assert page.count("G.ul") > 1  # of the table of contacts


def test_a_stored_table_of_others_is_judged_with_an_uncertainty_of_its_own(sixbar):
    """The slider-crank of Flores, Leine and Glocker before its first contact, by Siconos' SliderCrank.

    Every second row of SliderCrankMoreauJeanDirectProjectionOSI.ref, to seven digits or more. Its method is
    of first order, with steps of 0.1 ms: u is half of the largest change in one of them, chosen once the
    verdicts by shares of 0.01 to 1 were seen.
    """
    span = ("--set", "output.duration=2.6e-3", "--set", "output.samples=13")
    for name, tolerance in (("a", 1e-10), ("finer", 1e-11)):
        setting = f"solver.reference.tolerance={tolerance}"
        sixbar("run", "slider-crank", "--model", "reference", *span, "--set", setting, "--out", f"{name}.csv")
    sixbar.write("siconos.csv", Path(__file__).with_name("cases").joinpath("siconos.csv").read_bytes())
    step = {"crank.angle": 0.015, "rod.angle": 0.0075, "crank.omega": 1.9, "rod.omega": 1.2}
    options = "--finer-a", "finer.csv", "--u-b", "u.toml", "--channels", ",".join(step)
    for share, code in ((0.5, 0), (0.01, 1)):
        sixbar.write("u.toml", "".join(f'"{name}" = {share * change}\n' for name, change in step.items()))
        sixbar("compare", "a.csv", "siconos.csv", *options, code=code)


def test_models_that_assemble_it_differently_are_not_compared(sixbar):
    """Rod and cylinder of an inverted slider-crank lie either way round; the scene does not say which."""
    text = """
        body.crank = {length = 0.06, centroid = 0.02, mass = 0.5, inertia = 4e-4}
        body.rod = {length = 0.18, centroid = 0.08, mass = 0.4, inertia = 1.2e-3}
        body.cylinder = {length = 0.16, centroid = 0.06, mass = 1.1, inertia = 3e-3}
        pin.O = {joins = ["frame", "crank.start"]}
        pin.A = {joins = ["crank.end", "rod.start"]}
        pin.C = {joins = ["frame", "cylinder.start"], point = [0.2, 0.03]}
        guide.S = {body = "rod", on = "cylinder", angle_deg = 180}
        drive = {body = "crank", speed_rpm = 120, cycles = 0.01}
    """
    sixbar.write("cylinder.toml", text)
    process = sixbar("validate", "cylinder.toml", "-q", code=2)
    assert "in different positions: rod starts at 192.095 deg (reference) and 12.0948 deg" in process.out
    guess = ("--set", "guess.rod.angle_deg=12", "--set", "guess.cylinder.angle_deg=12")
    sixbar("validate", "cylinder.toml", "-q", *guess)


def test_tables_of_a_linkage_are_compared_plotted_and_swept(sixbar):
    sixbar("run", "four-bar", "--model", "reference", "--out", "a.csv", "--set", "drive.cycles=0.1")
    assert not [*sixbar.folder.glob("*.events.csv")]  # there are no contacts
    # The drive's speed is constant.
    assert "crank.alpha    unexcited" in sixbar("compare", "a.csv", "a.csv", "--tolerance", "1e-6").out
    sixbar("plot", "a.csv", "--channels", "coupler.x,drive.torque", "--out", "p.svg")
    grid = ["--grid", "body.rocker.length=0.25,0.26", "--model", "reference"]
    sixbar("study", "sweep", "four-bar", *grid, "--out", "sweep")
    lines = sixbar.text("sweep/sweep.csv").splitlines()
    assert len(lines) == 3
    assert "max:drive.torque" in lines[0]


def test_linkages_are_listed_apart(sixbar):
    press, linkages = sixbar("scenes").out.split("\n\n")
    assert "squeezer" in linkages
    assert "squeezer" not in press
    names = [scene["name"] for scene in json.loads(sixbar("scenes", "--json").out)]
    assert {"squeezer", "ideal"} <= {*names}
    assert "solver.exudyn.step (s; > 0" in sixbar("keys", "--linkage", "exudyn.step").out  # 2e-6 of the press
    assert "pin.NAME.joins" in sixbar("keys", "--linkage", "two points").out
    assert not re.findall("slider|crank", sixbar("keys", "--linkage").out)


RAM = """
body.ram = { mass = 1, inertia = 1 }
body.block = { mass = 1, inertia = 1 }
guide.G = { body = "ram" }
guide.H = { body = "block", on = "ram", direction_deg = 90 }
initial = { ram = { x = 0 }, block = { y = 0 } }
drive = { free = true }
output = { duration = 1, samples = 10 }
solver.exudyn = { step = 1e-2 }
"""


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (RAM.replace("free = true", 'body = "block", torque = 1.0'), "'block' cannot turn: a guide"),
        (RAM.replace("duration = 1, ", ""), "output.duration must be given (s): a drive without speed_rpm"),
        (RAM.replace("free = true", 'body = "ram", torque_table = []'), "torque_table = [] must lead from 0"),
        ('guide.G.point = [0, 9]\nscene.extends = "slider-crank-driven"', "; [initial] gives no angle of"),
        (f'{RAM}[scene]\nextends = "ideal"', "scene.extends = 'ideal': a linkage ([body]) and the press"),
        ('[scene]\nextends = "four-bar"\n[mechanism.crank]\nmass = 1', "extends = 'four-bar': a linkage"),
    ],
)
def test_a_mistake_in_a_linkage_is_one_line(sixbar, text, message):
    sixbar.write("own.toml", text)
    sixbar.refusal("plan own.toml", message)


def test_beside_a_driven_body_each_freedom_has_a_position_and_a_rate(sixbar):
    rod = "{length = 1, mass = 1, inertia = 1}"
    pins = 'pin.O = {joins = ["frame", "a.start"]}\npin.A = {joins = ["a.end", "b.start"]}'
    text = f'body.a = {rod}\nbody.b = {rod}\n{pins}\ndrive = {{body = "a", speed_rpm = 60}}\n'
    for initial, code in (("angle_deg = 9", 2), ("angle_deg = 9, omega = 0", 0)):
        sixbar.write("own.toml", f"{text}initial.b = {{{initial}}}")
        assert ("needs 2 positions and 1 rate" in sixbar("plan", "own.toml", code=code).err) == (code == 2)


def test_a_guess_that_is_not_followed_is_named(sixbar):
    for angle, followed in ((-90, True), (250, True), (170, False)):
        output = sixbar("plan", "four-bar", "--set", f"guess.rocker.angle_deg={angle}", "--json").out
        names = [name for plan in json.loads(output) for name, _ in plan["left_out"]]
        assert names.count("guess.rocker") == (0 if followed else 2)


def test_what_is_deleted_from_a_new_linkage_is_gone(sixbar):
    sixbar("new", "own.toml", "--from", "four-bar")
    sixbar.write("own.toml", re.sub(r"\[pin\.C\].*?\n\n", "", sixbar.text("own.toml"), flags=re.DOTALL))
    sixbar.refusal("plan own.toml", "needs 3 positions and 2 rates")


def test_a_linkage_at_rest_has_a_page(sixbar):
    sixbar.write("own.toml", RAM)
    sixbar("validate", "own.toml", "--out", "report", code=3)
    assert "unexcited" in sixbar.text("report/report.html")


def test_a_run_that_fails_at_a_change_point_names_the_position(sixbar):
    changes = "--set", "body.coupler.length=0.15", "--set", "solver.exudyn.step=1e-2"
    message = sixbar("run", "four-bar", "--model", "exudyn", *changes, "--out", "x.csv", code=2).err
    assert "perhaps by a singular position near t = 0.4166" in message
