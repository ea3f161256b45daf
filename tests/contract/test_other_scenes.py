"""Scenes beside the paper's: both models agree within what their refinement and perturbed runs leave open."""

import pytest
from judged_runs import MODELS, family

from comparison.scene import load_scene
from comparison.verdict.compare import compare
from comparison.words.verdicts import scene_reason

# Every group: Exudyn then has its constraints at velocity level.
ALL = {"output.groups": ["accelerations", "corners", "joints", "energy"]}


def compared(name, changes):
    """As `comparison.verdict.validate`: three levels and two perturbed runs of each model."""
    scene = load_scene(name, changes)
    runs = [family(model, scene) for model in MODELS]
    return compare(*runs, scene=scene, labels=MODELS)


@pytest.mark.parametrize(
    ("name", "changes"),
    [("crank-pin", {}), ("both-clearances", {}), ("wedge", {}), ("wedge", ALL)],
    ids=["crank-pin", "both-clearances", "wedge", "wedge, all groups"],
)
def test_models_agree_within_their_uncertainty(name, changes):
    """At the standard settings no predictable sample differs, in any channel."""
    result = compared(name, changes)
    for channel in result.channels.values():
        # The balance's residual is error alone: nothing of it is predictable.
        if channel.verdict != "unexcited" and channel.channel != "energy_residual":
            # Not a number where nothing happens while it is predictable: omega before the first hit.
            assert not channel.explained < 0.99, channel.channel
            # The journal's first bounce makes Exudyn's step of 2e-6 s uncertain: 7 % of the samples are left.
            assert channel.coverage >= (0.95 if name == "wedge" else 0.05), channel.channel
    assert result.channels["slider_y"].explained >= 0.99
    if name == "wedge":
        assert result.verdict == "agree", scene_reason(result)


@pytest.mark.parametrize("name", ["crank-pin", "both-clearances"])
def test_models_agree_with_clearance_at_the_crank_pin_without_joints(name):
    """Exudyn's tree ends its steps at the bounces: nearly all of the scene is predictable, to 1e-9 m."""
    settings = {"formulation": "tree", "step": 1e-4, "tolerance": 1e-11}
    changes = {f"solver.exudyn.{key}": value for key, value in settings.items()}
    result = compared(name, changes | {"solver.reference.tolerance": 1e-12})
    assert result.verdict == "agree", scene_reason(result)
    for channel in result.channels.values():
        if channel.verdict != "unexcited":
            assert channel.explained >= 0.99, channel.channel
            assert channel.coverage >= 0.95, channel.channel
    # Measured 5e-11 and 2e-11 m; the tree's own error is 8e-11 m at most.
    assert result.channels["slider_y"].max_difference < 1e-9
