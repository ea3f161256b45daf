"""The journal in its bearing, Fig. 8b: where it is, and when it touches; its forces: test_model_page.py."""

import numpy as np
import pytest

# Three bounces of 0.1 to 0.3 ms without losses. Samples 2e-6 s apart.
BOUNCES = {
    "contact.restitution": 1.0,
    "friction.coefficient": 0.0,
    "drive.cycles": 0.0195,
    "output.samples_per_cycle": 200_000,
}


@pytest.mark.parametrize("variant", ["reference-minimal", "exudyn-full", "exudyn-index2", "exudyn-tree"])
def test_it_starts_centred_and_touches_where_its_distance_is_the_clearance(run, variant):
    """And its table of contacts is that of the samples."""
    simulated = run(variant, "crank-pin", BOUNCES)
    columns, time = simulated.columns, simulated.columns["time"]
    e = columns["journal_x"] + 1j * columns["journal_y"]
    depth, contacts = np.abs(e) - simulated.scene["clearance"]["crank_pin"], simulated.contacts("pin")
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
