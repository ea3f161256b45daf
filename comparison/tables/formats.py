"""Tables of other programs as they stand in their files, which their first bytes tell, not their ending."""

from __future__ import annotations

import csv
import io
import re
import subprocess
import sys
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np

from comparison.files import check_size
from comparison.tables.dialect import NUMBER, Column, Source, column, decoded, parse_text
from comparison.tables.table import TableError
from comparison.tables.table_files import LARGEST, read_events, read_frame, read_record

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

_HEAD = 1024  # bytes in which text has no zero byte
_REFUSED = {
    b"MATLAB 7.3 MAT-file": "is of MATLAB's version 7.3 (HDF5): save it with the option -v7",
    b"\xd0\xcf\x11\xe0": "is a workbook of Excel before 2007, or one with a password: save its sheet as .csv",
    b"\x89HDF": "is an HDF5 file: export its columns as CSV, with their names in the first line",
}
_EXPORT = "save its sheet as CSV"
_LONGEST = 600.0  # s to read a MATLAB file
_MEMORY = 4 * LARGEST
"""Bytes of address space to read it in: it is compressed, and may be small. The libraries take some of it."""
_KINDS = {"c": "complex numbers", "U": "text", "b": "booleans"}


def open_source(path: Path) -> Source:
    """Read a file; one of a kind that is not read is a `TableError` that says what to do instead."""
    try:
        check_size(path, LARGEST)
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError as error:
        raise TableError(f"{path}: {error.strerror or error}") from error
    if rule := next((rule for start, rule in _REFUSED.items() if head.startswith(start)), ""):
        raise TableError(f"{path}: {rule}")
    is_parquet, is_workbook = head.startswith(b"PAR1"), head.startswith(b"PK\x03\x04")
    # Of MATLAB's files version 4 has no signature, but zero bytes; Octave writes text to .mat as well.
    is_matlab = head.startswith(b"MATLAB 5.0 MAT-file") or (path.suffix.lower() == ".mat" and b"\0" in head)
    is_text = b"\0" not in head or head.startswith((b"\xff\xfe", b"\xfe\xff"))
    if not (is_parquet or is_workbook or is_matlab or is_text):
        hint = "let the program write text or CSV (of OpenFAST OutFileFmt = 1)"
        raise TableError(f"{path}: is a binary file: {hint}")
    if is_parquet:
        frame = read_frame(path, parquet=True)
        columns = [column(str(name), None, frame[name]) for name in frame]
        source = Source(path, columns, plain="time" in frame)
    else:
        try:
            if is_matlab:
                source = Source(path, *_vectors_of(path))
            elif is_workbook:
                source = parse_text(path, _sheet(path), ("\t",), ".")
            else:
                source = parse_text(path, decoded(path.read_bytes()))
        except TableError as error:
            raise TableError(f"{path}: {error}") from error.__cause__
    source = replace(source, events=read_events(path))
    if source.plain and path.suffix.lower() == (".parquet" if is_parquet else ".csv"):
        extrema, record = read_record(path)
        source = replace(source, extrema=extrema, record=record)
    return source


# Excel


def _sheet(path: Path) -> str:
    """Return the one sheet of a workbook that holds a table as text: of a formula its stored value counts."""
    sheets = _sheets(path)
    # A table may have columns of text; a sheet of notes has numbers beside text.
    holding = [name for name, rows in sheets.items() if any(map(_are_numbers, rows))] or [
        name for name, rows in sheets.items() if any(sum(map(_is_number, row)) > 1 for row in rows)
    ]
    if not holding:
        raise TableError("no sheet contains a row of two or more numbers")
    if len(holding) > 1:
        raise TableError(f"sheets {' and '.join(map(repr, holding))} hold numbers: save one per file")
    text = io.StringIO()
    lines = csv.writer(text, delimiter="\t", lineterminator="\n")
    lines.writerows(map(_written, row) for row in sheets[holding[0]])
    return text.getvalue()


def _sheets(path: Path) -> dict[str, list[tuple[Any, ...]]]:
    try:
        from openpyxl import load_workbook
    except ImportError as error:
        extra = "pip install 'sixbar-crossval[excel]'"
        raise TableError(f"is an Excel workbook: {extra} to read it, or {_EXPORT}") from error
    try:
        with ZipFile(path) as file:
            unpacked = sum(part.file_size for part in file.infolist())
        if unpacked <= LARGEST:
            with path.open("rb") as file, warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of styles and extensions, which do not matter here
                book = load_workbook(file, read_only=True, data_only=True)
                for sheet in book.worksheets:
                    sheet.reset_dimensions()  # some programs state wrong ones
                return {sheet.title: list(sheet.iter_rows(values_only=True)) for sheet in book.worksheets}
    # Of a damaged file the parsers of ZIP, XML and cells raise errors of many kinds.
    except Exception as error:
        raise TableError(f"is not a readable .xlsx workbook: {_EXPORT}") from error
    raise TableError(f"holds more than {LARGEST} bytes once it is unpacked")


def _are_numbers(row: Iterable[Any]) -> bool:
    cells = [cell for cell in row if cell is not None]
    return len(cells) > 1 and all(map(_is_number, cells))


def _is_number(cell: object) -> bool:
    return isinstance(cell, int | float) and not isinstance(cell, bool)


def _written(cell: object) -> str:
    """Return a cell as it is read again; text that looks like a number is marked as such, as Excel does."""
    if isinstance(cell, str) and NUMBER.fullmatch(cell.strip()):
        return f"'{cell}"
    return "" if cell is None else re.sub(r"[\r\n\0]+", " ", str(cell))


# MATLAB


def _vectors_of(path: Path) -> tuple[list[Column], list[str]]:
    """Return the real vectors of a .mat file of version 4 to 7, and descriptions of its other contents.

    scipy's parser trusts the sizes stated in a file: one wrong byte can make it end its process. It has one
    of its own, which returns the vectors as .npz (numbers only, no pickle).
    """
    # -P: do not import a module of the same name from the working directory.
    reader = [sys.executable, "-P", "-m", __spec__.name, str(path)]
    try:
        done = subprocess.run(reader, capture_output=True, check=False, timeout=_LONGEST)
    except subprocess.TimeoutExpired as error:
        raise TableError(f"cannot be read within {_LONGEST:g} s") from error
    if done.returncode != 0:
        raise TableError("is not a readable .mat file")
    names, others, *vectors = np.load(io.BytesIO(done.stdout), allow_pickle=False).values()
    if other := next((n for n, vector in enumerate(vectors) if vector.size != vectors[0].size), None):
        raise TableError(
            f"{names[0]} holds {vectors[0].size} numbers and {names[other]} {vectors[other].size}"
        )
    columns = [Column(str(name), None, vector) for name, vector in zip(names, vectors, strict=True)]
    return columns, others.tolist()


def main() -> None:
    """Write the vectors of the given MATLAB file to standard output; any failure ends this process."""
    from scipy.io import loadmat

    if resource is not None:
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        most = _MEMORY if hard == resource.RLIM_INFINITY else min(_MEMORY, hard)
        resource.setrlimit(resource.RLIMIT_AS, (most, hard))
    content = loadmat(sys.argv[1], appendmat=False, squeeze_me=True)
    if "Aclass" in content:  # the lines of names need their full width
        content = _trajectory(loadmat(sys.argv[1], appendmat=False))
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
