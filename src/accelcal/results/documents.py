"""Files of results: one calibration or discovery, or several in one document."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from accelcal.results.calibration import Calibration
from accelcal.results.result import all_of, all_to_json

if TYPE_CHECKING:
    from accelcal.results.discovery import Discovery
    from accelcal.results.stand_discovery import StandDiscovery

__all__ = ["calibrations_from_json", "calibrations_to_json"]
__all__ += ["discoveries_from_json", "discoveries_to_json"]


def calibrations_to_json(calibrations: Sequence[Calibration]) -> str:
    """Write calibrations as one JSON document.

    Parameters
    ----------
    calibrations : sequence of Calibration
        One or more.

    Returns
    -------
    str
        The document of the calibration, or one with the key ``"calibrations"`` for several.
    """
    return all_to_json(calibrations, "calibrations")


def calibrations_from_json(text: str) -> tuple[Calibration, ...]:
    """Read all calibrations of a JSON document.

    Parameters
    ----------
    text : str
        What `calibrations_to_json` returns.

    Returns
    -------
    tuple of Calibration
        One or more.

    Raises
    ------
    DocumentError
        If the text is not such a document.
    """
    return all_of(Calibration, text, "calibrations")


def discoveries_to_json(
    discoveries: Sequence[Discovery], stand: StandDiscovery | None = None
) -> str:
    """Write discoveries as one JSON document.

    Parameters
    ----------
    discoveries : sequence of Discovery
        One or more.
    stand : StandDiscovery, optional
        What they tell of their stand.

    Returns
    -------
    str
        The document of the discovery, or one with the keys ``"discoveries"`` and ``"stand"`` for
        several.
    """
    return all_to_json(discoveries, "discoveries", stand=stand)


def discoveries_from_json(text: str) -> tuple[Discovery, ...]:
    """Read all discoveries of a JSON document.

    Parameters
    ----------
    text : str
        What `discoveries_to_json` returns.

    Returns
    -------
    tuple of Discovery
        One or more.

    Raises
    ------
    DocumentError
        If the text is not such a document.
    """
    from accelcal.results.discovery import Discovery

    return all_of(Discovery, text, "discoveries")
