"""Output of `run`, `plan`, `scenes`, `channels`, `plot`, `animate`, `settings` and `study`."""

import csv
import json
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from sixbar import load_scene

SHORT = ["--set", "drive.cycles=0.02", "--set", "output.samples_per_cycle=2000", "-q"]
MOTION = ["slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega"]
COMMANDS = [
    "scenes", "channels", "keys", "new", "plan", "run", "settings", "validate", "compare", "plot", "animate",
    "gate", "study",
]  # fmt: skip


def columns(sixbar, name):
    with (sixbar.folder / name).open(newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: [float(row[name]) for row in rows] for name in rows[0]}


@pytest.mark.parametrize("columns", ["60", "120", ""])  # "": a pipe
def test_what_runs_nothing_fits_the_terminal(columns, sixbar):
    others = ["", "--help", "scenes", "channels", "plan both-clearances", "study", "study sweep -h"]
    for command in (*others, *(f"{command} -h" for command in COMMANDS)):
        process = sixbar(*command.split(), COLUMNS=columns)
        # A path must not be broken.
        lines = [line for line in process.lines if len(line) > int(columns or 80) and not Path(line).exists()]
        assert (lines, process.err, "\x1b" in process.out) == ([], "", False)
        assert len(process.lines) > 6
        assert "Usage: sixbar " in process.out or not command.endswith("-h")
        if command in ("", "--help"):
            assert all(f" {command} " in process.out for command in COMMANDS)
            assert "Exit codes: 0 agree; 1 differ" in " ".join(process.out.split())


RUN = ["run", "ideal", "--set=drive.cycles=0.1", "--model=reference", "--out=a.csv"]
RUN.append('--set=output.groups=["accelerations", "joints", "energy"]')
HEAVY = {"pandas", "scipy", "numba", "exudyn", "matplotlib", "rich"}


@pytest.mark.parametrize(
    ("arguments", "heavy"), [(["--version"], {*HEAVY, "numpy", "pydantic"}), (RUN, HEAVY)]
)
def test_a_command_imports_nothing_heavy_that_it_does_not_need(arguments, heavy, sixbar):
    """Such a command is quick: help takes 0.15 s on its author's machine."""
    code = f"import sys; from comparison.cli import main; main({arguments}); print(*sys.modules)"
    process = subprocess.run([sys.executable, "-c", code], cwd=sixbar.folder, capture_output=True, check=True)
    first, *_, last = process.stdout.decode().splitlines()
    assert (arguments is RUN) != first.startswith("sixbar-crossval ")
    assert "comparison.cli.compare" in last.split()
    assert not heavy & {*last.split()}


def test_scenes_and_channels(sixbar):
    def listing(*command):
        entries, tables = json.loads(sixbar(*command, "--json").out), sixbar(*command).out.split("\n\n")
        lines = [line for table in tables for line in table.splitlines()[1:]]
        assert [line.split()[0] for line in lines] == [each["name"] for each in entries]
        return {each.pop("name"): each for each in entries}

    by_name = listing("scenes")
    assert [*by_name][:2] == ["150rpm-0.2mm", "300rpm-0.2mm"]  # linkages follow
    assert by_name["90rpm-0.5mm"]["clearance"] == {"slider": 5e-4}
    assert by_name["crank-pin"]["clearance"] == {"crank_pin": 2e-4}
    assert (by_name["300rpm-0.2mm"]["speed_rpm"], by_name["surface"]["cycles"]) == (300, 0.3)
    assert all(scene["title"] and scene["hash"] for scene in by_name.values())
    by_name = {each["name"]: each for each in json.loads(sixbar("channels", "--json").out)}
    assert [name for name in by_name if by_name[name]["group"] == "motion"] == MOTION
    assert (by_name["corner_ll_normal"]["unit"], by_name["slider_alpha"]["unit"]) == ("N", "rad/s^2")
    assert {"crank_torque", "reaction_O_x", "guide_force", "energy_residual"} < set(by_name)
    assert list(listing("channels", "ideal")) == [*MOTION, "slider_ax", "slider_ay", "slider_alpha"]


