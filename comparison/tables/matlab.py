"""MATLAB files of version 4 to 7, read in a process: ``python -m comparison.tables.matlab FILE BYTES``.

scipy's parser trusts the sizes stated in a file: one wrong byte can end its process, or take all memory.
"""

import io
import sys
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np

_MISFIT = "times of its own"
_TIMES = ("time", "t", "tout")


def main() -> None:
    """Write the vectors of a file to standard output as .npz (no pickle), and descriptions of all else.

    The process may take BYTES of address space; the libraries take some of it.
    """
    from scipy.io import loadmat

    file, most = sys.argv[1], int(sys.argv[2])
    with suppress(ImportError):  # Windows lacks it
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        limit = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(resource.RLIMIT_AS, (limit, hard))
    content = loadmat(file, appendmat=False, simplify_cells=True)
    # Lines of names need their full width.
    is_trajectory = "Aclass" in content
    variables = _trajectory(loadmat(file, appendmat=False)) if is_trajectory else _variables(content)
    others = {name: text for name, value in variables.items() if (text := _other(value))}
    vectors = {name: value.astype(np.float64) for name, value in variables.items() if name not in others}
    descriptions = [f"{name} ({text})" for name, text in others.items()]
    buffer = io.BytesIO()
    np.savez(buffer, np.array(list(vectors), dtype=str), np.array(descriptions, dtype=str), *vectors.values())
    sys.stdout.buffer.write(buffer.getvalue())


def _trajectory(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the variables of a result of Dymola or OpenModelica, with constants at all times.

    ``Aclass`` says by "binTrans" or "binNormal" whether the matrices are transposed. Of each name
    ``dataInfo`` has the matrix (0: the abscissa of all) and, with its sign, the row. The first row of a
    matrix has its times; of a matrix with other times, such as ``data_1``, only constants are taken.
    """
    transposed = "binTrans" in "".join(map(str, content["Aclass"]))
    names = [str(line) for line in content["name"]]
    if transposed:
        names = ["".join(letters) for letters in zip(*names, strict=True)]
    data = {key: value if transposed else value.T for key, value in content.items() if key.startswith("data")}
    times = data["data_2"][0]
    variables: dict[str, Any] = {}
    for name, number, row in zip(names, *data["dataInfo"][:2].astype(int), strict=True):
        matrix = data[f"data_{number or 2}"]
        values = -matrix[-row - 1] if row < 0 else matrix[row - 1]
        if number != 0 and not np.array_equal(matrix[0], times):
            constant = (values == values[0]).all()
            values = np.full(times.size, values[0]) if constant else f"of data_{number}, which has {_MISFIT}"
        variables[name.strip()] = values
    return variables


def _variables(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return a file's variables, the fields of structures, the columns of matrices with a row for each time.

    The fields of several structures are named ``structure.field``, columns ``matrix(1)``.
    """
    variables = {name: value for name, value in content.items() if not name.startswith("__")}
    structures = {name: variables.pop(name) for name in content if isinstance(content[name], dict)}
    for name, fields in structures.items():
        if "signals" in fields:
            fields = _signals(name, fields)
        if len(structures) > 1 or set(fields) & set(variables):
            fields = {f"{name}.{key}": value for key, value in fields.items()}
        variables |= fields
    times = [name for name in variables if name.rpartition(".")[2].lower() in _TIMES]
    for name in times[1:]:  # such as tout beside the time of a structure
        if structures and np.array_equal(variables[name], variables[times[0]]):
            del variables[name]
    size = np.size(variables[times[0]]) if times else 0
    for name, value in list(variables.items()):
        if np.ndim(value) == 2 and value.shape[0] == size != value.shape[1] and value.dtype.kind in "fiu":
            del variables[name]
            variables |= {f"{name}({n})": column for n, column in enumerate(value.T, 1)}
    return variables


def _signals(name: str, fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the signals of Simulink's structure, with its time if it has one, by their labels or blocks."""
    signals = fields["signals"]
    variables = {"time": fields["time"]} if np.size(fields.get("time", [])) else {}
    for n, signal in enumerate(signals if isinstance(signals, list) else [signals], 1):
        label, block = (np.atleast_1d(signal.get(key, "")).tolist() for key in ("label", "blockName"))
        label = "".join(label) or "".join(block).rpartition("/")[2] or f"{name}.signals({n})"
        variables[f"{label}.signals({n})" if label in variables else label] = signal["values"]
    return variables


def _other(value: Any) -> str:
    """Describe a variable that is not a real vector; empty for one that is."""
    if isinstance(value, str) and value.endswith(_MISFIT):
        return value
    value = np.asarray(value)
    is_vector = value.ndim == 1 and value.dtype.kind in "fiu"
    return "" if is_vector else f"{value.dtype.name} of shape {value.shape}"


if __name__ == "__main__":
    main()
