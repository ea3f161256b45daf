"""The recipes of docs/ci.md: its commands run, its files are those that are written, its test passes."""

from __future__ import annotations

import re
import shlex
from importlib.resources import files
from pathlib import Path

import pytest

from comparison.cli import main
from comparison.tables.table_files import write

ROOT = Path(str(files("comparison"))).parent
TEXT = (ROOT / "docs" / "ci.md").read_text("utf-8")
BLOCKS = dict(re.findall(r"^## ([^\n]+)\n(.*?)(?=^## |\Z)", TEXT, re.DOTALL | re.MULTILINE))
COMMANDS = [shlex.split(line) for line in re.findall(r"^(?: *- run: | *- )?(sixbar .*)$", TEXT, re.MULTILINE)]


def block(section: str, language: str) -> str:
    (found,) = re.findall(rf"```{language}\n(.*?)```", BLOCKS[section], re.DOTALL)
    return found


@pytest.fixture
def _tiny_scene(fake_models, tmp_path, monkeypatch):
    """A small scene for fakes of both models."""
    assert fake_models.exists()
    monkeypatch.chdir(tmp_path)
    Path("tiny.toml").write_text(
        '[scene]\nextends = "paper"\n[output]\nsamples_per_cycle = 100\ngroups = []\n'
    )


@pytest.mark.usefixtures("_tiny_scene")
def test_the_commands_of_the_recipes_pass_one_after_another(capsys):
    assert [command[:2] for command in COMMANDS] == [
        ["sixbar", name] for name in ("gate", "gate", "gate", "validate", "gate")
    ]
    for number, (_, *arguments) in enumerate(COMMANDS):
        named = [word.replace("150rpm-0.2mm", "tiny.toml") for word in arguments]
        first = ["tiny.toml"] if number == 0 else []  # instead of all the shipped ones
        assert main([*named, *first, "--jobs", "1"]) == 0, capsys.readouterr()
    # What later steps of the recipes take.
    recipe = block("GitHub Actions", "yaml")
    for path in re.findall(r"out/[\w./*]+", recipe + block("GitLab", "yaml")):
        assert list(Path().glob(path)), path
    for name in re.findall(r"`(\w+\.(?:xml|md|json|html))`", BLOCKS["What both commands write"]):
        assert list(Path("out").glob(f"*/{name}")), name


def test_the_recipes_are_indented_as_yaml_must_be():
    for section in ("GitHub Actions", "GitLab"):
        lines = [line for line in block(section, "yaml").splitlines() if line]
        assert not any("\t" in line for line in lines)
        # Every line is a key, an item of a list, or a line of the one literal block.
        other = [line for line in lines if not re.match(r" *(- )?[\w-]+:( |$)| *- \S", line)]
        assert all(line.strip().startswith("out/") for line in other)
        assert all((len(line) - len(line.lstrip())) % 2 == 0 for line in lines)


def test_the_tests_of_the_recipe_pass(pytester, make_table, monkeypatch):
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    write(make_table(), pytester.path / "reference.csv")
    write(make_table(stretch=1e-6), pytester.path / "mine.csv")
    pytester.makepyfile(block("A test of your own", "python"))
    inner = pytester.runpytest_subprocess("-p", "comparison.pytest_plugin", "-W", "error")
    inner.assert_outcomes(passed=2)
