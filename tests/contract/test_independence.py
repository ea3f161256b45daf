"""Each model runs with all else blocked from import, writes nothing, and minds no listener."""

import json
import subprocess
import sys

import numpy as np
import pytest

RUN = """
import json, sys

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {blocked!r}:
            raise ImportError(name + " is blocked")

sys.meta_path.insert(0, Blocked())
import {model} as model
result = model.simulate(json.load(sys.stdin))
assert result.status == "success", result
assert not {blocked!r} & {{name.split(".")[0] for name in sys.modules}}
print(result.columns["slider_x"][-1])
"""


@pytest.mark.parametrize(
    ("model", "other"),
    [("reference_model", ["exudyn_model", "exudyn"]), ("exudyn_model", ["reference_model"])],
)
def test_model_runs_alone(scene, model, other):
    code = RUN.format(model=model, blocked={*other, "comparison", "pandas", "pydantic"})
    data = json.dumps(scene({"drive.cycles": 0.05, "output.samples_per_cycle": 100}))
    done = subprocess.run([sys.executable, "-c", code], input=data, text=True, capture_output=True)
    assert done.returncode == 0, done.stderr
    # After 0.02 s the slider is still inside its guide, 0.2 mm to either side.
    assert abs(float(done.stdout) + 0.55) < 2.1e-4


def test_who_listens_does_not_change_the_run_which_leaves_nothing(run, variant, tmp_path, monkeypatch, capfd):
    """Reports of progress stop an integrator more often; its steps are the same."""
    monkeypatch.chdir(tmp_path)
    alone, shares = run(variant, "150rpm-0.2mm", {"drive.cycles": 0.1}), []
    heard = alone.variant.model.simulate(alone.scene, progress=shares.append)
    assert shares[:-1] == sorted(shares[:-1])
    assert shares[-1] == 1.0
    for name in ("columns", "events", "cycle_extrema", "pulses"):
        for key, values in getattr(alone.result, name).items():
            np.testing.assert_array_equal(getattr(heard, name)[key], values)
    assert heard.provenance["counters"] == alone.result.provenance["counters"]
    assert capfd.readouterr() == ("", "")
    assert not list(tmp_path.iterdir())
