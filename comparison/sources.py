"""What kept results belong to: the files of this package that can change them."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path


@cache
def sources(*names: str) -> str:
    """Return the hash of files of this package.

    Parameters
    ----------
    names
        As seen from its folder, such as ``"studies/errors.py"``.
    """
    here = Path(__file__).parent
    total = hashlib.sha256()
    for name in names:
        total.update((here / name).read_bytes())
    return total.hexdigest()
