"""Results that the processes of this machine hand over as files.

A process that is killed while its result is on the way through a pipe leaves the other one waiting
for the rest of it. The name of a file is so short that it comes whole or not at all.
"""

from __future__ import annotations

import pickle
from pathlib import Path
from tempfile import NamedTemporaryFile

from accelcal.archive.block import Block, fit_block
from accelcal.archive.settings import Settings
from accelcal.archive.through import InMemory
from accelcal.errors import InputError


def fit_to_file(block: Block, settings: Settings, folder: str) -> str:
    """Read and fit a block, and put its rows into a file.

    Parameters
    ----------
    block : Block
        Files to read.
    settings : Settings
        How to fit.
    folder : str
        Where the file goes.

    Returns
    -------
    str
        The file, for `FromFiles` of the same batch.

    Raises
    ------
    InputError
        If it cannot be written, mostly for want of room.
    """
    fitted = fit_block(block, settings)
    try:
        with NamedTemporaryFile(dir=folder, delete=False) as file:
            pickle.dump(fitted, file)
    except OSError as error:
        raise InputError(
            f"{folder}: finished rows cannot be kept there: {error.strerror or error}; make room,"
            " or set TMPDIR to another folder"
        ) from None
    return file.name


class FromFiles:
    """Takes up such files, as a keeper of blocks.

    Parameters
    ----------
    kept : InMemory
        Who keeps what was in them.
    """

    def __init__(self, kept: InMemory) -> None:
        self.expect, self.serials = kept.expect, kept.serials
        self._keep = kept.keep

    def keep(self, block: Block, outcome: str) -> None:
        """Keep a finished block."""
        path = Path(outcome)
        self._keep(block, pickle.loads(path.read_bytes()))
        path.unlink()
