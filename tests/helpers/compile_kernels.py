"""Compile both models' kernels in two processes; each process of the tests would compile them by itself."""

import os
import subprocess
import sys
from importlib import import_module

from platformdirs import user_cache_path

PRESS, TREE = "150rpm-0.2mm", {"solver.exudyn.formulation": "tree", "solver.exudyn.method": "auto"}
MULTIPLIER = {"solver.reference.formulation": "multiplier"}
LINKAGE = {"output.samples": 10, "output.duration": 1e-4}
PARTS = [  # of about the same duration
    [
        *(("reference_model", name, {}) for name in (PRESS, "crank-pin", "both-clearances", "ideal")),
        *(("reference_model", name, MULTIPLIER) for name in (PRESS, "ideal")),
        *(("exudyn_model", name, TREE) for name in (PRESS, "crank-pin", "both-clearances")),
    ],
    [
        ("reference_model", "slider-crank", LINKAGE),
        *(("exudyn_model", name, {}) for name in (PRESS, "crank-pin", "both-clearances", "ideal")),
        ("exudyn_model", "slider-crank", LINKAGE),
    ],
]


def compile_part(part):
    """Run each scene for an instant."""
    # As conftest.py has it; the models read it when they are imported
    os.environ.setdefault("NUMBA_CACHE_DIR", os.environ.get("SIXBAR_CACHE_DIR") or str(user_cache_path()))
    from comparison.scene import load_scene

    for model, name, changes in part:
        short = {} if changes is LINKAGE else {"drive.cycles": 2e-3}
        import_module(model).simulate(load_scene(name, short | changes).data)


if __name__ == "__main__":
    if number := sys.argv[1:]:
        compile_part(PARTS[int(number[0])])
    else:
        parts = [subprocess.Popen([sys.executable, __file__, str(n)]) for n in range(len(PARTS))]
        sys.exit(max(part.wait() for part in parts))
