"""What accelcal is doing, told to the logger ``accelcal`` of the standard library.

A program that has not imported `logging` cannot be listening, so it is not imported here either,
and a short command starts as quickly as without. Names from outside are told by ``%r``, which
escapes what could move a cursor.
"""

from __future__ import annotations

import sys


def tell(message: str, *values: object) -> None:
    """Log at level INFO, with the ``%`` marks of `logging` in the message.

    Examples
    --------
    >>> import logging
    >>> logging.getLogger("accelcal").setLevel(logging.INFO)
    >>> tell("%r: %d readings", "table.csv", 54)
    """
    logging = sys.modules.get("logging")
    if logging is None:
        return
    logger = logging.getLogger("accelcal")
    if not logger.handlers:
        logger.addHandler(logging.NullHandler())
    logger.info(message, *values)
