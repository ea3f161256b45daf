"""Each model simulates with the other one and the comparison blocked from import."""

import json
import subprocess
import sys

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
def test_model_runs_alone(scene, model: str, other: list[str]) -> None:
    code = RUN.format(model=model, blocked={*other, "comparison", "pandas", "pydantic"})
    data = json.dumps(scene({"drive.cycles": 0.05, "output.samples_per_cycle": 100}))
    done = subprocess.run([sys.executable, "-c", code], input=data, text=True, capture_output=True)
    assert done.returncode == 0, done.stderr
    # After 0.02 s the slider is still inside its guide, 0.2 mm to either side.
    assert abs(float(done.stdout) + 0.55) < 2.1e-4
