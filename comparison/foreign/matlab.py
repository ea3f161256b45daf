"""MATLAB's .mat files: vectors of equal length, by themselves or as the fields of one structure."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat

from comparison.foreign.exports import Column
from comparison.table import TableError


def read_mat(path: Path) -> tuple[list[Column], list[str]]:
    """Read the vectors of a .mat file.

    Parameters
    ----------
    path
        A file of MATLAB's version 4 to 7.

    Returns
    -------
    columns
        Of real numbers. Fields of a structure are called by their own names if it is the only one, else
        ``structure.field``.
    others
        What else the file holds, each with its kind.

    Raises
    ------
    TableError
        If it cannot be read, or the vectors are not of one length.
    """
    try:
        content = loadmat(str(path), appendmat=False, squeeze_me=True)
    except OSError as error:
        raise TableError(f"{path}: {error.strerror or error}") from error
    except NotImplementedError as error:
        raise TableError(f"{path}: is of MATLAB's version 7.3 (HDF5): save it with the option -v7") from error
    except Exception as error:  # a broken file ends wherever scipy's parser stumbles
        raise TableError(f"{path}: is no .mat file that can be read") from error
    variables = {name: value for name, value in content.items() if not name.startswith("__")}
    structures = [name for name, value in variables.items() if _is_structure(value)]
    for name in structures:
        fields = {field: variables[name][field][()] for field in variables[name].dtype.names}
        if len(structures) > 1 or set(fields) & (set(variables) - {name}):
            fields = {f"{name}.{field}": value for field, value in fields.items()}
        del variables[name]
        variables |= fields
    vectors = {name: value for name, value in variables.items() if _is_vector(value)}
    lengths = {name: value.size for name, value in vectors.items()}
    if len(set(lengths.values())) > 1:
        (first, one), (second, other) = _two_lengths(lengths)
        raise TableError(f"{path}: {first} holds {one} numbers and {second} {other}")
    columns = [Column(name, None, value.astype(np.float64)) for name, value in vectors.items()]
    others = [f"{name} ({_kind(value)})" for name, value in variables.items() if name not in vectors]
    return columns, others


def _is_structure(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.names is not None and value.shape == ()


def _is_vector(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "fiu"


def _two_lengths(lengths: dict[str, int]) -> list[tuple[str, int]]:
    """Return the first vector and the first one of another length."""
    first = next(iter(lengths.items()))
    return [first, next(item for item in lengths.items() if item[1] != first[1])]


def _kind(value: Any) -> str:
    """Say what a variable is instead of a vector of real numbers."""
    value = np.asarray(value)
    if value.dtype.names is not None:
        return "structure"
    if value.dtype.kind not in "fiu":
        return {"c": "complex numbers", "U": "text", "b": "truth values"}.get(
            value.dtype.kind, "objects or cells"
        )
    return "single number" if value.ndim == 0 else f"matrix of {' x '.join(map(str, value.shape))}"
