"""A calibration as the text of a C header, of YAML or of CSV, and as a file of it."""

from __future__ import annotations

import hashlib
import os
import warnings

from accelcal.arguments.endings import ending_of
from accelcal.arguments.options import check_choice
from accelcal.atomic import write_text
from accelcal.compensate.choice import compensation
from accelcal.errors import AccelcalWarning
from accelcal.export.c_header import to_c_header
from accelcal.export.content import export_content
from accelcal.export.plain_text import to_csv, to_yaml
from accelcal.results.calibration import Calibration

__all__ = ["FORMS", "export_text", "form_of", "write_export"]

FORMS = ("c", "yaml", "csv")
"""What an export may be written as."""

_FORM_OF_ENDING = {".h": "c", ".hpp": "c", ".yaml": "yaml", ".yml": "yaml", ".csv": "csv"}


def write_export(
    calibration: Calibration,
    path: str | os.PathLike[str],
    *,
    form: str | None = None,
    run: str | int | None = None,
) -> None:
    """Write a calibration for those who run navigation code.

    Parameters
    ----------
    calibration : Calibration
        The calibration.
    path : path
        File to write, whole or not at all.
    form : {"c", "yaml", "csv"}, optional
        The form; by default that of the file's extension: .h, .hpp, .yaml, .yml or .csv.
    run : str or int, optional
        Export the table of this run only.

    Raises
    ------
    InputError
        If the form is another, the calibration does not say which coefficients to use, or it has
        effects without which they do not give the acceleration.

    Warns
    -----
    AccelcalWarning
        About every coefficient that was not determined, and what is assumed in its place.

    Examples
    --------
    >>> import accelcal
    >>> from tempfile import TemporaryDirectory
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> with TemporaryDirectory() as folder:
    ...     write_export(calibration, f"{folder}/al15.h")
    """
    form = form_of(path) if form is None else form
    sha256 = hashlib.sha256(calibration.to_json().encode()).hexdigest()
    write_text(path, export_text(calibration, form, sha256, run))


def export_text(
    calibration: Calibration, form: str, sha256: str | None = None, run: str | int | None = None
) -> str:
    """Write an export in one of `FORMS`, and warn of what is assumed.

    Parameters
    ----------
    calibration : Calibration
        The calibration.
    form : {"c", "yaml", "csv"}
        The form.
    sha256 : str, optional
        SHA-256 of the document of the calibration, in hexadecimal.
    run : str or int, optional
        Export the table of this run only.

    Returns
    -------
    str
        The text.

    Raises
    ------
    InputError
        As by `write_export`.
    """
    check_choice(FORMS, form=form)
    content = export_content(calibration, sha256, run)
    for assumption in content["assumptions"]:
        warnings.warn(assumption, AccelcalWarning, stacklevel=4)
    if form == "c":
        return to_c_header(content, compensation(calibration, run, effects=False))
    return to_yaml(content) if form == "yaml" else to_csv(content)


def form_of(path: str | os.PathLike[str]) -> str:
    """Tell the form of an export by the name of its file.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    str
        One of `FORMS`.

    Raises
    ------
    InputError
        If the name ends otherwise.
    """
    return _FORM_OF_ENDING[ending_of(path, _FORM_OF_ENDING, "choose one, or give form='c'")]
