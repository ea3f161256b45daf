"""Pages of docs/ without another test, followed as by a reader: outputs are those of the page."""

import contextlib
import io
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib

import numpy as np
import pytest
from doc_pages import ROOT, block, blocks, commands

TIME = np.arange(2001) * 1e-3
SHORT = '[scene]\nextends = "150rpm-0.2mm"\n[drive]\ncycles = 0.02\n[output]\ngroups = []\n'


@pytest.mark.slow
def test_the_commands_of_the_page_on_accuracy(sixbar):
    sixbar.write("mine.toml", SHORT)
    for number, out in ((0, "mine.csv"), (1, "mine.svg")):
        (words,) = commands("docs/accuracy.md", number)
        sixbar(*words)
        assert out in sixbar.files()


def test_the_comparisons_of_the_page_on_tables(sixbar):
    for name, error in (("a", 1e-9), ("b", -1e-9), ("a-fine", 2.5e-10), ("b-fine", -2.5e-10)):
        sixbar.table(f"{name}.csv", time=10 * TIME, y=np.sin(9 * TIME) + error * np.cos(5 * TIME))
    for number in (1, 2):
        (words,) = commands("docs/foreign-tables.md", number)
        assert "a-fine.csv" in words
        sixbar(*words)
    gate = sixbar.write("gate.toml", block("docs/foreign-tables.md", "toml", 3))
    sixbar("compare", "a.csv", "b.csv", "--mapping", gate)
    sixbar.table("c.csv", time=10 * TIME, y=1.01 * np.sin(9 * TIME))
    sixbar("compare", "a.csv", "c.csv", "--mapping", gate, code=1)
    (words,) = commands("docs/foreign-tables.md", 3)
    phase = 5 * np.pi * TIME
    columns = {"slider_y": 0.1 * np.sin(phase), "slider_vy": 0.5 * np.pi * np.cos(phase)}
    for name in ("matlab.mat", "adams.tab", "ideal.mat"):  # a file is recognised by its content
        sixbar.table(name, time=TIME, **columns)
    sixbar.write("names.toml", "")
    assert "0.99865" in sixbar(*words, code=3).out  # a difference without finer runs is undecided


def test_the_entry_point_and_the_settings_of_the_page_on_engines():
    points = tomllib.loads(block("docs/engine.md", "toml"))["project"]["entry-points"]["sixbar.models"]
    assert points == {"mine": "my_press:simulate"}
    names = {"simulate": lambda: None}
    exec(block("docs/engine.md", "python", 1), names)  # our own text
    assert names["simulate"].settings == {"tolerance": 1e-10}


@pytest.fixture
def sources(tmp_path):
    """The packages with the change of the page on contact laws, in a folder of their own."""
    for name in ("sixbar", "comparison", "reference_model", "exudyn_model"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "approach.diff").write_text(block("docs/contact-law.md", "diff"), "utf-8")
    subprocess.run(["git", "apply", "approach.diff"], cwd=tmp_path, check=True)
    return tmp_path


def test_the_change_of_the_page_on_contact_laws_fits_the_sources(sources):
    text = (sources / "exudyn_model" / "laws.py").read_text("utf-8")
    assert text.count("APPROACH") == 2


@pytest.mark.slow
def test_the_law_of_the_page_on_contact_laws_is_one_of_both_models(sources, sixbar):
    """The test compiles both models anew; a slip in one of them would be a difference."""
    (sources / "mine.toml").write_text(block("docs/contact-law.md", "toml"), "utf-8")
    (words,) = commands("docs/contact-law.md")
    environment = os.environ | sixbar.environment | {"PYTHONPATH": str(sources), "COLUMNS": "80"}
    environment |= {"NUMBA_CACHE_DIR": str(sources / "cache")}
    command = [sys.executable, "-m", "comparison", *words]
    call = subprocess.run(command, cwd=sources, env=environment, capture_output=True, text=True)
    assert (call.returncode, "The scene mine agrees." in call.stdout) == (0, True), call.stdout + call.stderr


CONSOLE = r"^\$ sixbar (.*?)\n(.*?)(?:^\$ echo \$\?\n(\d+)\n)?(?=^\$ |\Z)"  # command, output, exit code
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def require(reference, output):
    """Require the words of an output, and its numbers unless it says that runs agree.

    Runs that agree differ by rounding, which is the machine's; so are coverage and ratio, which
    rest on the rounding of perturbed runs.
    """
    assert NUMBER.sub("#", output).split() == NUMBER.sub("#", reference).split()
    if " agree" not in reference:
        numbers, expected = (list(map(float, NUMBER.findall(text))) for text in (output, reference))
        # Both programs err by less than 1e-10 of what is printed here with three to six digits.
        assert numbers == pytest.approx(expected, rel=1e-4)


@pytest.mark.slow
def test_the_outputs_are_those_of_the_page(sixbar, monkeypatch):
    monkeypatch.chdir(sixbar.folder)
    scope, output, commands = {}, "", 0
    for language, text in blocks("docs/tutorial.md"):
        if language == "toml":
            sixbar.write("press.toml", text)
        elif language == "python":
            with contextlib.redirect_stdout(io.StringIO()) as out:
                exec(text, scope)
            output = out.getvalue()
        elif language == "text":
            require(text, output)
        else:
            for command, reference, code in re.findall(CONSOLE, text, re.DOTALL | re.MULTILINE):
                process = sixbar(*shlex.split(command), code=int(code or 0), COLUMNS="80")
                require(reference, process.out)
                commands += 1
    assert commands == 9


def test_the_linkages_of_their_page_run_as_printed(sixbar):
    files, commands = ["bar.toml", "worn.toml"], 0
    for language, text in blocks("docs/linkages.md"):
        if language == "toml":
            sixbar.write(files.pop(0), text)
        for command, reference, code in re.findall(CONSOLE, text, re.DOTALL | re.MULTILINE):
            process = sixbar(*shlex.split(command), code=int(code or 0), COLUMNS="80")
            require(reference, process.err.strip() if code else process.out)
            commands += 1
    assert (files, commands) == ([], 6)


def test_the_scene_of_its_page_is_planned_and_run_and_its_mistake_refused_as_printed(
    sixbar,
):
    sixbar.write("aluminium.toml", block("docs/scenes.md", "toml"))
    plan, *others = commands("docs/scenes.md")
    assert [words[0] for words in (plan, *others)] == ["plan", "run", "validate"]
    assert "69 on 210 GPa" in sixbar(*plan).out
    for words in others:
        sixbar(*words, "--set", "drive.cycles=0.01")
    sixbar.write("pressed.toml", f'[scene]\nextends = "aluminium.toml"\n{block("docs/scenes.md", "toml", 1)}')
    assert sixbar("plan", "pressed.toml").err == ""  # a load without effect would give a warning
    ((command, page, _),) = re.findall(CONSOLE, block("docs/scenes.md", "console"), re.DOTALL | re.MULTILINE)
    assert sixbar(*shlex.split(command), code=2).err == page