def test_keys_are_those_of_a_scene_and_found_by_name_or_description(sixbar):
    keys = {key["name"]: key for key in json.loads(sixbar("keys", "--json").out)}
    expected = {"unit": "m", "bounds": ">= 0", "default": 2e-4, "source": "Sec. 4"}
    assert keys["clearance.slider"].items() >= expected.items()
    for pattern in ("FRICTION", "centre of mass"):  # of a name, of a description
        lines = sixbar("keys", pattern).lines
        assert max(map(len, lines)) <= 80
        names = [line.split()[0] for line in lines if not line.startswith(" ")]
        texts = {name: (name + key["description"]).lower() for name, key in keys.items()}
        assert names == [name for name, text in texts.items() if pattern.lower() in text]
    assert "friction.coefficient = 0.15 (>= 0; Table 2)" in sixbar("keys", "friction").lines


@pytest.mark.parametrize("source", ["150rpm-0.2mm", "workpiece", "crank-pin", "deep/own.toml"])
def test_a_new_scene_is_the_one_it_was_made_from_until_it_is_changed(source, sixbar):
    contact = "[contact]\nyoungs_modulus = { slider = 2e9, guide = 3.3e9 }\n"
    sixbar.write("deep/own.toml", f'[scene]\nextends = "wedge"\n{contact}')
    way = [] if source == "150rpm-0.2mm" else ["--from", source]
    assert sixbar("new", "other/new.toml", *way).out == "other/new.toml\n"
    heads = [line.split()[0] for line in sixbar("plan", "other/new.toml").lines[:2]]
    assert heads == ["new:", "reference:"]  # no key has changed
    files = (sixbar.folder / scene if "/" in scene else scene for scene in (source, "other/new.toml"))
    first, second = ((scene.hash, scene.reliability) for scene in map(load_scene, files))
    assert first == second
    sixbar.refusal("new other/new.toml", "other/new.toml: exists")
    if way:
        return
    text = sixbar.text("other/new.toml")
    text = text.replace("slider = 0.0002  # m, >= 0", "slider = 0.0003").replace("150.0  # rpm", "90.0")
    sixbar.write("other/new.toml", text)
    first, *lines = sixbar("plan", "other/new.toml", "--set", "reliability.bins=9").lines
    assert ": 2 cycles at 90 rpm" in first
    changes = "drive.speed_rpm = 90.0 (150.0), clearance.slider = 0.0003 (0.0002), reliability.bins = 9 (10)"
    assert f"changed from 150rpm-0.2mm: {changes} reference:" in " ".join(" ".join(lines).split())


def test_a_scene_extends_others_and_is_changed_last(sixbar):
    """The nearest value of a key counts: that of ``--set``, of the file, of the one that it extends."""
    parent = '[scene]\nextends = "90rpm-0.1mm"\ntitle = "T"\n[drive]\ncycles = 3\nspeed_rpm = 80\n'
    sixbar.write("deep/own.toml", parent)
    sixbar.write("child.toml", '[scene]\nextends = "deep/own.toml"\n[drive]\ncycles = 0.02\n')
    run = ["run", "child.toml", "--model", "reference", "--out", "x.csv", "-q"]
    changes = ("drive.speed_rpm=-70", "output.groups=[]", "drive.speed_rpm=-75")
    sixbar(*run, *(f"--set={change}" for change in changes))
    scene = sixbar.json("x.json")["scene"]
    assert (scene["drive"]["speed_rpm"], scene["drive"]["cycles"]) == (-75, 0.02)
    assert (scene["clearance"]["slider"], scene["contact"]["restitution"]) == (1e-4, 0.9)


@pytest.mark.parametrize(("table", "model"), [("a", "reference"), ("b", "exudyn")])
def test_a_run_writes_a_table_its_events_and_its_record(table, model, runs):
    values = columns(runs, f"{table}.csv")
    assert list(values)[:7] == ["time", *MOTION]
    # To the end of 0.02 cycles of 0.4 s, included; a column has as many digits as a double.
    assert (len(values), len(values["time"])) == (22, 41)
    assert values["time"][-1] == pytest.approx(0.008, rel=1e-15)
    # The start: 0.05 mm beside the guide's line.
    assert values["slider_x"][0] == pytest.approx(-0.55 + 5e-5, abs=1e-15)
    record = runs.json(f"{table}.json")
    assert (record["model"], record["status"]) == (model, "success")
    assert record["scene"]["drive"] == {"speed_rpm": 150.0, "cycles": 0.02}
    assert {"settings", "counters", "versions", "platform", "scene_hash", "formulation"} < set(record)
    assert record["extrema"]["slider_x"]["max"] >= max(values["slider_x"]) - 1e-15
    events = runs.text(f"{table}.events.csv").splitlines()[0]
    assert events == "corner,start,end,normal_speed,impulse,peak_force,largest_depth"


