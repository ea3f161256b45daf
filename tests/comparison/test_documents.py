"""README, reports, docs/ and their site: their numbers are the code's, their references are complete."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import generated
import pictures
import pytest

from comparison.accuracy.levels import TIERS, thresholds
from comparison.accuracy.uncertainty import PERTURBATION
from comparison.cli import study
from comparison.scene import load_scene, shipped_scenes
from comparison.studies import NAMES
from comparison.studies.paper import MAIN, PARTS

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text("utf-8")
VERDICTS = (ROOT / "docs" / "verdicts.md").read_text("utf-8")
REPORTS = ROOT / "reports"
PAGES = sorted((ROOT / "docs").glob("*.md"))
FENCE = re.compile(r"^```([^\n`]*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def test_the_verdicts_and_rates_are_those_of_the_reports():
    pages = {path: (REPORTS / path).read_text("utf-8") for path in (f"{name}/README.md" for name in NAMES)}
    text = study.generated(pages)
    assert sum(line[:1] == "|" for line in text.splitlines()) == 2 + len(shipped_scenes())
    assert re.search(r"\d+ false alarms in \d{3,} decided comparisons", text)
    assert study.with_generated(README, text) == README


def test_the_verdicts_on_record_are_those_of_the_reports():
    records = tomllib.loads((REPORTS / "verdicts" / "verdicts.toml").read_text("utf-8"))["scenes"]
    assert list(records) == shipped_scenes()
    text = (REPORTS / "verdicts" / "README.md").read_text("utf-8")
    rows = {line.split(" | ")[0].removeprefix("| "): line for line in text.splitlines() if line[:1] == "|"}
    for name, record in records.items():
        scene = load_scene(name)
        assert record["hash"] == scene.hash
        verdicts = re.findall(r"\*\*(.+?)\*\*", rows[scene.title])
        assert verdicts == [record[tier] for tier in TIERS]


def test_the_list_of_the_studies_is_that_of_their_reports():
    paths = [f"{name}/README.md" for name in NAMES]
    paths[2:2] = [f"paper/{part}.md" for part in PARTS if part != MAIN]
    pages = {path: (REPORTS / path).read_text("utf-8") for path in paths}
    assert (REPORTS / "README.md").read_text("utf-8") == study.index(pages)
    for path, text in pages.items():
        assert text.startswith("# ")
        for link in re.findall(r"\]\(([\w./-]+\.(?:svg|csv|md))\)", text):
            assert (REPORTS / path).parent.joinpath(link).is_file(), f"{path}: {link}"
    for picture in REPORTS.glob("*/**/*.svg"):
        ElementTree.parse(picture)  # it raises


def test_it_is_short():
    assert len(README) <= 7000


def test_the_numbers_in_the_sentences_of_the_verdicts_are_those_of_the_code():
    text = " ".join(VERDICTS.replace("$", "").split())
    standard, tight = thresholds("standard"), thresholds("tight")
    assert f"u must be {standard.alpha / tight.alpha:g} times smaller" in text
    assert {2.0: "within twice the combined u"}[standard.k] in text
    assert {1e-9: "from a start moved by a billionth of the clearance"}[PERTURBATION] in text


def test_every_file_that_the_readme_names_exists():
    for name in re.findall(r"`([a-z_./]+\.(?:toml|cff|py|svg))`|\]\(([A-Za-z_./-]+)\)", README):
        assert (ROOT / (name[0] or name[1])).exists(), name


@pytest.mark.parametrize(
    "page", [*PAGES, ROOT / "CONTRIBUTING.md", ROOT / "README.md"], ids=lambda page: page.name
)
def test_no_paragraph_is_longer_than_80_words_and_no_cell_than_30(page):
    for block in re.split(r"\n\s*\n", FENCE.sub("", page.read_text("utf-8"))):
        if block.lstrip().startswith("|"):
            parts, limit = re.split(r"(?<!\\)\||\n", block), 30
        else:
            parts, limit = re.split(r"\n(?=[-*] |\d+\. )", block), 80
        for part in parts:
            assert len(part.split()) <= limit, part


# Blocks of each page: a test of tests/ runs each of them, or it is no code. A new block is counted here.
BLOCKS = {
    "accuracy.md": 4,
    "architecture.md": 2,
    "ci.md": 8,
    "contact-law.md": 3,
    "engine.md": 6,
    "foreign-tables.md": 10,
    "judge.md": 7,
    "linkages.md": 4,
    "scenes.md": 4,
    "tutorial.md": 12,
}


def test_every_block_of_code_is_run_by_a_test_or_cannot_be():
    for page in PAGES:
        text = page.read_text("utf-8")
        languages = [name for name, _ in FENCE.findall(text) if name not in ("math", "{toctree}")]
        assert len(languages) == BLOCKS.get(page.name, 0), (page.name, languages)
        assert not re.search(r"\n\n    \S", FENCE.sub("", text)), f"{page.name}: not in a fence"


def test_the_pictures_are_those_that_their_functions_draw():
    for name, draw in pictures.PICTURES.items():
        assert (ROOT / "docs" / name).read_text("utf-8") == draw()


def test_every_command_has_its_help_in_the_reference():
    sections = dict(
        re.findall(r"^## `sixbar ?(.*?)`\n\n```text\n(.*?)\n```", generated.commands(), re.S | re.M)
    )
    names = re.findall(r"^  ([a-z][\w-]*)  ", sections[""].partition("Commands:\n")[2], re.MULTILINE)
    assert {"validate", "run", "study"} <= set(names)
    assert {*names, "study sweep", *(f"study {name}" for name in NAMES)} <= sections.keys()
    assert "--tolerance X" in sections["compare"]
    assert "--grid KEY=A,B,C" in sections["study sweep"]


@pytest.mark.slow
def test_the_notebook_runs_and_both_models_agree_in_it():
    page = generated.notebook((ROOT / "docs" / "notebook.ipynb").read_text("utf-8"))
    assert "```text\nagree; x differs by " in page
    assert page.count("<svg") == 1


@pytest.mark.slow
def test_the_site_is_built_without_a_warning_and_loads_nothing_from_a_network(tmp_path):
    pytest.importorskip("furo", reason="needs the extra docs")
    options = ["-W", "--keep-going", "-q", "-c", str(ROOT / "docs"), "-d", str(tmp_path / "doctrees")]
    command = [sys.executable, "-m", "sphinx", *options, str(ROOT), str(tmp_path / "site")]
    process = subprocess.run(command, capture_output=True, text=True)
    assert (process.returncode, process.stderr) == (0, "")
    pages = {path: path.read_text("utf-8") for path in tmp_path.glob("site/**/*.html")}
    assert len(pages) > 20
    loads = re.compile(
        r"<(?:script|img|iframe|source)\b[^>]*\bsrc=\"(?:https?:)?//|<link\b[^>]*href=\"(?:https?:)?//"
    )
    assert not [path for path, text in pages.items() if loads.search(text)]
    styles = [path.read_text("utf-8") for path in tmp_path.glob("site/**/*.css")]
    assert styles
    assert not [text for text in styles if re.search(r"@import|url\(['\"]?(?:https?:)?//", text)]
