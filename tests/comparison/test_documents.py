"""The pages of docs/: short paragraphs and cells, and every block of code is run by a test."""

import re
from pathlib import Path

import pictures
import pytest

ROOT = Path(__file__).parents[2]
PAGES = sorted((ROOT / "docs").glob("*.md"))
FENCE = re.compile(r"^```([^\n`]*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize(
    "page", [*PAGES, ROOT / "CONTRIBUTING.md", ROOT / "README.md"], ids=lambda page: page.name
)
def test_no_paragraph_is_longer_than_80_words_and_no_cell_than_30(page):
    for block in re.split(r"\n\s*\n", FENCE.sub("", page.read_text("utf-8"))):
        if block.lstrip().startswith("|"):
            parts, most = re.split(r"(?<!\\)\||\n", block), 30
        else:
            parts, most = re.split(r"\n(?=[-*] |\d+\. )", block), 80
        for part in parts:
            assert len(part.split()) <= most, part


# The blocks of each page in their order, each with the test that runs it or why none does: a block that is
# added to a page is added here.
HERE, TUTORIAL, JUDGE = "cli/test_documents.py", "cli/test_tutorial.py", "cli/test_judge.py"
PYTHON, RECIPES, MAPPING = "cli/test_python.py", "cli/test_ci_recipes.py", "tables/foreign/test_text.py"
INSTALLS = "installs into an environment"
DOCKER = "needs Docker"
SHOWN = "is no code: an output of other inputs, or a diagram"
BLOCKS = {
    "accuracy.md": [HERE, SHOWN, "words/test_words.py", HERE],
    "architecture.md": [SHOWN, SHOWN],
    "ci.md": [RECIPES, RECIPES, RECIPES, DOCKER, "cli/test_gate.py", SHOWN, "test_pytest_plugin.py"],
    "contact-law.md": [HERE, HERE, HERE],
    "engine.md": [HERE, PYTHON, PYTHON, PYTHON, HERE, PYTHON],
    "foreign-tables.md": [MAPPING, SHOWN, PYTHON, PYTHON, PYTHON, MAPPING, HERE, HERE, HERE, HERE, HERE],
    "judge.md": [JUDGE] * 7,
    "linkages.md": [TUTORIAL] * 4,
    "scenes.md": [TUTORIAL, HERE, TUTORIAL, HERE],
    "tutorial.md": [INSTALLS, *[TUTORIAL] * 11],
}


def test_every_block_of_code_is_run_by_a_test_or_cannot_be():
    for page in PAGES:
        kinds = [
            kind for kind, _ in FENCE.findall(page.read_text("utf-8")) if kind not in ("math", "{toctree}")
        ]
        assert len(kinds) == len(BLOCKS.get(page.name, [])), (page.name, kinds)
        assert not re.search(r"\n\n    \S", FENCE.sub("", page.read_text("utf-8"))), (
            f"{page.name}: not in a fence"
        )


def test_the_pictures_are_those_that_their_functions_draw():
    for name, draw in pictures.PICTURES.items():
        assert (ROOT / "docs" / name).read_text("utf-8") == draw()
