"""The origin of a report: when, from which commit, on which machine."""

import shutil
import subprocess
from pathlib import Path

import pytest
from outline import words

from comparison.report import origin
from comparison.report.page import render
from comparison.verdict.results import SceneComparison


def git(folder: Path, *arguments: str) -> str:
    own = ["-c", "user.name=x", "-c", "user.email=x@example.org"]
    ran = subprocess.run(["git", "-C", folder, *own, *arguments], capture_output=True, text=True, check=True)
    return ran.stdout.strip()


@pytest.mark.skipif(shutil.which("git") is None, reason="git is not installed")
def test_the_commit_is_that_of_the_tracked_file_and_of_no_other_project(tmp_path: Path) -> None:
    file, other = tmp_path / "module.py", tmp_path / "site" / "module.py"
    other.parent.mkdir()
    for path in (file, other):
        path.write_text("x = 1\n")
    assert "commit" not in origin._code(file)
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", "module.py")
    git(tmp_path, "commit", "-qm", "first")
    commit = git(tmp_path, "rev-parse", "--short=10", "HEAD")
    assert origin._code(file).endswith(f"commit {commit}")
    # A package installed inside another project's checkout.
    assert "commit" not in origin._code(other)
    file.write_text("x = 2\n")
    assert origin._code(file).endswith(f"commit {commit} with modifications")


def test_it_stands_at_the_head_and_without_it_nothing_does(broken: SceneComparison) -> None:
    found = origin.Origin(time="2026-01-02 03:04 UTC", code="commit <abc>", machine="a machine")
    html = render([broken], title="Press", command="x", origin=found)
    head = words(html).partition("Scenes")[0]
    assert "2026-01-02 03:04 UTC, commit <abc>" in head
    assert "a machine" in head
    assert "UTC" not in words(render([broken], title="Press", command="x"))


def test_now_is_now() -> None:
    assert origin.origin().time.endswith(" UTC")
    assert origin.origin().machine
