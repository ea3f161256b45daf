"""What a file is, by its first bytes; its ending says nothing."""

from __future__ import annotations

from pathlib import Path

from comparison.files import check_size
from comparison.tables.frames import LARGEST
from comparison.tables.table import TableError

_MATLAB = (b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file")
_BINARY = 1024  # bytes in which text has no zero byte


def kind(path: Path) -> str:
    """Return "parquet", "excel", "mat" or "text".

    Raises
    ------
    TableError
        If it cannot be opened, or is of a kind that is not read: with what to do instead.
    """
    try:
        check_size(path, LARGEST)
        with path.open("rb") as file:
            head = file.read(_BINARY)
    except OSError as error:
        raise TableError(f"{path}: {error.strerror or error}") from error
    if head.startswith(b"PAR1"):
        return "parquet"
    if head.startswith(b"PK\x03\x04"):
        return "excel"
    if head.startswith(_MATLAB) or path.suffix.lower() == ".mat":
        return "mat"
    if head.startswith(b"\xd0\xcf\x11\xe0"):
        raise TableError(f"{path}: is a workbook of Excel before 2007: save its sheet as .csv or .xlsx")
    if head.startswith(b"\x89HDF"):
        raise TableError(
            f"{path}: is an HDF5 file: export its columns as CSV, with their names in the first line"
        )
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise TableError(f"{path}: is text in UTF-16: save it as UTF-8")
    if b"\0" in head:
        raise TableError(
            f"{path}: is a binary file: let the program write text or CSV (of OpenFAST OutFileFmt = 1)"
        )
    return "text"
