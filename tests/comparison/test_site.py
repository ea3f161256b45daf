"""The documents as a site: complete references, a notebook that runs, nothing loaded from a network."""

import re
import subprocess
import sys
from pathlib import Path

import generated
import pytest

import sixbar
from comparison.scene import load_scene, shipped_scenes
from comparison.scene.keys import flat

ROOT = Path(__file__).parents[2]


def listed(*command):
    """Return the commands that the help of a command lists."""
    help_text = subprocess.run(
        [sys.executable, "-m", "comparison", *command, "--help"], capture_output=True, text=True, check=True
    ).stdout
    return re.findall(r"^  ([a-z][\w-]*)  ", help_text.partition("Commands:\n")[2], re.MULTILINE)


def test_every_command_has_its_help_in_the_reference():
    sections = dict(
        re.findall(r"^## `sixbar ?(.*?)`\n\n```text\n(.*?)\n```", generated.commands(), re.S | re.M)
    )
    names = listed()
    assert {"validate", "run", "study"} <= set(names)
    assert list(sections) == ["", *names, *(f"study {name}" for name in listed("study"))]
    assert "--tolerance X" in sections["compare"]
    assert "--grid KEY=A,B,C" in sections["study sweep"]


def test_every_key_of_a_scene_is_in_the_reference_once():
    rows = re.findall(r"^\| `([\w.\[\]]+)` \|", generated.keys(), re.MULTILINE)
    assert len(set(rows)) == len(rows)
    for name in shipped_scenes():
        for key in flat(load_scene(name).data):
            # A material of each partner is in the row of both.
            assert key in rows or key.rpartition(".")[0] in rows


def test_every_name_for_python_is_in_the_reference():
    assert re.findall(r"autofunction:: sixbar\.(\w+)", generated.names()) == sixbar.__all__


@pytest.mark.slow
def test_the_notebook_runs_and_both_models_agree_in_it():
    page = generated.notebook((ROOT / "docs" / "notebook.ipynb").read_text("utf-8"))
    assert "```text\nagree; x differs by " in page
    assert page.count("<svg") == 1


@pytest.mark.slow
def test_the_site_is_built_without_a_warning_and_loads_nothing_from_a_network(tmp_path):
    pytest.importorskip("furo", reason="needs the extra docs")
    options = ["-W", "--keep-going", "-q", "-c", str(ROOT / "docs"), "-d", str(tmp_path / "doctrees")]
    built = subprocess.run(
        [sys.executable, "-m", "sphinx", *options, str(ROOT), str(tmp_path / "site")],
        capture_output=True,
        text=True,
    )
    assert (built.returncode, built.stderr) == (0, "")
    pages = {path: path.read_text("utf-8") for path in tmp_path.glob("site/**/*.html")}
    assert len(pages) > 20
    loads = re.compile(
        r"<(?:script|img|iframe|source)\b[^>]*\bsrc=\"(?:https?:)?//|<link\b[^>]*href=\"(?:https?:)?//"
    )
    assert not [path for path, text in pages.items() if loads.search(text)]
    styles = [path.read_text("utf-8") for path in tmp_path.glob("site/**/*.css")]
    assert styles
    assert not [text for text in styles if re.search(r"@import|url\(['\"]?(?:https?:)?//", text)]
