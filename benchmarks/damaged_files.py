"""Damaged files: what the reader, the gates and the batch make of tables with a mistake in them.

Run ``python benchmarks/damaged_files.py`` (minutes) or with ``--smoke`` (seconds). The tables come
from `tumble`, which shares no code with accelcal, and are written in four layouts. Each file gets
one mistake of those that loggers, spreadsheets, disks and people make. It is then

refused
    by one line with the place, the rule and the remedy;
told
    in a note of the reader, a warning or a gate that the whole file does not have;
harmless
    as no coefficient left its interval of the whole file;
wrong
    in silence: a coefficient did, and nothing is said. This is what must not be.

A file counts as a fault of accelcal where anything else happens, and where `batch` says other than
`fit`. With ``--keep FOLDER`` the files that are wrong or a fault stay there.
"""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import numpy as np
from tumble import Stand, Unit, readings

import accelcal
from accelcal.results.calibration import Calibration

OUTCOMES = ("refused", "told", "harmless", "wrong", "fault")
TEMPERATURES = (20.0, 60.0, -40.0)
NAMES = ("K0", "K1", "K2", "K3", "M", "M_ip")


class Sheet(NamedTuple):
    """The cells of a file.

    Attributes
    ----------
    head : list of str
        Header lines.
    headings : list of str
        Headings.
    rows : list of list of str
        Cells.
    separator, decimal : str
        Between cells, and in numbers.
    outputs : range
        Columns of the readings.
    """

    head: list[str]
    headings: list[str]
    rows: list[list[str]]
    separator: str
    decimal: str
    outputs: range

    def text(self) -> bytes:
        """The file."""
        lines = [*self.head, *map(self.separator.join, [self.headings, *self.rows])]
        return ("\n".join(lines) + "\n").encode()

    def output(self, rng: Random) -> tuple[list[str], int]:
        """The row and the column of some reading."""
        return rng.choice(self.rows), rng.choice(self.outputs)


Damage = Callable[[Random, Sheet], Sheet | bytes]


# -- whole files -----------------------------------------------------------------------------------


def long(columns: Mapping[str, list[float]]) -> Sheet:
    """A row a reading."""
    numbers = zip(*(columns[n] for n in ("temperature", "angle", "stroke", "output")), strict=True)
    rows = [[f"{t:g}", f"{a / 45.0 + 1:g}", f"{k:g}", f"{y:.7f}"] for t, a, k, y in numbers]
    head = ["# serial: AL-7", "# unit: mA", "# T0: 20"]
    return Sheet(head, ["temperature", "position", "stroke", "output"], rows, ",", ".", range(3, 4))


def wide(columns: Mapping[str, list[float]]) -> Sheet:
    """A row a position."""
    found: dict[tuple[float, float], dict[float, str]] = {}
    for t, a, k, y in zip(*list(columns.values())[1:], strict=True):
        found.setdefault((t, a), {})[k] = f"{y:.7f}"
    rows = [
        [f"{t:g}", f"{a / 45.0 + 1:g}", *(y[k] for k in sorted(y))]
        for (t, a), y in sorted(found.items(), key=lambda item: TEMPERATURES.index(item[0][0]))
    ]
    strokes = len(rows[0]) - 2
    headings = ["T", "J", *(f"Y{k}" for k in range(1, strokes + 1))]
    return Sheet(["# unit: mA"], headings, rows, "\t", ".", range(2, 2 + strokes))


def european(columns: Mapping[str, list[float]]) -> Sheet:
    """As a spreadsheet with a decimal comma writes it."""
    sheet = long(columns)
    rows = [[cell.replace(".", ",") for cell in row] for row in sheet.rows]
    return sheet._replace(
        head=[], headings=["T [degC]", "J", "k", "Y [mA]"], rows=rows, separator=";", decimal=","
    )


