"""SHA-256 of what was read."""

from __future__ import annotations

import sys
from importlib import import_module

_SMALL = 500_000
"""Bytes that take less long without OpenSSL than it takes to load."""

_ALONE = "_sha256" if sys.version_info < (3, 12) else "_sha2"
"""Module of CPython that has the function alone; other Pythons may lack it."""


def sha256_of(data: bytes) -> str:
    """SHA-256 in hexadecimal.

    ``hashlib`` loads OpenSSL, which is faster, but takes longer to load than a table takes to read.

    Examples
    --------
    >>> sha256_of(b"")[:16]
    'e3b0c44298fc1c14'
    """
    if len(data) < _SMALL and "hashlib" not in sys.modules:
        try:
            digest: str = import_module(_ALONE).sha256(data).hexdigest()
        except ImportError:
            pass
        else:
            return digest
    from hashlib import sha256

    return sha256(data).hexdigest()
