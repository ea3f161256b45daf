"""A repository of somebody else in continuous integration: the files of examples/ci, run step by step."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from doc_pages import block

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "ci"
ACTION = yaml.safe_load((ROOT / "action.yml").read_text("utf-8"))
PAGE = (ROOT / "docs" / "ci.md").read_text("utf-8")


def read(name):
    return yaml.safe_load((EXAMPLE / name).read_text("utf-8"))


@pytest.fixture
def bash(tmp_path, sixbar):
    program = tmp_path / "sixbar" / "bin" / "sixbar"
    program.parent.mkdir(parents=True)
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m comparison "$@"\n')
    program.chmod(0o755)
    folder = shutil.copytree(EXAMPLE, tmp_path / "repository")
    path = os.pathsep.join([str(program.parent), str(Path(sys.executable).parent), os.environ["PATH"]])
    runner = {"RUNNER_TEMP": str(tmp_path), "GITHUB_STEP_SUMMARY": str(tmp_path / "summary.md"), "PATH": path}

    def run(script, **variables):
        command = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", script]
        environment = os.environ | sixbar.environment | runner | {"COLUMNS": "80"} | variables
        return subprocess.run(command, cwd=folder, env=environment, timeout=600).returncode  # s: it hangs

    run.folder, run.summary = folder, tmp_path / "summary.md"
    return run


def use_action(bash, arguments):
    """Run the steps of the action except the installation; return the name and exit code of each that ran."""
    inputs = {name: arguments.get(name, text["default"]) for name, text in ACTION["inputs"].items()}
    assert set(arguments) <= set(inputs)
    codes = []
    for step in ACTION["runs"]["steps"][1:]:
        words = re.sub(r"inputs\.(\w+)", lambda name: repr(inputs[name[1]]), step["if"])
        if eval(words.replace("&&", "and")):
            texts = {f"${{{{ inputs.{name} }}}}": text for name, text in inputs.items()}
            codes.append(
                (step["name"], bash(step["run"], **{n: texts[text] for n, text in step["env"].items()}))
            )
    return codes


@pytest.mark.slow
def test_the_workflow_passes_and_fails_where_the_program_changes(bash):
    codes = []
    for step in read(".github/workflows/press.yml")["jobs"]["compare"]["steps"]:
        if "run" in step:
            codes.append(("run", bash(step["run"])))
        elif step["uses"].startswith("OWNER/sixbar-crossval@"):
            codes += use_action(bash, step["with"])
    steps = [("Compare the tables", 0), ("Run both models on the scenes", 0)]
    assert codes == [("run", 0), *steps]
    assert "    angle    agree" in bash.summary.read_text("utf-8")
    assert {"compare", "validate"} == {path.parent.name for path in bash.folder.glob("out/*/report.html")}
    program = bash.folder / "simulate.py"
    program.write_text(program.read_text("utf-8").replace("9.81", "9.80"))
    tables = {"tables": "expected.csv result.csv", "tolerance": "0.001"}
    assert bash("python3 simulate.py result.csv") == 0
    assert use_action(bash, tables) == [("Compare the tables", 1)]
    # A tenth of a percent of gravity moves the phase, over two seconds, by less than a hundredth.
    assert use_action(bash, tables | {"tolerance": "0.05"}) == [("Compare the tables", 0)]


@pytest.mark.slow
def test_the_action_holds_a_scene_against_its_baseline(bash):
    assert bash("sixbar gate scenes/press.toml --update --baseline baseline.toml -q") == 0
    (step,) = yaml.safe_load(block("docs/ci.md", "yaml", -1))
    baseline = step["with"]
    assert use_action(bash, baseline) == [("Hold both models against the baseline", 0)]
    assert "both models match their baseline" in bash.summary.read_text("utf-8")
    scene = bash.folder / "scenes" / "press.toml"
    scene.write_text(scene.read_text("utf-8") + "\n[friction]\ncoefficient = 0.16\n")
    assert use_action(bash, baseline) == [("Hold both models against the baseline", 1)]


@pytest.mark.slow
def test_the_job_of_gitlab_passes_and_leaves_what_it_keeps(bash):
    job = read(".gitlab-ci.yml")["compare"]
    assert [bash(line) for line in job["script"]] == [0, 0, 0]
    assert (bash.folder / job["artifacts"]["reports"]["junit"]).is_file()


def test_the_hook_accepts_scenes_and_refuses_a_mistake(bash):
    (hook,) = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text("utf-8"))
    (repository,) = read(".pre-commit-config.yaml")["repos"]
    assert [entry["id"] for entry in repository["hooks"]] == [hook["id"]]
    scenes = [path.relative_to(bash.folder).as_posix() for path in bash.folder.rglob("*.toml")]
    assert all(re.search(hook["files"], scene) for scene in scenes)
    command = f"{hook['entry']} {shlex.join(scenes)}"
    assert bash(command) == 0
    (bash.folder / "scenes" / "bad.toml").write_text("[scene]\nextends = 'paper'\n[drive]\ncycles = -1\n")
    assert bash(f"{hook['entry']} scenes/bad.toml {shlex.join(scenes)}") == 2


@pytest.mark.parametrize("name", [".github/workflows/press.yml", ".gitlab-ci.yml", ".pre-commit-config.yaml"])
def test_the_page_shows_the_files_as_they_are(name):
    assert f"```yaml\n{(EXAMPLE / name).read_text('utf-8')}```" in PAGE