def test_both_models_and_both_formats_agree(runs):
    runs("compare", "a.csv", "a.parquet", "--tolerance", "1e-15")
    # The scene is recorded beside both: its clearance is the scale. Errors of both were measured as 1e-9 m.
    runs("compare", "a.csv", "b.csv", "--tolerance", "1e-4", "--json")
    assert runs.numbers["channels"]["slider_x"]["scale"] == 2e-4


def test_a_run_names_the_files_that_it_wrote_the_table_last(sixbar):
    home = {"HOME": str(sixbar.folder), "USERPROFILE": str(sixbar.folder)}
    process = sixbar("run", "ideal", "--model", "reference", "--out", "~/deep/x.parquet", *SHORT, **home)
    assert process.err == ""
    files = {str(sixbar.folder / name) for name in sixbar.files() if not name.endswith("/")}
    assert set(process.lines) == files > {process.lines[-1]}
    assert process.lines[-1] == str(sixbar.folder / "deep/x.parquet")


def test_settings_reach_the_model(sixbar):
    for options, settings in (
        ("--accuracy strict", {"step": 5e-7}),
        ("--formulation tree", {"formulation": "tree"}),
    ):
        run = sixbar("run", "150rpm-0.2mm", "--model", "exudyn", "--out", "x.csv", *SHORT, *options.split())
        record = sixbar.json("x.json")
        assert record["scene"]["solver"]["exudyn"].items() >= settings.items()
        assert ("expected: " in run.out) == ("accuracy" in record) == ("--accuracy" in options)


SLIDE = ["run", "150rpm-0.2mm", "--model", "reference", "--out", "x.csv", *SHORT]
SLIDE += ["--set", "clearance.slider=3e-4"]


def test_an_accuracy_in_metres_is_estimated_by_further_runs(sixbar):
    process = sixbar(*SLIDE, "--accuracy", "1e-8", "--uncertainty")
    assert "further runs" in process.lines[0]
    assert "slider_x is within 1e-08 m" in process.out
    expected = {"wanted_m": 1e-8, "kept": True, "limit": None, "coverage": 1.0, "until_s": None}
    assert sixbar.json("x.json")["accuracy"].items() >= expected.items()
    assert max(columns(sixbar, "x.csv")["slider_x_u"]) <= 1e-8
    sixbar("plot", "x.csv", "--channels", "slider_x,slider_x_u")
    assert "1e-18 m is not reachable" in sixbar(*SLIDE, "--accuracy", "1e-18", code=3).out
    record = sixbar.json("x.json")["accuracy"]
    assert record["kept"] is False
    assert record["limit"] in ("the finest setting errs more", "neighbouring trajectories diverge")
    assert len(columns(sixbar, "x.csv")["time"]) == 41  # of the best run
    # Nobody measured this scene: the output says how to do it.
    assert "estimate it by --check" in sixbar(*SLIDE, "--accuracy", "draft").out
    assert "estimated error of slider_x" in sixbar(*SLIDE, "--check").out


PARTIAL_FILES = {"x.partial.csv", "x.partial.events.csv", "x.partial.json"}
FAILURES = {  # others are in test_validate.py
    "violate": (2, "invariant-violated; open-depth: ", PARTIAL_FILES),
    "nan": (2, "slider_vy is nan in data row 8", set()),
    "die": (70, "its process ended with code 3", set()),
    "bug": (70, "RuntimeError: index out of range", {"x.traceback.txt"}),
}


@pytest.mark.parametrize("does", FAILURES)
def test_a_run_that_fails_writes_no_table(does, sixbar):
    code, reason, files = FAILURES[does]
    path = sixbar.press("bad", alpha=f'does = "{does}"')
    process = sixbar("run", path, "--model", "alpha", "--out", "x.csv", "-q", code=code)
    assert (process.out, process.err.count("\n")) == ("", 1)
    assert process.err.startswith("sixbar: scene 'bad': ")
    assert reason in process.err
    assert {path.name for path in sixbar.folder.iterdir() if "extrema" not in path.name} == files | {path}
    assert all(name in process.err for name in files & {"x.partial.csv", "x.traceback.txt"})


def test_what_a_model_prints_or_does_to_its_scene_is_not_among_the_results(sixbar):
    path = sixbar.press("one", alpha='does = "print"')
    process = sixbar.process("run", path, "--model", "alpha", "--out", "x.csv", "-q")
    assert (process.out, process.err) == ("x.events.csv\nx.json\nx.csv\n", "hello\n")
    assert sixbar.json("x.json")["scene"]["drive"]["speed_rpm"] == 150
    # The table is compared where the model is not installed, with the scales of its scene.
    sixbar.sites.clear()
    sixbar("compare", "x.csv", "x.csv", "--tolerance", "1e-9", "--json")
    assert sixbar.numbers["channels"]["slider_x"]["scale"] == 2e-4


