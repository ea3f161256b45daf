"""MATLAB files of version 4 to 7, read in a process: ``python -m comparison.tables.matlab FILE BYTES``.

scipy's parser trusts the sizes stated in a file: one wrong byte can end its process, or take all memory.
"""

import io
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

_KINDS = {"c": "complex numbers", "U": "text", "b": "booleans"}


def main() -> None:
    """Write the vectors of a file to standard output as .npz (no pickle), and descriptions of all else.

    The process may take BYTES of address space; the libraries take some of it.
    """
    from scipy.io import loadmat

    file, most = sys.argv[1], int(sys.argv[2])
    if resource is not None:
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(
            resource.RLIMIT_AS, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard)
        )
    content = loadmat(file, appendmat=False, squeeze_me=True)
    if "Aclass" in content:  # the lines of names need their full width
        content = _trajectory(loadmat(file, appendmat=False))
    variables = _variables(content)
    others = {name: what for name, value in variables.items() if (what := _other(np.asarray(value)))}
    vectors = {name: value.astype(np.float64) for name, value in variables.items() if name not in others}
    described = [f"{name} ({what})" for name, what in others.items()]
    packed = io.BytesIO()
    np.savez(packed, np.array(list(vectors), dtype=str), np.array(described, dtype=str), *vectors.values())
    sys.stdout.buffer.write(packed.getvalue())


def _trajectory(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the variables of a result of Dymola or OpenModelica, with constants at all times.

    ``Aclass`` says by "binTrans" or "binNormal" whether the matrices are transposed. Of each name
    ``dataInfo`` has the matrix (0: the abscissa, 1: constants, 2: over time) and, with its sign, the row.
    """
    transposed = "binTrans" in "".join(map(str, content["Aclass"]))
    names = [str(line) for line in content["name"]]
    if transposed:
        names = ["".join(letters) for letters in zip(*names, strict=True)]
    info, constant, varying = (
        content[key] if transposed else content[key].T for key in ("dataInfo", "data_1", "data_2")
    )
    variables = {}
    for name, matrix, row in zip(names, info[0].astype(int), info[1].astype(int), strict=True):
        place = abs(row) - 1
        values = constant[place, 0] + np.zeros(varying.shape[1]) if matrix == 1 else varying[place]
        variables[name.strip()] = -values if row < 0 else values
    return variables


def _variables(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the variables of a file; of structures their fields, of several named ``structure.field``."""
    variables = {name: value for name, value in content.items() if not name.startswith("__")}
    structures = {
        name: variables.pop(name)
        for name, value in list(variables.items())
        if isinstance(value, np.ndarray) and value.dtype.names is not None and value.shape == ()
    }
    for name, structure in structures.items():
        fields = {key: structure[key][()] for key in structure.dtype.names}
        if len(structures) > 1 or set(fields) & set(variables):
            fields = {f"{name}.{key}": value for key, value in fields.items()}
        variables |= fields
    return variables


def _other(value: np.ndarray) -> str:
    """Describe a variable that is not a real vector; empty for one that is."""
    if value.dtype.names is not None:
        return "structure"
    if value.dtype.kind not in "fiu":
        return _KINDS.get(value.dtype.kind, "objects or cells")
    if value.ndim == 1:
        return ""
    return "single number" if value.ndim == 0 else f"matrix of {' x '.join(map(str, value.shape))}"


if __name__ == "__main__":
    main()
