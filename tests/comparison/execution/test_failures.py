"""Runs that fail for real: killed processes, faults inside Exudyn, settings that nothing can meet."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import numpy as np
import pytest

from comparison.cli import main
from comparison.execution.job import Job
from comparison.execution.run import run_all, run_uncached
from comparison.scene import load_scene
from comparison.tables.table_files import read

SHORT = {"drive.cycles": 0.1}
# Exudyn's reactions need constraints at velocity level, whose iteration has no relative tolerance: with a
# friction of 2 it fails in the first contact.
REACTIONS = SHORT | {"output.groups": ["joints"]}

FAULTY = """
from exudyn_model import simulate as whole
from exudyn_model.five_bodies.parts import SliderPart

made = SliderPart._user_function

def faulty(*arguments):
    force = made(*arguments)
    def later(mbs, t, *rest):
        if t > 0.005:
            raise ArithmeticError("the wall is\\ngone")
        return force(mbs, t, *rest)
    return later

def simulate(scene, *, progress=None):
    SliderPart._user_function = faulty
    try:
        return whole(scene, progress=progress)
    finally:
        SliderPart._user_function = made
"""


def command(model: str, changes: dict[str, object], scene: str = "150rpm-0.2mm") -> list[str]:
    values = [f"--set={key}={value}" for key, value in changes.items()]
    return ["run", scene, "--model", model, "--out", "a.csv", *values]


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path / "cache"))


def kill_the_hanging(log: Path) -> bool:
    """Kill the process whose model hangs, as the system does when memory runs out."""
    for line in log.read_text().splitlines():
        _, gravity, _, process = line.split()
        if gravity == "7.0":
            os.kill(int(process), signal.SIGKILL)
            return True
    return False


def test_a_killed_process_costs_its_own_run_only(scene, fake_models, gravity):
    planned = [
        Job(scene.with_values({"environment.gravity": g, "drive.cycles": cycles}), "exudyn")
        for g, cycles in ((gravity.hang, 3.0), (gravity.normal, 1.0), (9.0, 1.0))
    ]
    killed = []

    def on_progress(_share: float) -> None:
        if not killed and kill_the_hanging(fake_models):
            killed.append(True)

    outcomes = run_all(planned, 1, on_progress)
    assert killed
    assert [outcome.status for outcome in outcomes] == ["crashed", "success", "success"]
    assert outcomes[0].message == "its process was killed by SIGKILL"
    assert outcomes[0].partial is None


@pytest.mark.usefixtures("wide")
def test_a_killed_process_is_reported_in_one_line_and_the_other_scenes_are_reported(
    fake_models, gravity, tmp_path, monkeypatch, capfd
):
    for name, g in (("bad", gravity.hang), ("good", gravity.normal)):
        (tmp_path / f"{name}.toml").write_text(
            f'[scene]\nextends = "paper"\n[environment]\ngravity = {g}\n[output]\nsamples_per_cycle = 100\n'
        )
    import comparison.verdict.validate

    left = []

    def watched(jobs, n_jobs, _progress):
        def on_progress(_share: float) -> None:
            # Each run of the scene that hangs, once.
            here = fake_models.read_text().splitlines()
            hanging = [line.split()[-1] for line in here if line.startswith("exudyn 7.0")]
            if len(hanging) > len(left):
                left.append(hanging[-1])
                os.kill(int(hanging[-1]), signal.SIGKILL)

        return run_all(jobs, n_jobs, on_progress)

    monkeypatch.setattr(comparison.verdict.validate, "run_all", watched)
    bad, good = (str(tmp_path / f"{name}.toml") for name in ("bad", "good"))
    assert main(["validate", bad, good, "--out", "v", "--jobs", "1"]) == 70
    out, err = capfd.readouterr()
    # On a busy machine there are lines of progress.
    assert [line for line in err.splitlines() if "%" not in line] == []
    assert len(left) == 20  # at each of the two tiers five runs, and five with more samples
    lines = out.splitlines()
    killed = [line for line in lines if "crashed; its process was killed by SIGKILL" in line]
    assert [line.split()[:2] for line in killed] == [["bad", "standard"], ["bad", "tight"]]
    assert ["good", "standard", "agree"] in [line.split()[:3] for line in lines]
    assert Path(lines[-1]).is_file()


@pytest.fixture
def faulty(install):
    return install("faulty_press", FAULTY, {"faulty": "faulty_press:simulate"})


@pytest.mark.usefixtures("faulty")
def test_an_exception_inside_exudyns_user_function_is_one_line(capfd):
    # The second is expected to take less time, and so comes after the fault in the same process.
    jobs = [
        Job(load_scene("150rpm-0.2mm", {"drive.cycles": cycles}), model)
        for model, cycles in (("faulty", 0.1), ("exudyn", 0.04))
    ]
    found, sound = run_all(jobs, 1)
    assert (found.status, found.message) == ("crashed", "ArithmeticError: the wall is gone")
    assert sound.status == "success"
    alone = run_uncached(jobs[1])
    assert sound.table.frame.equals(alone.table.frame)
    assert main(command("faulty", SHORT)) == 70
    out, err = capfd.readouterr()
    assert out == ""
    assert "the faulty run did not succeed: crashed; ArithmeticError: the wall is gone" in err
    assert err.count("\n") == 1
    assert [path.name for path in Path.cwd().glob("a.*")] == ["a.traceback.txt"]


def test_an_iteration_that_does_not_converge_is_a_status_and_keeps_what_was_computed():
    values = REACTIONS | {"friction.coefficient": 2.0}
    (outcome,) = run_all([Job(load_scene("150rpm-0.2mm", values), "exudyn")], 1)
    assert outcome.status == "newton-failed"
    assert outcome.message.endswith("where friction.coefficient is above 1, lower it")
    assert outcome.table is None
    (sound,) = run_all([Job(load_scene("150rpm-0.2mm", REACTIONS), "exudyn")], 1)  # at 0.15: it helps
    until = len(outcome.partial.frame)
    assert 1 < until < len(sound.table.frame)
    # It stops in the first contact, before which there is no friction.
    assert np.array_equal(outcome.partial.values("slider_x"), sound.table.values("slider_x")[:until])
    assert outcome.partial.provenance["scene"]["drive"]["cycles"] == 0.1


@pytest.mark.parametrize("friction", [2.0, 5.0])
def test_the_same_on_the_command_line(friction, capfd):
    changes = REACTIONS | {"output.groups": '["joints"]', "friction.coefficient": friction}
    assert main(command("exudyn", changes)) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert "newton-failed; raise solver.exudyn.tolerance if below 1e-8, " in err
    assert err.endswith(" until then are in a.partial.csv\n")
    assert err.count("\n") == 1
    assert not Path("a.csv").exists()
    kept = read("a.partial.csv")
    assert len(kept.frame) == int(err.split(";")[-1].split()[0]) >= 1
    assert kept.provenance["status"] == "newton-failed"


def test_a_run_that_ended_and_means_little_is_written_with_a_warning(capfd):
    """Contacts of 2e-4 s in steps of 5e-5 s."""
    assert main(command("exudyn", {"drive.cycles": 0.2, "solver.exudyn.step": 5e-5})) == 0
    out, err = capfd.readouterr()
    assert out == "a.events.csv\na.pulses.csv\na.extrema.csv\na.json\na.csv\n"
    assert "sixbar: warning: half of its contacts, weighted by force, last less than" in err


@pytest.mark.parametrize("model", ["reference", "exudyn"])
@pytest.mark.parametrize(
    ("changes", "reported"),
    [
        ({"clearance.slider": -1e-4}, "scene '150rpm-0.2mm': clearance.slider = -0.0001 m must be >= 0"),
        ({"mechanism.rod2.length": 0.1}, "': mechanism: "),  # cannot be assembled
        ({"contact.poisson": 0.7}, "contact.poisson = 0.7 must be <= 0.5"),
    ],
)
def test_a_scene_out_of_range_is_one_line(model, changes, reported, capfd):
    assert main(command(model, SHORT | changes)) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert reported in err
    assert err.count("\n") == 1
    assert list(Path.cwd().iterdir()) == []


@pytest.mark.parametrize("model", ["reference", "exudyn"])
@pytest.mark.parametrize("scene", ["150rpm-0.2mm", "crank-pin"])
def test_a_model_prints_nothing_of_its_own(model, scene, capfd):
    assert main([*command(model, {"drive.cycles": 0.02}, scene), "-q"]) == 0
    out, err = capfd.readouterr()
    # Forces of contacts only where something touches by then
    files = ["a.events.csv", "a.pulses.csv", "a.extrema.csv", "a.json", "a.csv"]
    assert out.splitlines() == [name for name in files if Path(name).exists()]
    assert {"a.events.csv", "a.json", "a.csv"} <= set(out.splitlines())
    assert err == ""
