"""Results that the processes of this machine hand over as files.

A process that is killed while its result is on the way through a pipe leaves the other one waiting
for the rest of it. The name of a file is so short that it comes whole or not at all.
"""

from __future__ import annotations

import pickle
from pathlib import Path
from tempfile import NamedTemporaryFile

from accelcal.archive.block import Block, Outcome, fit_block
from accelcal.archive.cells import Columns
from accelcal.archive.settings import Settings
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
        The file, for `from_file` of the same batch.

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


def from_file(path: str) -> Outcome[Columns]:
    """Take up such a file.

    Parameters
    ----------
    path : str
        What `fit_to_file` returned; it is removed.

    Returns
    -------
    Outcome
        What came of the block.
    """
    found: Outcome[Columns] = pickle.loads(Path(path).read_bytes())
    Path(path).unlink()
    return found
