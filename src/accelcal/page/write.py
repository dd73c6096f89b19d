"""From results to the file of a report; the end of its name tells the form."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from os import PathLike

from accelcal.arguments.kinds import each_of, ending_of, kind_of, several
from accelcal.atomic import write_atomically
from accelcal.errors import InputError
from accelcal.page.blocks import Chapter, Page
from accelcal.page.calibration import calibration_chapter
from accelcal.page.discovery import discovery_chapter
from accelcal.page.render import html, markdown, pdf
from accelcal.page.stand_discovery import stand_chapter
from accelcal.plural import counted
from accelcal.record import TumbleRecord
from accelcal.results.calibration import Calibration
from accelcal.results.discovery import Discovery
from accelcal.results.stand_discovery import StandDiscovery
from accelcal.version import SOFTWARE

__all__ = ["FORMS", "Result", "form_of", "report_page", "write_report"]

Result = Calibration | Discovery | StandDiscovery

_WRITERS: Mapping[str, Callable[[Page], bytes]] = {
    "html": lambda page: html(page).encode(),
    "md": lambda page: markdown(page).encode(),
    "pdf": lambda page: pdf(html(page, on_paper=True)),
}

FORMS = tuple(_WRITERS)
"""Forms of a report; the name of its file ends in one of them."""


def write_report(
    results: Sequence[Result],
    path: str | PathLike[str],
    *,
    records: Sequence[TumbleRecord | None] = (),
) -> None:
    """Write the report of one result or of several.

    Parameters
    ----------
    results : sequence of Calibration, Discovery or StandDiscovery
        What to report, a chapter each.
    path : path
        File to write, whole or not at all; it ends in one of `FORMS`.
    records : sequence of TumbleRecord or None, optional
        Readings of each discovery, over which the signatures of effects are drawn.

    Raises
    ------
    InputError
        If the form is another, if a library or a browser that it takes is missing, or if the file
        cannot be written.

    Examples
    --------
    >>> import accelcal
    >>> from tempfile import TemporaryDirectory
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> with TemporaryDirectory() as folder:
    ...     write_report([calibration], f"{folder}/report.md")
    """
    form = form_of(path)
    write_atomically(path, _WRITERS[form](report_page(results, records)))


def form_of(path: str | PathLike[str]) -> str:
    """Tell the form of a report by the name of its file.

    Parameters
    ----------
    path : path
        Its file.

    Returns
    -------
    str
        One of `FORMS`.

    Raises
    ------
    InputError
        If it is none of them.
    """
    return ending_of(path, [f".{form}" for form in FORMS]).removeprefix(".")


def report_page(results: Sequence[Result], records: Sequence[TumbleRecord | None] = ()) -> Page:
    """Make the page of one result or of several.

    Parameters
    ----------
    results : sequence of Calibration, Discovery or StandDiscovery
        What to report, a chapter each.
    records : sequence of TumbleRecord or None, optional
        Readings of each discovery.

    Returns
    -------
    Page
        The page; the same results make the same page.
    """
    results, records = _reported(results), several(records)
    each_of([record for record in records if record is not None], TumbleRecord)
    if len(records) > len(results):
        raise InputError(f"{len(records)} records of {len(results)} results; give one for each")
    known = [*records, *[None] * (len(results) - len(records))]
    chapters = [
        _chapter(result, record, f"r{i}-" if len(results) > 1 else "")
        for i, (result, record) in enumerate(zip(results, known, strict=True))
    ]
    return Page(_title(chapters), chapters, SOFTWARE)


def _reported(results: Sequence[Result]) -> tuple[Result, ...]:
    """One result or several that have a chapter."""
    found = (results,) if isinstance(results, Result) else several(results)
    wrong = [kind_of(each) for each in found if not isinstance(each, Result)]
    if wrong or not found:
        what = wrong[0] if wrong else "nothing"
        raise InputError(f"{what} to report; give what accelcal.fit or accelcal.discover found")
    return found


def _title(chapters: Sequence[Chapter]) -> str:
    first, last = chapters[0], chapters[-1]
    if len(chapters) == 1:
        return f"{first.sort}: {first.title}"
    stands = sum(chapter.sort == "Stand" for chapter in chapters)
    title = f"{first.sort} of {counted(len(chapters) - stands, 'record')}"
    return f"{title} and the stand" if last.sort == "Stand" else title


def _chapter(result: Result, record: TumbleRecord | None, name: str) -> Chapter:
    if isinstance(result, Calibration):
        return calibration_chapter(result, name)
    if isinstance(result, Discovery):
        return discovery_chapter(result, record, name)
    return stand_chapter(result, name)