def full(columns: Mapping[str, list[float]]) -> Sheet:
    """A row a reading, each the mean of ten samples, with its time and run."""
    sheet = long(columns)
    levels = [f"{t:g}" for t in TEMPERATURES]
    rows = [
        [*row, "0.0000213", "10", f"{90 * i}", chr(ord("a") + levels.index(row[0])), "o+"]
        for i, row in enumerate(sheet.rows)
    ]
    headings = [*sheet.headings, "std", "n", "time [s]", "run", "mounting"]
    return sheet._replace(headings=headings, rows=rows)


LAYOUTS = (long, wide, european, full)


# -- mistakes in a reading -------------------------------------------------------------------------


def _in_reading(change: Callable[[Random, str], str]) -> Damage:
    def damage(rng: Random, sheet: Sheet) -> Sheet:
        row, column = sheet.output(rng)
        row[column] = change(rng, row[column])
        return sheet

    return damage


def _another_digit(rng: Random, cell: str) -> str:
    place = rng.choice([i for i, letter in enumerate(cell) if letter.isdigit()])
    return cell[:place] + rng.choice("0123456789") + cell[place + 1 :]


def _digits_exchanged(rng: Random, cell: str) -> str:
    places = [i for i in range(len(cell) - 1) if cell[i : i + 2].isdigit()]
    i = rng.choice(places)
    return cell[:i] + cell[i + 1] + cell[i] + cell[i + 2 :]


def _without(letters: str) -> Callable[[Random, str], str]:
    return lambda _, cell: cell.translate(dict.fromkeys(map(ord, letters)))


def _other_sign(_: Random, cell: str) -> str:
    return cell[1:] if cell.startswith("-") else f"-{cell}"


def _other_prefix(_: Random, cell: str) -> str:
    return f"{float(cell.replace(',', '.')) * 1e3:.4f}".replace(".", "," if "," in cell else ".")


def _other_decimal(_: Random, cell: str) -> str:
    return cell.translate(str.maketrans(".,", ",."))


def _becomes(*words: str) -> Callable[[Random, str], str]:
    return lambda rng, _: rng.choice(words)


# -- mistakes in rows and columns ------------------------------------------------------------------


def _in_cell(column: int, change: Callable[[Random, str], str]) -> Damage:
    def damage(rng: Random, sheet: Sheet) -> Sheet:
        row = rng.choice(sheet.rows)
        row[column] = change(rng, row[column])
        return sheet

    return damage


def _in_some_cell(rng: Random, sheet: Sheet) -> Sheet:
    row = rng.choice(sheet.rows)
    row[rng.randrange(len(row))] = rng.choice(("", "x", "0", "-1", "3", "1e9", "o-", "b", "1;2"))
    return sheet


def _another(*values: str) -> Callable[[Random, str], str]:
    return lambda rng, cell: rng.choice([value for value in values if value != cell])


def _rows(change: Callable[[Random, list[list[str]]], Iterable[list[str]]]) -> Damage:
    return lambda rng, sheet: sheet._replace(rows=list(change(rng, sheet.rows)))


def _lost(rng: Random, rows: list[list[str]]) -> list[list[str]]:
    place = rng.randrange(len(rows))
    return rows[:place] + rows[place + 1 :]


def _twice(rng: Random, rows: list[list[str]]) -> list[list[str]]:
    place = rng.randrange(len(rows))
    return [*rows[:place], rows[place], *rows[place:]]


