"""The journal in its bearing, Fig. 8b: where it is, and what follows from that."""

import math

import numpy as np
import pytest

from comparison.tables.channels import expected

# Three bounces of 0.1 to 0.3 ms without losses: the force is the elastic one. Samples 2e-6 s apart.
BOUNCES = {
    "contact.restitution": 1.0,
    "friction.coefficient": 0.0,
    "drive.cycles": 0.0195,
    "output.samples_per_cycle": 200_000,
}
# Those that know clearance at the crank pin
LOOSE = pytest.mark.parametrize(
    "variant", ["reference-minimal", "exudyn-full", "exudyn-index2", "exudyn-tree"]
)


@LOOSE
@pytest.mark.parametrize("name", ["crank-pin", "both-clearances", "150rpm-0.2mm"])
def test_a_journal_has_channels_where_it_has_clearance(run, variant, name):
    simulated = run(variant, name, {"drive.cycles": 0.005})
    assert sorted(simulated.columns) == sorted(["time", *expected(simulated.scene)])
    names = [channel for channel in simulated.columns if channel.startswith(("corner", "journal"))]
    corners = 12 if name != "crank-pin" else 0
    assert names[corners:] == (["journal_x", "journal_y"] if name != "150rpm-0.2mm" else [])


@LOOSE
def test_it_starts_centred_and_touches_where_its_distance_is_the_clearance(run, variant):
    """On rod 2 acts G = K d^n e / |e| with R = R_j R_b / (R_b - R_j), where reactions are given."""
    simulated = run(variant, "crank-pin", BOUNCES)
    columns, time = simulated.columns, simulated.columns["time"]
    e = columns["journal_x"] + 1j * columns["journal_y"]
    c, R_j = (simulated.scene["clearance"][key] for key in ("crank_pin", "journal_radius"))
    depth, contacts = np.abs(e) - c, simulated.contacts("pin")
    assert len(contacts) == 3
    assert abs(e[0]) < 1e-15  # a difference of coordinates of 0.3 m
    near, touching = np.zeros(time.size, bool), np.zeros(time.size, bool)
    for contact in contacts:
        inside = (contact["start"] < time) & (time < contact["end"])
        # Fifty samples a contact miss the top of an arch by some (pi / 50)^2 / 8 of it.
        assert contact["largest_depth"] == pytest.approx(depth[inside].max(), rel=2e-3)
        touching |= inside
        for edge in (contact["start"], contact["end"]):
            near |= np.abs(time - edge) < 1e-8  # as for corners, see test_contacts.py
    assert np.array_equal((depth > 0.0)[~near], touching[~near])
    if "reaction_A_x" in columns:
        contact = simulated.scene["contact"]
        compliance = 2 * (1 - contact["poisson"] ** 2) / contact["youngs_modulus"]
        K = 4 / (3 * compliance) * math.sqrt(R_j * (R_j + c) / c)
        G = columns["reaction_A_x"] + 1j * columns["reaction_A_y"]
        force = K * np.maximum(depth, 0.0) ** contact["exponent"] * e / np.maximum(np.abs(e), c)
        assert np.abs(force).max() > 100.0
        # Coordinates of 0.3 m round at 1e-16 m: some 1e-15 m times the slope of the force, 2e8 N/m at 2e-5 m.
        assert np.abs(G - force).max() <= 1e-6
        assert np.all(G[depth <= 0.0] == 0.0)
