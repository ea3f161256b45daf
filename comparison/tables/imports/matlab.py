"""MATLAB .mat files: vectors of equal length, as variables or as the fields of one structure; Dymola's.

scipy's parser trusts the sizes stated in a file: one wrong byte can make it read outside its memory, which
ends the process. Untrusted files are therefore read in a separate process, ``python -m`` this module, which
returns the vectors as .npz (numbers only, no pickle).
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

from comparison.files import check_size
from comparison.tables.frames import LARGEST
from comparison.tables.imports.text import Column
from comparison.tables.table import TableError

_LONGEST = 600.0
"""s to read a file."""
_MEMORY = 4 * LARGEST
"""Bytes of address space to read it in: it is compressed, and may be small. The libraries take some of it."""
_OTHERS, _REFUSED = "others", "refused"
_VECTOR = "vector "
"""Prefix of the names of vectors, to avoid collisions with the two keys above and numpy's arguments."""


def read_mat(path: Path) -> tuple[list[Column], list[str]]:
    """Read the vectors of a .mat file.

    Parameters
    ----------
    path
        A file of MATLAB's version 4 to 7.

    Returns
    -------
    columns
        Real vectors. The fields of a single structure keep their names; of several, they are
        ``structure.field``.
    others
        Other contents of the file, each with its type.

    Raises
    ------
    TableError
        If it cannot be read, or the vectors differ in length.
    """
    try:
        check_size(path, LARGEST)
    except OSError as error:
        raise TableError(f"{path}: {error.strerror or error}") from error
    # -P: do not import a module of the same name from the working directory.
    reader = [sys.executable, "-P", "-m", __spec__.name, str(path)]
    try:
        done = subprocess.run(reader, capture_output=True, check=False, timeout=_LONGEST)
    except subprocess.TimeoutExpired as error:
        raise TableError(f"{path}: cannot be read within {_LONGEST:g} s") from error
    if done.returncode != 0:
        raise TableError(f"{path}: is not a readable .mat file")
    content = dict(np.load(BytesIO(done.stdout), allow_pickle=False))
    others, refused = (content.pop(key).tolist() for key in (_OTHERS, _REFUSED))
    if refused:
        raise TableError(f"{path}: {refused}")
    vectors = {name.removeprefix(_VECTOR): vector for name, vector in content.items()}
    lengths = {name: vector.size for name, vector in vectors.items()}
    if len(set(lengths.values())) > 1:
        (first, one), (second, other) = _two_lengths(lengths)
        raise TableError(f"{path}: {first} holds {one} numbers and {second} {other}")
    return [Column(name, None, vector) for name, vector in vectors.items()], others


def _two_lengths(lengths: Mapping[str, int]) -> list[tuple[str, int]]:
    """Return the first vector and the first one of another length."""
    first = next(iter(lengths.items()))
    return [first, next(item for item in lengths.items() if item[1] != first[1])]


def _load(path: str) -> tuple[dict[str, Any], str]:
    """Return the variables of a file, and the reason if there are none."""
    from scipy.io import loadmat

    try:
        content = loadmat(path, appendmat=False, squeeze_me=True)
        # The lines of names need their full width.
        return (_trajectory(loadmat(path, appendmat=False)) if "Aclass" in content else content), ""
    except OSError as error:
        if error.strerror is None:  # scipy's, for a truncated file
            raise
        return {}, error.strerror
    except NotImplementedError:
        return {}, "is of MATLAB's version 7.3 (HDF5): save it with the option -v7"


def _trajectory(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the variables of a result of Dymola or OpenModelica, with constants at all times.

    ``Aclass`` says by "binTrans" or "binNormal" whether the matrices are transposed. Of each name
    ``dataInfo`` has the matrix (0: the abscissa, 1: constants, 2: over time) and, with its sign, the row.
    """
    lines = [str(line) for line in content["Aclass"]]
    transposed = "binTrans" in "".join(lines)
    texts = [str(line) for line in content["name"]]
    names = ["".join(column).strip() for column in zip(*texts, strict=True)] if transposed else texts
    info, constant, varying = (
        content[key] if transposed else content[key].T for key in ("dataInfo", "data_1", "data_2")
    )
    variables = {}
    for n, name in enumerate(names):
        where, row = int(info[0, n]), int(info[1, n])
        values = (
            constant[abs(row) - 1, 0] + np.zeros(varying.shape[1]) if where == 1 else varying[abs(row) - 1]
        )
        variables[name.strip()] = -values if row < 0 else values
    return variables


def _vectors(content: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """Return the real vectors, and descriptions of the other contents."""
    variables = {name: value for name, value in content.items() if not name.startswith("__")}
    structures = [name for name, value in variables.items() if _is_structure(value)]
    for name in structures:
        fields = {field: variables[name][field][()] for field in variables[name].dtype.names}
        if len(structures) > 1 or set(fields) & (set(variables) - {name}):
            fields = {f"{name}.{field}": value for field, value in fields.items()}
        del variables[name]
        variables |= fields
    vectors = {name: value.astype(np.float64) for name, value in variables.items() if _is_vector(value)}
    return vectors, [f"{name} ({_kind(value)})" for name, value in variables.items() if name not in vectors]


def _is_structure(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.names is not None and value.shape == ()


def _is_vector(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "fiu"


def _kind(value: Any) -> str:
    """Describe a variable that is not a real vector."""
    value = np.asarray(value)
    if value.dtype.names is not None:
        return "structure"
    if value.dtype.kind not in "fiu":
        return {"c": "complex numbers", "U": "text", "b": "booleans"}.get(
            value.dtype.kind, "objects or cells"
        )
    return "single number" if value.ndim == 0 else f"matrix of {' x '.join(map(str, value.shape))}"


def main() -> None:
    """Write the vectors of the given file to standard output; any failure ends this process."""
    if resource is not None:
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        most = _MEMORY if hard == resource.RLIM_INFINITY else min(_MEMORY, hard)
        resource.setrlimit(resource.RLIMIT_AS, (most, hard))
    content, refused = _load(sys.argv[1])
    vectors, others = _vectors(content)
    packed = BytesIO()
    named: dict[str, Any] = {f"{_VECTOR}{name}": vector for name, vector in vectors.items()}
    np.savez(packed, **(named | {_OTHERS: np.array(others, dtype=str), _REFUSED: np.array(refused)}))
    sys.stdout.buffer.write(packed.getvalue())


if __name__ == "__main__":
    main()
