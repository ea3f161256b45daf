"""Contacts resolved in time, of both models of a scene: only what their tables have the force of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from comparison.agreement.cross_check import validate
from comparison.agreement.pulses import resolved


@pytest.mark.usefixtures("fake_models")
def test_without_forces_in_a_table_nothing_is_drawn(scene):
    (good,) = validate([scene], n_jobs=2, tiers=("standard",))
    assert resolved([good]) == {(scene.name, "standard"): ([], [])}
    run = good.runs["exudyn"]
    assert run.base.events is not None
    phase = np.linspace(0.0, 1.0, 31)
    columns = {
        "row": np.zeros(31, dtype=int),
        "time": float(run.base.events["start"][0]) + 2e-4 * phase,
        "force": 40.0 * np.sin(np.pi * phase),
    }
    own = replace(run, base=replace(run.base, pulses=columns))
    reference, exudyn = resolved([replace(good, runs=good.runs | {"exudyn": own})])[scene.name, "standard"]
    assert (list(reference), [pulse.row for pulse in exudyn]) == ([], [0])
