"""Mirror images of the press move as mirror images."""

import numpy as np
import pytest

SWAP_SIDES = {"ll": "lr", "lr": "ll", "ul": "ur", "ur": "ul"}
SWAP_ENDS = {"ll": "ul", "ul": "ll", "lr": "ur", "ur": "lr"}
# Off centre, tilted and spinning, so that no side or end is like the other.
START = {
    "initial.slider_offset": 3e-5,
    "initial.slider_angle": 2e-4,
    "initial.slider_vx": 0.01,
    "initial.slider_omega": 0.2,
}


def mirrored(scene: dict, axis: str) -> dict:
    """Dotted keys of the mirror image about the y axis (x -> -x) or about the x axis (y -> -y)."""
    mechanism, initial = scene["mechanism"], scene["initial"]
    pivot_x, pivot_y = mechanism["rocker_pivot"]
    common = {
        # Angles change their sense, left of a line becomes right of it.
        "drive.speed_rpm": -scene["drive"]["speed_rpm"],
        "mechanism.rocker_branch": -mechanism["rocker_branch"],
        "initial.slider_angle": -initial["slider_angle"],
        "initial.slider_omega": -initial["slider_omega"],
    }
    if axis == "x":
        return common | {
            "mechanism.rocker_pivot": [pivot_x, -pivot_y],
            "mechanism.crank_angle_deg": -mechanism["crank_angle_deg"],
            "mechanism.slider_branch": -mechanism["slider_branch"],
            "environment.gravity": -scene["environment"]["gravity"],
        }
    return common | {
        "mechanism.rocker_pivot": [-pivot_x, pivot_y],
        "mechanism.crank_angle_deg": 180.0 - mechanism["crank_angle_deg"],
        "mechanism.guide_x": -mechanism["guide_x"],
        "mechanism.reference_offset": -mechanism["reference_offset"],
        "initial.slider_offset": -initial["slider_offset"],
        "initial.slider_vx": -initial["slider_vx"],
    }


def sign(name: str, axis: str) -> int:
    """What the mirror does to a channel."""
    if name.startswith("energy") or name.endswith(("gap", "normal")) or name == "time":
        return 1
    if name in ("slider_angle", "slider_omega", "slider_alpha", "crank_torque", "guide_moment"):
        return -1
    if name.endswith("friction"):  # along y
        return 1 if axis == "y" else -1
    along_x = name.endswith("x") or name == "guide_force"
    return -1 if along_x == (axis == "y") else 1


# Eight contacts, and five: six more on the stiffer foundation would magnify the rounding of angles to 1e-3.
CYCLES = {"hertz-corners": 0.1, "foundation": 0.05}


@pytest.mark.parametrize("law", CYCLES)
@pytest.mark.parametrize("axis", ["y", "x"])
def test_mirror_image_moves_as_one(run, variant, axis, law) -> None:
    """About the y axis with gravity, about the x axis with gravity reversed."""
    swap = SWAP_SIDES if axis == "y" else SWAP_ENDS
    start = START | {"contact.law": law, "drive.cycles": CYCLES[law]}
    here = run(variant, "150rpm-0.2mm", start)
    there = run(variant, "150rpm-0.2mm", start | mirrored(here.scene, axis))
    events, mirror = here.result.events, there.result.events
    assert events["start"].size >= 5
    assert [swap[k] for k in events["corner"]] == list(mirror["corner"])
    np.testing.assert_allclose(mirror["start"], events["start"], rtol=0, atol=1e-10)  # 1e-11 s measured
    for name, values in here.columns.items():
        part = name.split("_")
        image = f"corner_{swap[part[1]]}_{part[2]}" if part[0] == "corner" else name
        if name != "energy_residual":  # rounding and truncation alone, which no mirror knows
            # Angles round differently in the image: 1e-16, magnified by the impacts to 1e-7 of the largest
            # force. Where Newton's iteration stops comes to no more.
            difference = np.abs(there.columns[image] - sign(name, axis) * values).max()
            assert difference <= 1e-6 * np.abs(values).max(), name
