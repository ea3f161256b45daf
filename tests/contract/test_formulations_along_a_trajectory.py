"""Two coordinates and fifteen with multipliers, through contacts: reactions and torque within k u."""

import pytest

from comparison.accuracy.thresholds import thresholds
from comparison.accuracy.uncertainty import Levels, round_off, uncertainty, window_samples
from comparison.scene import load_scene
from comparison.tables.channels import channels
from comparison.verdict.channel import compare_channel
from comparison.words.verdicts import reason
from reference_model import simulate
from reference_model.reactions import REACTIONS

TOLERANCE = 1e-10
CYCLE = {"drive.cycles": 1.0, "output.groups": ["joints"]}
PERIOD, SAMPLES = 0.4, 1000


@pytest.fixture(scope="module")
def runs():
    """Columns of both formulations at two tolerances a decade apart."""

    def columns(formulation, tolerance):
        settings = {"solver.reference.formulation": formulation, "solver.reference.tolerance": tolerance}
        result = simulate(load_scene("150rpm-0.2mm", {**CYCLE, **settings}).data)
        assert result.status == "success"
        return result.columns

    return {
        name: (columns(name, TOLERANCE), columns(name, TOLERANCE / 10.0))
        for name in ("minimal", "multiplier")
    }


def u_of(levels, name):
    base, finer = levels
    floor = round_off(base[name], base["time"], channels()[name].round_off)
    # Without a coarser run and a perturbed run the factor of safety is 3.
    return uncertainty(Levels(base[name], finer[name]), window_samples(PERIOD, PERIOD / SAMPLES), floor)


@pytest.mark.parametrize("name", REACTIONS[:13])
def test_reactions_and_torque_agree_within_twice_their_uncertainty(runs, name) -> None:
    few, full = runs["minimal"], runs["multiplier"]
    compared = compare_channel(
        channels()[name],
        few[0]["time"],
        few[0][name],
        full[0][name],
        scene=None,
        u=(u_of(few, name), u_of(full, name)),
        tolerance=None,
        limits=thresholds(),
    )
    assert compared.coverage > 0.9  # else there is little to agree on
    assert compared.explained >= 0.99, reason(compared)