def test_pictures_of_tables(runs):
    window = ["--channels", "slider_x,slider_vx", "--from=0.001", "--to=0.007"]
    for out, start in (("x.png", b"\x89PNG"), ("x.pdf", b"%PDF"), ("x.svg", b"<svg")):
        assert runs("plot", "a.csv", "b.csv", "--out", out, *window).lines == [out]
        assert start in (runs.folder / out).read_bytes()[:2000]
    assert runs("animate", "a.csv", "b.csv").lines == ["a-b.html"]
    page = runs.text("a-b.html")
    assert ("<script" in page, "src=" in page) == (True, False)  # one offline file
    runs.write("short.csv", "\n".join(runs.text("b.csv").splitlines()[:-3]))
    process = runs("animate", "a.csv", "short.csv", "--scene", "300rpm-0.2mm", "--out", "c.html")
    pieces = "a: recorded of a scene with another speed", "only there both tables have rows"
    assert [words in process.err for words in pieces] == [True, True]
    assert "a and short, 0.0074 s" in runs.text("c.html")


@pytest.mark.slow
def test_the_settings_that_are_recommended_run(sixbar):
    # Every setting is tried: so much time is never needed.
    process = sixbar("settings", "ideal", "--seconds", "600", "--out", "deep/w.svg", *SHORT)
    assert process.lines[-1] == "deep/w.svg"
    assert "<svg" in sixbar.text("deep/w.svg")[:2000]
    assert all(part in process.out for part in ("setting", "error (m)", "front", "reference"))
    commands = [line.strip() for line in process.lines if line.strip().startswith("sixbar run ")]
    assert "--set drive.cycles=0.02" in commands[0]
    path = sixbar(*shlex.split(commands[0])[1:], "-q").lines[-1]
    assert len(columns(sixbar, path)["time"]) == 41


def test_a_sweep_over_a_grid_a_list_or_a_latin_hypercube(sixbar):
    def sweep(out, *options):
        command = ["study", "sweep", sixbar.press("one"), "--jobs", "1", "-q", "--output", "end:slider_x"]
        process = sixbar(*command, *options, "--out", out)
        assert process.lines[-1] == f"{out}/sweep.csv"
        return process.err, list(csv.DictReader(sixbar.text(f"{out}/sweep.csv").splitlines()))

    options = ["--grid", "drive.speed_rpm=100,200", "--grid", "friction.coefficient=0.1,-1"]
    options += ["--output", "contacts", "--model", "alpha"]
    err, rows = sweep("grid", *options)
    assert "2 of 4 runs" in err
    points = [(float(row["drive.speed_rpm"]), float(row["friction.coefficient"])) for row in rows]
    assert points == [(100, 0.1), (100, -1), (200, 0.1), (200, -1)]
    assert [row["status"] == "success" for row in rows] == [True, False, True, False]
    assert (float(rows[0]["contacts"]), rows[1]["contacts"]) == (1, "")
    # Another sweep into the same folder says so, more points or columns do not.
    more = ["--output", "steps", "--grid", "drive.speed_rpm=100,200,300", *options[2:]]
    assert "replaces" not in sweep("grid", *more)[0]
    assert "replaces" in sweep("grid", *options)[0]
    points = "drive.speed_rpm,clearance.slider\n100,1e-4\n120,2e-4\n100,1e-4\n"
    sixbar.write("list.csv", points)
    _, rows = sweep("listed", "--list", "list.csv", "--model", "alpha,beta")
    assert [row["point"] for row in rows] == [*"112233"]
    names = "point,drive.speed_rpm,clearance.slider,model,status,message,end:slider_x"
    assert (",".join(rows[0]), len(rows)) == (names, 2 * 3)
    latin = ["--latin", "drive.speed_rpm=100:200", "--points", "3", "--model", "alpha", "--seed"]
    samples = [sweep(f"latin{n}", *latin, seed)[1] for n, seed in enumerate("112")]
    assert samples[0] == samples[1] != samples[2]
    speeds = sorted(float(row["drive.speed_rpm"]) for row in samples[0])
    assert [int((speed - 100) // (100 / 3)) for speed in speeds] == [0, 1, 2]  # one in each third