def _ends_early(rng: Random, rows: list[list[str]]) -> list[list[str]]:
    return rows[: rng.randrange(len(rows) // 3, len(rows))]


def _run_pasted(rng: Random, rows: list[list[str]]) -> list[list[str]]:
    """The outputs of one run stand in another one as well."""
    runs: dict[str, list[list[str]]] = {}
    for row in rows:
        runs.setdefault(row[0], []).append(row)
    one, other = rng.sample(sorted(runs), 2)
    pairs = zip(runs[one], runs[other], strict=True)
    return [row for row in rows if row[0] != other] + [[o[0], *r[1:]] for r, o in pairs]


def _neighbours_exchanged(rng: Random, sheet: Sheet) -> Sheet:
    place, column = rng.randrange(len(sheet.rows) - 1), rng.choice(sheet.outputs)
    one, other = sheet.rows[place], sheet.rows[place + 1]
    one[column], other[column] = other[column], one[column]
    return sheet


def _column_slips(rng: Random, sheet: Sheet) -> Sheet:
    """From some row on each reading stands a row too low."""
    start, column = rng.randrange(len(sheet.rows) - 1), rng.choice(sheet.outputs)
    moved = [row[column] for row in sheet.rows]
    for place in range(start + 1, len(sheet.rows)):
        sheet.rows[place][column] = moved[place - 1]
    return sheet


def _headings_again(rng: Random, sheet: Sheet) -> Sheet:
    sheet.rows.insert(rng.randrange(1, len(sheet.rows)), list(sheet.headings))
    return sheet


def _headings_exchanged(rng: Random, sheet: Sheet) -> Sheet:
    one, other = rng.sample(range(len(sheet.headings)), 2)
    names = sheet.headings
    names[one], names[other] = names[other], names[one]
    return sheet


def _in_head(change: Callable[[Random, str], list[str]]) -> Damage:
    """A mistake in a header line, or in the headings of a file that has none."""

    def damage(rng: Random, sheet: Sheet) -> Sheet:
        if not sheet.head:
            return _heading_misspelt(rng, sheet)
        place = rng.randrange(len(sheet.head))
        sheet.head[place : place + 1] = change(rng, sheet.head[place])
        return sheet

    return damage


def _another_letter(rng: Random, line: str) -> list[str]:
    place = rng.randrange(len(line))
    return [line[:place] + rng.choice("aemM_ :;,.0157#") + line[place + 1 :]]


def _heading_misspelt(rng: Random, sheet: Sheet) -> Sheet:
    place = rng.randrange(len(sheet.headings))
    sheet.headings[place] = sheet.headings[place][:-1] + "x"
    return sheet


def _column_lost(rng: Random, sheet: Sheet) -> Sheet:
    place = rng.randrange(len(sheet.headings))
    for row in [sheet.headings, *sheet.rows]:
        del row[place]
    return sheet


def _cell_lost(rng: Random, sheet: Sheet) -> Sheet:
    row = rng.choice(sheet.rows)
    del row[rng.randrange(len(row))]
    return sheet


# -- mistakes of the disk --------------------------------------------------------------------------


def _cut(rng: Random, sheet: Sheet) -> bytes:
    data = sheet.text()
    return data[: rng.randrange(len(data) // 3, len(data) - 1)]


def _at_some_byte(change: Callable[[Random, bytes], bytes]) -> Damage:
    def damage(rng: Random, sheet: Sheet) -> bytes:
        data = sheet.text()
        place = rng.randrange(len(data))
        return data[:place] + change(rng, data[place : place + 1]) + data[place + 1 :]

    return damage


def _bit_flipped(rng: Random, byte: bytes) -> bytes:
    return bytes([byte[0] ^ (1 << rng.randrange(8))])


def _line_feed_lost(rng: Random, sheet: Sheet) -> bytes:
    data = sheet.text()
    place = rng.choice([i for i, byte in enumerate(data[:-1]) if byte == ord("\n")])
    return data[:place] + data[place + 1 :]


def _sector_of_zeros(rng: Random, sheet: Sheet) -> bytes:
    data = sheet.text()
    place = 512 * rng.randrange(len(data) // 512)
    return data[:place] + bytes(512) + data[place + 512 :]


DAMAGES: Mapping[str, Damage] = {
    "a digit of a reading is another": _in_reading(_another_digit),
    "two digits of a reading exchanged": _in_reading(_digits_exchanged),
    "decimal sign of a reading lost": _in_reading(_without(".,")),
    "sign of a reading lost or gained": _in_reading(_other_sign),
    "a reading 1000 times too large": _in_reading(_other_prefix),
    "point for comma in a reading": _in_reading(_other_decimal),
    "a reading is empty": _in_reading(_becomes("")),
    "a reading is a word": _in_reading(_becomes("OVLD", "#REF!", "n/a", "--", "err 17")),
    "a reading is a marker": _in_reading(_becomes("9.9E37", "-999", "9999", "1E+38")),
    "a reading is 0": _in_reading(_becomes("0")),
    "temperature of a row is another": _in_cell(0, _another("20", "60", "-40")),
    "temperature of a row mistyped": _in_cell(0, _another("2", "600", "21", "-4", "200")),
    "position of a row is another": _in_cell(1, _another(*"123456789")),
    "position of a row mistyped": _in_cell(1, _another("0", "10", "45", "1.5", "")),
    "any cell is overwritten": _in_some_cell,
    "a row is lost": _rows(_lost),
    "a row stands twice": _rows(_twice),
    "the test ends early": _rows(_ends_early),
    "readings of a run pasted into another": _rows(_run_pasted),
    "readings of two rows exchanged": _neighbours_exchanged,
    "a column slips by a row": _column_slips,
    "a header line is lost": _in_head(lambda _, __: []),
    "a letter of a header line is another": _in_head(_another_letter),
    "headings again among the rows": _headings_again,
    "two headings exchanged": _headings_exchanged,
    "a heading misspelt": _heading_misspelt,
    "a column is lost": _column_lost,
    "a cell is lost": _cell_lost,
    "cut off": _cut,
    "a bit flipped": _at_some_byte(_bit_flipped),
    "a byte lost": _at_some_byte(lambda _, __: b""),
    "a line feed lost": _line_feed_lost,
    "a sector of zeros": _sector_of_zeros,
}


# -- what becomes of them --------------------------------------------------------------------------


class Reading(NamedTuple):
    """What accelcal makes of a file: a refusal, or calibrations and what is said."""

    refusal: str
    calibrations: tuple[Calibration, ...]
    said: Counter[str]


def read(path: Path) -> Reading:
    """Read a file and fit it as the command does."""
    try:
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always")
            records = accelcal.read_tables(path)
            found = tuple(map(accelcal.fit, records))
    except accelcal.AccelcalError as error:
        return Reading(str(error), (), Counter())
    notes = [note for record in records for note in record.notes]
    gates = [
        f"{gate.name} {gate.verdict}"
        for one in found
        for gate in [*one.gates, *(gate for table in one.tables for gate in table.gates)]
        if gate.verdict != "pass"
    ]
    cautions = [w for one in found for w in one.warnings]
    cautions += [w for one in found for table in one.tables for w in table.warnings]
    sentences = [*notes, *gates, *cautions, *(str(each.message) for each in heard)]
    return Reading("", found, Counter(re.sub(r"[-+\d.e]+", "0", text) for text in sentences))


def outcome(before: Reading, after: Reading) -> str:
    """Which of `OUTCOMES` a damaged file has."""
    if after.refusal:
        clear = "\n" not in after.refusal and ("; " in after.refusal or ", " in after.refusal)
        return "refused" if clear else "fault"
    if after.said - before.said:
        return "told"
    return "harmless" if _agree(before, after) else "wrong"


def _agree(before: Reading, after: Reading) -> bool:
    """Tell whether the coefficients of the damaged file have those of the whole one within U."""
    known = dict(_values(before))
    return all(
        value.value is None
        or (
            (true := known.get(place)) is not None
            and abs(value.value - true.value) <= (value.expanded_uncertainty or 0.0)
        )
        for place, value in _values(after)
    )


def _values(reading: Reading) -> Iterator[tuple[tuple[int | None, str], Any]]:
    """Each coefficient, with its temperature and name."""
    for one in reading.calibrations:
        for table in one.tables:
            known = table.temperature_degC
            level = None if known is None else round(known)
            yield from (((level, name), table.coefficients[name]) for name in NAMES)


def as_batch_says(folder: Path, found: Mapping[str, Reading]) -> dict[str, bool]:
    """Tell for each file whether `batch` says what `fit` says."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        frames = accelcal.batch(folder)
    refused = dict(zip(frames.errors["source"], frames.errors["message"], strict=True))
    rows = frames.tables.groupby("source")
    return {
        path: refused.get(path) == reading.refusal
        if reading.refusal
        else path in rows.groups and _same_rows(rows.get_group(path), reading.calibrations)
        for path, reading in found.items()
    }


def _same_rows(rows: Any, calibrations: Iterable[Calibration]) -> bool:
    tables = [table for one in calibrations for table in one.tables]
    if len(rows) != len(tables):
        return False
    values = [[table.coefficients[name].value for name in NAMES] for table in tables]
    expected = np.array(values, dtype=np.float64)
    size = np.fmax(np.abs(expected), 1e-3 * np.nanmax(np.abs(expected), axis=1, keepdims=True))
    close = np.abs(rows[list(NAMES)].to_numpy() - expected) <= 1e-8 * size
    return bool((close | np.isnan(expected)).all())


def campaign(name: str, files: int, seed: int, keep: Path | None) -> tuple[str, Counter[str]]:
    """Damage files in one way, and count what becomes of them."""
    counts: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch, "damaged")
        folder.mkdir()
        found: dict[str, Reading] = {}
        ends: dict[str, str] = {}
        for number in range(files):
            path = folder / f"{number}.csv"
            try:
                ends[str(path)], found[str(path)] = _one(name, number, seed, path)
            except Exception as error:  # whatever it is, it is a fault
                print(f"{name}, file {number}: {error!r}", file=sys.stderr)
                counts["fault"] += 1
        same = as_batch_says(folder, found)
        for path, end in ends.items():
            counts[end if same[path] else "fault"] += 1
            if keep and (end in ("wrong", "fault") or not same[path]):
                kept = keep / f"{name.replace(' ', '-')}-{Path(path).name}"
                kept.write_bytes(Path(path).read_bytes())
    return name, counts


def _one(name: str, number: int, seed: int, path: Path) -> tuple[str, Reading]:
    layout = LAYOUTS[number % len(LAYOUTS)]
    rng = np.random.default_rng([seed, number])
    columns = readings(Unit(), Stand(), rng, temperatures=TEMPERATURES)
    path.write_bytes(layout(columns).text())
    before = read(path)
    sheet = DAMAGES[name](Random(f"{seed} {number} {name}"), layout(columns))
    path.write_bytes(sheet if isinstance(sheet, bytes) else sheet.text())
    after = read(path)
    return outcome(before, after), after


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", type=int, default=300, help="files of each mistake")
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--only", action="append", choices=DAMAGES, metavar="MISTAKE")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="keep what is wrong here")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--smoke", action="store_true", help="two files of each mistake")
    given = parser.parse_args()
    if given.keep:
        given.keep.mkdir(parents=True, exist_ok=True)
    files = 2 if given.smoke else given.files
    print(f"{files} files of each mistake, seed {given.seed}; counts\n")
    print(f"| mistake | {' | '.join(OUTCOMES)} |\n|{' --- |' * (1 + len(OUTCOMES))}")
    total: Counter[str] = Counter()
    work = partial(campaign, files=files, seed=given.seed, keep=given.keep)
    with ProcessPoolExecutor(given.jobs) as pool:
        for name, counts in pool.map(work, given.only or DAMAGES):
            print(f"| {name} | {' | '.join(str(counts[each]) for each in OUTCOMES)} |")
            total += counts
    print(f"| **all** | {' | '.join(str(total[each]) for each in OUTCOMES)} |")


if __name__ == "__main__":
    main()
