"""Contacts resolved in time, as a linear spring would give them: half a sine up to the event table's peak."""

import numpy as np

from comparison.metrics import Pulse

COUNT = 25


def half_sines(scene):
    first, second = (
        []
        if events is None
        else [
            Pulse(row, phase * (end - start), peak * np.sin(np.pi * phase))
            for row, (start, end, peak) in enumerate(
                events[["start", "end", "peak_force"]].itertuples(index=False)
            )
        ]
        for phase in [np.linspace(0.0, 1.0, COUNT)]
        for events in scene.events
    )
    return first, second
