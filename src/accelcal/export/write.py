"""A calibration as the text of a C header, of YAML or of CSV, and as a file of it."""

from __future__ import annotations

import hashlib
import json
import os
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from accelcal.arguments.kinds import ending_of
from accelcal.arguments.options import check_choice
from accelcal.atomic import write_text
from accelcal.compensate.choice import compensation
from accelcal.compensate.triad import refuse_for_triad
from accelcal.errors import AccelcalWarning, InputError
from accelcal.export.c_header import to_c_header
from accelcal.export.content import export_content
from accelcal.export.triad import triad_content, triad_header
from accelcal.io.files.csv_text import csv_text
from accelcal.results.calibration import Calibration
from accelcal.results.triad import TriadCalibration

__all__ = ["FORMS", "export_text", "form_of", "to_csv", "to_yaml", "write_export"]


def to_yaml(content: Mapping[str, Any]) -> str:
    """Write an export as YAML.

    Parameters
    ----------
    content : mapping
        What `accelcal.export.content.export_content` returns: texts, finite numbers, truth
        values, None, and lists and mappings of them.

    Returns
    -------
    str
        The document, block by block. Texts are quoted as in JSON, which YAML understands; numbers
        always have a decimal point, without which YAML 1.1 takes 1e-5 for a text.

    Examples
    --------
    >>> print(to_yaml({"serial": "AL-15", "range": [-1.0, 1e-5], "date": None}), end="")
    serial: "AL-15"
    range:
      - -1.0
      - 1.0e-05
    date: null
    """
    return "".join(f"{line}\n" for line in _yaml_lines(content))


def _yaml_lines(value: Any) -> Iterator[str]:
    """Lines of a mapping or list that is not empty."""
    items = value.items() if isinstance(value, Mapping) else ((None, item) for item in value)
    for key, item in items:
        mark = "-" if key is None else f"{key}:"
        if not isinstance(item, Mapping | list) or not item:
            yield f"{mark} {_yaml_scalar(item)}"
            continue
        lines = _yaml_lines(item)
        if key is None:
            mark, first = "-", next(lines)
            yield f"- {first}"
        else:
            yield mark
        yield from (f"  {line}" for line in lines)


def _yaml_scalar(value: Any) -> str:
    if isinstance(value, float):
        text = repr(value)
        return text if "." in text else text.replace("e", ".0e")
    text = json.dumps(value, ensure_ascii=False)
    return "".join(c if c.isprintable() else f"\\U{ord(c):08X}" for c in text)


def to_csv(content: Mapping[str, Any]) -> str:
    """Write an export as CSV: a row for each coefficient, all else in header lines.

    Parameters
    ----------
    content : mapping
        What `accelcal.export.content.export_content` returns.

    Returns
    -------
    str
        The table. The last columns hold the covariance; cells are empty where nothing is known.
    """
    table = dict(content)
    rows, covariance = table.pop("coefficients"), table.pop("covariance")
    by_symbol = dict(zip(covariance["symbols"], covariance["matrix"], strict=True))
    said = {**table, "covariance": covariance["note"]}
    above = "".join(f"# {key}: {_on_one_line(value)}\n" for key, value in said.items())
    headings = [*rows[0], *(f"covariance_{symbol}" for symbol in by_symbol)]
    unknown = [None] * len(by_symbol)
    cells = ([*row.values(), *by_symbol.get(row["symbol"], unknown)] for row in rows)
    return above + csv_text([headings, *cells])


def _on_one_line(value: Any) -> str:
    if isinstance(value, str) and value.isprintable():
        return value
    return "" if value is None else json.dumps(value)


FORMS = ("c", "yaml", "csv")
"""What an export may be written as."""

_NAMES = {"c": "a C header", "yaml": "YAML", "csv": "CSV"}
_FORM_OF_ENDING = {".h": "c", ".hpp": "c", ".yaml": "yaml", ".yml": "yaml", ".csv": "csv"}


def write_export(
    calibration: Calibration | TriadCalibration,
    path: str | os.PathLike[str],
    *,
    form: str | None = None,
    run: str | int | None = None,
) -> None:
    """Write a calibration for those who run navigation code.

    Parameters
    ----------
    calibration : Calibration or TriadCalibration
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
        If the form is another, the calibration does not say which coefficients to use, it has
        effects without which they do not give the acceleration, or a run of a triad is given.

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
    form = form_of(path, form)
    sha256 = hashlib.sha256(calibration.to_json().encode()).hexdigest()
    write_text(path, export_text(calibration, form, sha256, run))


def export_text(
    calibration: Calibration | TriadCalibration,
    form: str,
    sha256: str | None,
    run: str | int | None,
) -> str:
    """Write an export in one of `FORMS`, and warn of what is assumed.

    Parameters
    ----------
    calibration : Calibration or TriadCalibration
        The calibration.
    form : {"c", "yaml", "csv"}
        The form.
    sha256 : str or None
        SHA-256 of the document of the calibration, in hexadecimal.
    run : str, int or None
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
    if isinstance(calibration, TriadCalibration):
        refuse_for_triad(run=run)
        content = triad_content(calibration, sha256)
    else:
        content = export_content(calibration, sha256, run)
    for assumption in content["assumptions"]:
        warnings.warn(assumption, AccelcalWarning, stacklevel=4)
    if form != "c":
        return to_yaml(content) if form == "yaml" else to_csv(content)
    if isinstance(calibration, TriadCalibration):
        return triad_header(content, calibration)
    return to_c_header(content, compensation(calibration, run, effects=False))


def form_of(path: str | os.PathLike[str], asked: str | None = None) -> str:
    """Tell the form of an export by the name of its file.

    Parameters
    ----------
    path : path
        The file.
    asked : {"c", "yaml", "csv"}, optional
        The form that was asked for.

    Returns
    -------
    str
        One of `FORMS`.

    Raises
    ------
    InputError
        If the name tells none and none is asked for, or if it promises another one.

    Examples
    --------
    >>> form_of("al15.h"), form_of("al15.txt", "yaml")
    ('c', 'yaml')
    """
    if asked is None:
        if str(path) == "-":
            raise InputError(
                "standard output has no name that tells a form; give form='c', or name a file that"
                f" ends in {', '.join(_FORM_OF_ENDING)}"
            )
        return _FORM_OF_ENDING[ending_of(path, _FORM_OF_ENDING, "choose one, or give form='c'")]
    promised = _FORM_OF_ENDING.get(Path(path).suffix.lower(), asked)
    if promised != asked and asked in FORMS:
        ends = " or ".join(end for end, form in _FORM_OF_ENDING.items() if form == asked)
        raise InputError(f"{path} would hold {_NAMES[asked]}; end its name in {ends}")
    return asked
