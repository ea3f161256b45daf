"""The tutorial, followed literally in an empty folder: its outputs are those that it prints."""

import contextlib
import io
import re
import shlex
from pathlib import Path

import pytest

TEXT = (Path(__file__).parents[2] / "docs" / "tutorial.md").read_text("utf-8")
STEPS = re.findall(r"^```(toml|console|python|text)\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)
CONSOLE = r"^\$ sixbar (.*?)\n(.*?)(?:^\$ echo \$\?\n(\d+)\n)?(?=^\$ |\Z)"  # command, output, exit code
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def require(shown, printed):
    """Require the words of an output, and its numbers unless it says that runs agree.

    What is left between runs that agree is rounding, and the machine's; so are coverage and ratio, which
    rest on that of perturbed runs.
    """
    assert NUMBER.sub("#", printed).split() == NUMBER.sub("#", shown).split()
    if " agree" not in shown:
        numbers, expected = (list(map(float, NUMBER.findall(text))) for text in (printed, shown))
        # Both programs err by less than 1e-10 of what is printed here with three to six digits.
        assert numbers == pytest.approx(expected, rel=1e-4)


@pytest.mark.slow
def test_the_outputs_are_those_of_the_page(sixbar, monkeypatch):
    monkeypatch.chdir(sixbar.folder)
    scope, printed, commands = {}, "", 0
    for language, text in STEPS:
        if language == "toml":
            sixbar.write("press.toml", text)
        elif language == "python":
            with contextlib.redirect_stdout(io.StringIO()) as out:
                exec(text, scope)
            printed = out.getvalue()
        elif language == "text":
            require(text, printed)
        else:
            for command, shown, code in re.findall(CONSOLE, text, re.DOTALL | re.MULTILINE):
                ended = sixbar(*shlex.split(command), code=int(code or 0), COLUMNS="80")
                require(shown, ended.out)
                commands += 1
    assert commands == 9
