"""One run of an FMU in a process: ``python -m comparison.execution.fmu FMU KIND VALUE START OUT OPTIONS``.

An FMU is native code, which may end its process. KIND is "tolerance" or "step" (s), START a comma-separated
list of offsets, OUT the table to write; OPTIONS are JSON: ``states``, the variables that are moved; ``also``,
variables to record beside the outputs; ``stop`` and ``interval``, s, by default those of the FMU.
"""

import difflib
import json
import os
import sys
from math import ceil

import numpy as np


def main() -> None:
    """Run and write the table; an error is one line on standard error."""
    from fmpy import read_model_description, simulate_fmu

    path, kind, value, start, out, text = sys.argv[1:]
    options = json.loads(text)
    model = read_model_description(path)
    experiment, variables = model.defaultExperiment, {each.name: each for each in model.modelVariables}
    stop = options["stop"] or (experiment and experiment.stopTime)
    interval = options["interval"] or (experiment and experiment.stepSize)
    for name, setting in (("stop", stop), ("interval", interval)):
        if not setting:
            sys.exit(f"{name} = ... (s) is missing: the FMU has no default")
    offsets = dict(zip(options["states"], map(float, filter(None, start.split(","))), strict=True))
    for name in offsets:
        if name not in variables or variables[name].start is None:
            starts = [each for each in variables if variables[each].start is not None]
            close = difflib.get_close_matches(name, starts, n=1, cutoff=0.3)
            hint = f"; did you mean {close[0]}?" if close else ""
            sys.exit(f"start.states: {name!r} is no variable with a start value{hint}")
    names = [each.name for each in model.modelVariables if each.causality == "output"]
    names += [name for name in options["also"] if name in variables and name not in names]
    # Steps are whole parts of the interval between two rows.
    parts = ceil(float(interval) / float(value) - 1e-9) if kind == "step" else 1
    step_options = {"step_size": float(interval) / parts, "solver": "Euler"} if kind == "step" else {}
    # Of both kinds the one whose error the setting controls: many co-simulations choose their step.
    exchanged = model.modelExchange is not None and (kind == "tolerance" or model.coSimulation is None)
    result = simulate_fmu(
        path,
        fmi_type="ModelExchange" if exchanged else "CoSimulation",
        stop_time=float(stop),
        output_interval=float(interval) / (1 if exchanged else parts),
        relative_tolerance=float(value) if kind == "tolerance" else None,
        start_values={name: float(variables[name].start) + offset for name, offset in offsets.items()},
        output=names,
        record_events=False,
        **step_options,
    )
    rows = result if exchanged else result[::parts]
    columns = np.column_stack([np.asarray(rows[name], dtype=np.float64) for name in rows.dtype.names])
    header = ",".join(f'"{name}"' for name in rows.dtype.names)
    np.savetxt(out, columns, fmt="%.17g", delimiter=",", header=header, comments="")


if __name__ == "__main__":
    main()
    os._exit(0)  # the table is written; memory that an FMU has damaged must not abort the end of the process
