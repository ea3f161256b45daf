"""The tutorial and the page on scenes, followed literally in an empty folder: outputs are those printed."""

import contextlib
import io
import re
import shlex

import pytest
from doc_pages import block, blocks

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
    for language, text in blocks("docs/tutorial.md"):
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


def test_the_linkages_of_their_page_run_as_printed(sixbar):
    files, commands = ["bar.toml", "worn.toml"], 0
    for language, text in blocks("docs/linkages.md"):
        if language == "toml":
            sixbar.write(files.pop(0), text)
        for command, shown, code in re.findall(CONSOLE, text, re.DOTALL | re.MULTILINE):
            ended = sixbar(*shlex.split(command), code=int(code or 0), COLUMNS="80")
            require(shown, ended.err.strip() if code else ended.out)
            commands += 1
    assert (files, commands) == ([], 6)


def test_the_scene_of_its_page_is_planned_and_its_mistake_refused_as_printed(sixbar):
    sixbar.write("aluminium.toml", block("docs/scenes.md", "toml"))
    (command,) = (line for line in block("docs/scenes.md", "sh").splitlines() if " plan " in line)
    assert "69 on 210 GPa" in sixbar(*shlex.split(command)[1:]).out
    ((command, shown, _),) = re.findall(CONSOLE, block("docs/scenes.md", "console"), re.DOTALL | re.MULTILINE)
    assert sixbar(*shlex.split(command), code=2).err == shown
