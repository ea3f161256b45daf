"""The ideal mechanism: published facts, and the press whose rocker turns with its crank, a slider-crank."""

import numpy as np
import pytest

import exudyn_model
import reference_model
from comparison.scene import load_scene

CHANGES = {
    "mechanism.rocker_pivot": [0.0, 0.0], "mechanism.rod2.length": 0.11, "mechanism.rocker.length": 0.2,
    "mechanism.rocker.centroid": 0.1, "mechanism.rod4.length": 0.6, "mechanism.rod4.centroid": 0.25,
    "mechanism.guide_x": 0.05, "mechanism.reference_offset": 0.0,
    "output.groups": ["accelerations", "joints"], "drive.cycles": 0.3, "output.samples_per_cycle": 100,
    "solver.exudyn.step": 4e-6,
}  # fmt: skip
ROUND_OFF = {"slider_y": 1e-14, "slider_vy": 1e-13, "slider_ay": 1e-11, "crank_torque": 1e-12}
"""Round-off of a formula, some hundred times 1e-16 of 0.2 m, 7 m/s, 400 m/s^2 and 14 N m."""
STEP_ERRORS = {"slider_y": 1e-9, "slider_vy": 1e-8, "slider_ay": 1e-6, "crank_torque": 4e-7}
"""Two to ten times the largest errors of Exudyn's steps of 4e-6 s and Newton's tolerance of 1e-7, measured at
300 rpm over a cycle: 4.6e-10 m, 3.7e-9 m/s, 2.3e-7 m/s^2, 3.5e-8 N m."""


def test_published_stroke_top_dead_centre_and_speeds():
    scene = load_scene("ideal", {"drive.cycles": 1.0, "output.samples_per_cycle": 40_000}).data
    y, vy, ay = (reference_model.simulate(scene).columns[f"slider_{name}"] for name in ("y", "vy", "ay"))
    # The published figures with the precision of their last digit and of the identified geometry.
    assert np.ptp(y) == pytest.approx(0.2239, abs=1e-4)
    assert vy.min() == pytest.approx(-1.598, abs=1e-3)
    assert vy.max() == pytest.approx(2.002, abs=1e-3)
    turn = np.degrees(scene["drive"]["speed_rpm"] * np.pi / 30 * vy[0] / ay[0])
    assert scene["mechanism"]["crank_angle_deg"] - turn == pytest.approx(111.355, abs=5e-3)


def closed_form(scene, time):
    """Return y, velocity, acceleration of the slider, and the torque by which the crank keeps its speed.

    With the rocker's pivot on the crank's, crank, rod 2 and rocker are one triangle that turns with the
    crank: a crank of the rocker's length. The rest is the slider-crank with an offset guide.
    """
    m, omega = scene["mechanism"], scene["drive"]["speed_rpm"] * np.pi / 30
    g = scene["environment"]["gravity"]
    crank, rod2, rocker, rod4 = (m[name] for name in ("crank", "rod2", "rocker", "rod4"))
    a, b, c = crank["length"], rod2["length"], rocker["centroid"]
    u1 = np.exp(1j * (np.radians(m["crank_angle_deg"]) + omega * time))
    # Law of cosines; B lies left of the line from A to O, so that the rocker lags behind the crank.
    beta = m["rocker_branch"] * np.arccos((a * a + c * c - b * b) / (2 * a * c))
    u3 = u1 * np.exp(-1j * beta)
    C, vC, aC = (rocker["length"] * u3 * (1j * omega) ** order for order in range(3))
    # Rod 4 reaches from C across by w and down by r.
    L4 = rod4["length"]
    w, dw, ddw = m["guide_x"] + m["reference_offset"] - C.real, -vC.real, -aC.real
    r = np.sqrt(L4**2 - w**2)
    dr = -w * dw / r
    ddr = -(dw**2 + w * ddw + dr**2) / r
    down = -m["slider_branch"]
    y, vy, ay = (C - 1j * down * r).imag, (vC - 1j * down * dr).imag, (aC - 1j * down * ddr).imag
    omega4 = down * dw / r
    alpha4 = down * (ddw / r - dw * dr / r**2)
    share = rod4["centroid"] / L4
    v4, a4 = vC + share * (dw - 1j * down * dr), aC + share * (ddw - 1j * down * ddr)
    A, B = a * u1, c * u3
    triangle = crank["mass"] * crank["centroid"] * u1 + rocker["mass"] * B
    triangle += rod2["mass"] * (A + rod2["centroid"] / b * (B - A))
    power = g * (1j * omega * triangle).imag + m["slider"]["mass"] * (ay + g) * vy
    power += rod4["mass"] * ((a4 * v4.conj()).real + g * v4.imag) + rod4["inertia"] * omega4 * alpha4
    return {"slider_y": y, "slider_vy": vy, "slider_ay": ay, "crank_torque": power / omega}


@pytest.mark.parametrize(("model", "bounds"), [(reference_model, ROUND_OFF), (exudyn_model, STEP_ERRORS)])
@pytest.mark.parametrize("speed", [150.0, -300.0])
def test_slider_crank_follows_its_closed_form(model, bounds, speed):
    scene = load_scene("ideal", CHANGES | {"drive.speed_rpm": speed}).data
    result = model.simulate(scene)
    assert result.status == "success", result.remedy
    for name, exact in closed_form(scene, result.columns["time"]).items():
        assert np.abs(result.columns[name] - exact).max() < bounds[name], name
    dense = np.linspace(0.0, result.columns["time"][-1], 100_001)
    for name, exact in closed_form(scene, dense).items():
        for end, at in (("min", exact.argmin()), ("max", exact.argmax())):
            # Twice what the parabolas through the models' own times err: 4.2e-8 of the range, 2e-6 s.
            assert result.extrema[name][end] == pytest.approx(exact[at], abs=1e-7 * np.ptp(exact)), name
            assert result.extrema[name][f"time_of_{end}"] == pytest.approx(dense[at], abs=5e-6), name
