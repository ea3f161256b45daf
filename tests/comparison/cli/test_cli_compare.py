"""`sixbar compare` of tables from elsewhere: exit codes, numbers, and tables that never pass."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from comparison.cli import main


def opensim(name: str, degrees: np.ndarray) -> None:
    """Ten joint angles at 100 Hz, as OpenSim stores the results of inverse kinematics."""
    names = [f"joint_{n}" for n in range(10)]
    head = f"Coordinates\nversion=1\nnRows={len(degrees)}\nnColumns=11\ninDegrees=yes\n\nendheader\n"
    rows = "\n".join(
        "\t".join(f"{value:16.8f}" for value in (n * 0.01, *row)) for n, row in enumerate(degrees)
    )
    Path(name).write_text(head + "\t".join(["time", *names]) + "\n" + rows + "\n")


@pytest.mark.parametrize(("wrong", "code"), [(0.0, 0), (0.5, 1)])
def test_ten_joint_angles_of_two_opensim_files_compare_without_a_mapping(wrong, code, capsys):
    time = np.arange(101) * 0.01
    degrees = 30 * np.sin(np.outer(time, np.arange(1, 11))) - 5.0
    opensim("left.sto", degrees)
    degrees[40, 6] += wrong
    opensim("right.mot", degrees)
    command = ["compare", "left.sto", "right.mot", "--tolerance", "1e-3"]
    assert main(command) == code
    out, err = capsys.readouterr()
    assert out.count(" agree ") >= 10 - code
    assert "no unit is stated for joint_0, joint_1" in err
    out = " ".join(out.split())  # reasons are wrapped
    if code:
        assert (
            "most of all joint_6, |E|/tolerance = 8.3: 1 of 101 samples are outside the tolerance, at worst "
            "at t = 0.4 s: " in out
        )
        assert "the difference is -0.5, the threshold 0.0" in out  # without a unit, none is stated
        assert main([*command, "--share", "0.99"]) == 0
        assert "1 of 101 samples are outside" in " ".join(capsys.readouterr().out.split())
