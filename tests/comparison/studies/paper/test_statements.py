"""The statements of the paper's text: how they are decided, on made-up motions whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from comparison.scene import load_scene
from comparison.studies.nonlinear.chaos import Chaos
from comparison.studies.paper import claims, runs
from comparison.studies.paper.claims import Verdict

SUPPORTED, CONTRADICTED, UNDECIDED = Verdict.SUPPORTED, Verdict.CONTRADICTED, Verdict.UNDECIDED
AS_THE_PAPER_SAYS = {
    "90rpm-0.1mm": 1, "90rpm-0.5mm": 3, runs.CENTRAL: 1, "poisson-0.33": 1, "69GPa": 2, "300rpm-0.2mm": 3,
    runs.PIN: 10,
}  # fmt: skip
THE_OPPOSITE = {
    "90rpm-0.1mm": 3, "90rpm-0.5mm": 1, runs.CENTRAL: 3, "poisson-0.33": 6, "69GPa": 1, "300rpm-0.2mm": 1,
    runs.PIN: 1,
}  # fmt: skip


def short(sizes, chatter=0.0):
    """Errors of two cycles by their sizes in each scene; chatter: of the acceleration, 40 times a cycle."""
    angle = 2 * np.pi * np.arange(401) / 200
    acceleration = 20.0 * np.sin(angle) ** 5 + chatter * np.cos(40 * angle)
    units = {"slider_y": 1e-5, "slider_vy": 1e-3, "slider_ay": acceleration}
    return {(scene, channel): unit * size for scene, size in sizes.items() for channel, unit in units.items()}


def noise(made_up, seed, size):
    return size * np.random.default_rng(seed).standard_normal(made_up.cycles * made_up.sparse + 1)


def wave(made_up, times=1):
    return np.sin(2 * np.pi * times * np.arange(made_up.cycles * made_up.sparse + 1) / made_up.sparse)


def hits(made_up, scene, size):
    """As many contacts a cycle as ten times the size, and as hard."""
    period, count = load_scene(scene).period, 10 * size
    return [
        ((c + (k + 0.5) / count) * period, 10.0 * size) for c in range(made_up.cycles) for k in range(count)
    ]


def long(made_up, sizes, y, x):
    """Errors of many cycles: a series of y and its rate by their sizes in each scene, one of x in all."""
    return {
        scene: {"y": 4e-5 * size * y, "vy": 1e-2 * size * y, "x": x, "events": hits(made_up, scene, size)}
        for scene, size in sizes.items()
    }


def favourable(made_up):
    """Motions of which every statement of the paper holds."""
    y = wave(made_up) + noise(made_up, 1, 0.02)
    x = 2e-4 * wave(made_up, 4) + noise(made_up, 2, 1e-5)
    return made_up.motions(
        [short(AS_THE_PAPER_SAYS, chatter=5.0)],
        long(made_up, AS_THE_PAPER_SAYS, y, x),
        angles=(135, 225),
        chaos=Chaos.CHAOTIC,
        shape=lambda angle: np.sin(angle) ** 3,  # close to zero around the lowest point
    )


def adverse(made_up, series):
    """Motions that contradict the paper, with a series of the errors of y; the two models differ."""
    of = made_up.motions(
        [short(THE_OPPOSITE)],
        long(made_up, THE_OPPOSITE, series, 2e-4 * wave(made_up)),
        angles=(135, -45),
        chaos=Chaos.REGULAR,
        shape=np.cos,
    )
    other = made_up.motions([short({scene: 2 * size for scene, size in THE_OPPOSITE.items()})], shape=np.cos)
    for scene in runs.SCENES:
        of.short[scene, "exudyn"] = other.short[scene, "exudyn"]
    return of


def test_every_statement_can_be_supported_and_can_be_contradicted(made_up):
    held = claims.judge_all(favourable(made_up))
    assert held["id"].nunique() == len(claims.all_claims()) == 33
    assert set(held["verdict"]) == {SUPPORTED}
    # A map of y cannot both be without scatter and not repeat: each needs a motion of its own.
    restless, still = (
        claims.judge_all(adverse(made_up, series)) for series in (noise(made_up, 3, 1.0), wave(made_up))
    )
    off, off_when_still = (set(of.loc[of["verdict"] == CONTRADICTED, "id"]) for of in (restless, still))
    assert off == set(held["id"]) - {"y-error-scattered"}
    assert "y-error-scattered" in off_when_still
    # Every criterion decided something.
    assert set(restless.loc[restless["decides"], "what"]) == set(claims.criteria())


def test_a_larger_error_must_be_larger_in_both_comparisons_in_all_starts_and_by_more_than_little(made_up):
    claim = {"channel": "slider_y", "more": "69GPa", "less": runs.CENTRAL}

    def judged(central, soft, later):
        members = [
            {(runs.CENTRAL, "slider_y"): a, ("69GPa", "slider_y"): b}
            for a, b in zip(central, soft, strict=True)
        ]
        sizes = {runs.CENTRAL: 1e-5, "69GPa": later * 1e-5}
        many = {scene: {"y": size * wave(made_up)} for scene, size in sizes.items()}
        return claims.larger(made_up.motions(members, many), "reference", claim).verdict

    assert judged([1.0e-5, 1.1e-5], [2.0e-5, 2.1e-5], 2.0) is SUPPORTED
    assert judged([2.0e-5], [1.0e-5], 0.5) is CONTRADICTED
    assert judged([1.0e-5, 1.1e-5], [2.0e-5, 2.1e-5], 0.5) is UNDECIDED
    assert judged([1e-5, 3e-5], [2e-5, 1e-5], 2.0) is UNDECIDED
    assert judged([1.0e-5], [1.04e-5], 1.04) is UNDECIDED


def test_pairs_that_differ_by_little_count_for_neither_side():
    # Of six pairs 3 > 1, 3 > 2, 2 > 1; 2 = 2, 1.04 and 2 as good as 1 and 2, and 1.04 < 2.
    assert claims.net_share(np.array([2.0, 3.0, 1.04]), np.array([1.0, 2.0])) == pytest.approx((3 - 1) / 6)


@pytest.mark.parametrize("times", [1, 3])
def test_swings_count_in_a_cycle_only_if_they_are_wide_however_many_contacts_there_are(made_up, times):
    clearance = load_scene(runs.CENTRAL).data["clearance"]["slider"]
    # Each goes 0.9 of the clearance there and back, the ripple on it a tenth.
    x = 0.45 * clearance * wave(made_up, times) + 0.05 * clearance * wave(made_up, 10)
    of = made_up.motions(long={runs.CENTRAL: {"x": x, "events": hits(made_up, runs.CENTRAL, 9)}})
    found = claims.oscillating(of, "reference", {"scene": runs.CENTRAL})
    assert found.deciding == {"swings": times}


@pytest.mark.parametrize(
    ("angles", "verdict"),
    [
        ((135, 225), SUPPORTED),
        ((-45, 45), SUPPORTED),  # the same in the frame of the pin
        ((135, -45), CONTRADICTED),
        ((135, 135, 135, 225, 225, 45, 45, 45), UNDECIDED),
    ],
)
def test_the_quadrants_in_which_the_pin_pushes(made_up, angles, verdict):
    # Forty of the two hundred samples of a cycle, so that whole turns of the angles fit.
    of = made_up.motions(angles=np.resize(angles, 24).repeat(1))
    assert claims.pin_zones(of, "reference", {}).verdict is verdict
