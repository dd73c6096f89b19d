"""The head calibrates itself, its certificate, and what both do for a fit."""

import dataclasses
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest
from hidden.clampings import units_on_one_head

import accelcal
from accelcal.calibrate.fit import calibrate_many
from accelcal.calibrate.options import Options
from accelcal.cli.main import main
from accelcal.estimate.declared_scatter import moderated
from accelcal.estimate.self_calibration import _noise
from accelcal.estimate.tables import prepare
from accelcal.io.words.head_words import EXPANDED, HEAD_COLUMNS, HEAD_KEYS
from accelcal.io.words.vocabulary import COLUMNS
from accelcal.numerics.covariance import posterior
from accelcal.results.head_calibration import UnitOnHead

NAMES = ("k2", "k3", "delta_ip")


def read(unit):
    return accelcal.read_table(io.StringIO(unit.text))


def alike(unit, record):
    """The readings of a unit whose table differs from that of a record in its outputs alone."""
    rows = unit.text.splitlines()[-len(record) :]
    output = np.array([float(row.rpartition(",")[2]) for row in rows])
    return dataclasses.replace(record, output=output)


def measured(seed, **options):
    graduation, units = units_on_one_head(np.random.default_rng(seed), **options)
    return graduation, units, [read(unit) for unit in units]


def one_clamping(record):
    return dataclasses.replace(record.select(record.run == 0), run_labels=("first",))


def harmonic(found, name):
    return next(item for item in found.harmonics if item.name == name)


# -- the column clamping ---------------------------------------------------------------------------


def test_clamping_is_read_and_written(tmp_path):
    _, _, (record,) = measured(1)
    assert sorted(set(record.clamping.tolist())) == [0.0, 90.0]
    np.testing.assert_array_equal(record.graduation, record.angle + record.clamping)
    path = tmp_path / "again.csv"
    accelcal.write_table(record, path)
    assert accelcal.read_table(path) == record


def test_a_header_line_stands_for_the_column():
    text = "# clamping: 90 deg\ntemperature,position,stroke,output\n20,1,1,1.3\n20,5,1,-1.3\n"
    assert accelcal.read_table(io.StringIO(text)).graduation.tolist() == [90.0, 270.0]


@pytest.mark.parametrize(
    ("column", "message"),
    [
        ("0,0,90", "run 20 holds clampings 0 and 90 deg; a clamping is a run of its own"),
        ("0,x,0", "clamping 'x' is not a number"),
        ("0,,0", "clamping is missing"),
        ("0,0,1e9", "is no angle of a head"),
    ],
)
def test_wrong_clampings_are_told_in_a_line(column, message):
    rows = zip((1, 3, 5), (1.3, 0.1, -1.3), column.split(","), strict=True)
    lines = [f"20,{place},1,{output},{c}" for place, output, c in rows]
    text = "\n".join(["temperature,position,stroke,output,clamping", *lines])
    with pytest.raises(accelcal.InputError, match=message) as caught:
        accelcal.read_table(io.StringIO(text))
    assert str(caught.value).startswith("<table>")


def test_a_clamping_may_be_in_radians():
    text = "temperature,position,stroke,output,clamping [{}]\n20,1,1,1.3,3\n20,5,1,-1.3,3\n"
    with pytest.raises(accelcal.TableError, match="is in mrad; give it in deg"):
        accelcal.read_table(io.StringIO(text.format("mrad")))
    record = accelcal.read_table(io.StringIO(text.format("rad")))
    assert record.clamping.tolist() == pytest.approx([np.degrees(3.0)] * 2)


# -- self-calibration ------------------------------------------------------------------------------


def test_one_clamping_leaves_what_looks_like_coefficients():
    _, _, records = measured(2, units=3, clampings=(0.0,))
    found = accelcal.calibrate_head(records)
    for name in ("mean", "cos 1", "sin 1", "sin 2"):
        assert harmonic(found, name).told == pytest.approx(0.0, abs=1e-3)
        size = harmonic(found, name).amplitude.standard_uncertainty
        assert size == pytest.approx(2e-5 / np.sqrt(8 if name == "mean" else 4), rel=1e-3)
    assert harmonic(found, "sin 3").told > 0.95
    assert found.gates[0].verdict == "warn"
    assert "cannot be told apart from K0, K2" in str(found)


def test_a_second_clamping_tells_all_but_the_mean():
    graduation, _, records = measured(3, units=3)
    found = accelcal.calibrate_head(records)
    assert harmonic(found, "mean").told == pytest.approx(0.0, abs=1e-6)
    assert min(item.told for item in found.harmonics[1:]) > 0.9
    off = np.array(found.errors) - (graduation - graduation.mean())
    assert np.abs(off).max() < 1e-5
    assert found.gates[0].verdict == found.gates[1].verdict == "pass"


def test_intervals_hold_the_truth():
    inside, heads = [], []
    for seed in range(100):
        graduation, units, records = measured(seed)
        found = accelcal.calibrate_head(records)
        heads += [
            abs(q.value - e) <= q.expanded_uncertainty
            for q, e in zip(found.quantities(), graduation, strict=True)
        ]
        inside += [
            abs(q.value - getattr(units[0], name)) <= q.expanded_uncertainty
            for name in NAMES
            if (q := found.units[0].coefficients[f"{name}_o"].after)
        ]
    assert 0.92 <= np.mean(inside) <= 0.98
    assert 0.92 <= np.mean(heads) <= 0.98


@pytest.mark.parametrize(
    "coarser",
    [
        lambda output, _: output.round(3),
        lambda output, rng: output + 1e-4 * rng.standard_normal(output.size),
    ],
    ids=["coarse step", "noise"],
)
def test_a_coarse_run_leaves_the_head_to_the_fine_ones(coarser):
    """All runs had one noise, without the step: errors of 200 urad at u of 8 urad."""
    heads = []
    for seed in range(20):
        graduation, _, (record,) = measured(seed, clampings=(0.0, 90.0, 180.0, 270.0))
        last = record.run == record.run.max()
        output = record.output.copy()
        output[last] = coarser(output[last], np.random.default_rng(seed))
        found = accelcal.calibrate_head([dataclasses.replace(record, output=output)])
        off = np.array(found.errors) - (graduation - graduation.mean())
        assert np.abs(off).max() < 1e-5
        heads += [
            abs(q.value - e) <= q.expanded_uncertainty
            for q, e in zip(found.quantities(), graduation, strict=True)
        ]
    assert np.mean(heads) >= 0.9


def test_runs_of_unlike_noise_are_told_by_fewer_degrees_of_freedom():
    _, _, (record,) = measured(0, clampings=(0.0, 90.0, 180.0, 270.0))
    last = np.where(record.run == record.run.max(), 1e-4, 0.0)
    noise = last * np.random.default_rng(0).standard_normal(last.size)
    unlike = dataclasses.replace(record, output=record.output + noise)
    (alike,), (units,) = (accelcal.calibrate_head([r]).units for r in (record, unlike))
    fewer, more = (own.coefficients["k2_o"].after.dof for own in (units, alike))
    assert fewer < 0.5 * more


def test_a_declared_step_counts_in_the_errors_of_the_head():
    _, _, (record,) = measured(0)
    stepped = record.with_apparatus(resolution=1e-3)
    plain, coarse = (accelcal.calibrate_head([r]).covariance for r in (record, stepped))
    assert np.trace(coarse) > 2.0 * np.trace(plain)


def test_two_clampings_shrink_the_uncertainty_of_k2():
    _, _, (record,) = measured(4)
    (both,) = accelcal.calibrate_head([record]).units
    (one,) = accelcal.calibrate_head([one_clamping(record)]).units
    size = [u.coefficients["k2_o"].after.standard_uncertainty for u in (one, both)]
    assert size[1] < size[0] / 3.0


def test_a_file_and_its_copy_do_not_tell_the_head_twice(tmp_path):
    _, _, (record,) = measured(5)
    for name in ("first.csv", "copy.csv"):
        accelcal.write_table(record, tmp_path / name)
    files = [accelcal.read_table(tmp_path / name) for name in ("first.csv", "copy.csv")]
    with pytest.raises(accelcal.InputError, match=r"copy.csv: the same readings as .*first.csv;"):
        accelcal.calibrate_head(files)


def test_something_else_is_told():
    """What turns with the unit, and not with the head, is no error of the head."""
    _, _, (record,) = measured(5, clampings=(0.0, 90.0, 180.0, 270.0))
    disturbed = record.output + 1e-4 * np.cos(4 * np.deg2rad(record.angle))
    found = accelcal.calibrate_head([dataclasses.replace(record, output=disturbed)])
    assert found.gates[1].verdict == "warn"
    assert "noise and head explain (p < 1e-15);" in found.gates[1].finding  # it said p = 0


@pytest.mark.parametrize(
    ("sizes", "message"),
    [
        ((None, None), "is not declared; what"),
        ((2e-5, 1e-5), "is 1e-05 rad, elsewhere 2e-05 rad"),
        ((2e-5, None), "is 2e-05 rad, elsewhere not declared; what"),
        ((0.0, 0.0), "is 0 rad"),
    ],
)
def test_the_declaration_is_needed_and_one(sizes, message):
    _, _, records = measured(6, units=2)
    declared = [
        r.with_apparatus(head_uncertainty=size) for r, size in zip(records, sizes, strict=True)
    ]
    with pytest.raises(accelcal.InputError, match=message):
        accelcal.calibrate_head(declared)


def test_tables_of_different_heads_are_not_joined():
    """Their errors were averaged to those of a head that there is not."""
    _, _, (one, other) = measured(6, units=2)

    def found(first, second):
        both = ({"date": "2024-05-31"} | first, second)
        named = [
            dataclasses.replace(r, metadata=m) for r, m in zip((one, other), both, strict=True)
        ]
        return accelcal.calibrate_head(named).errors

    for key in ("head", "stand", "Head"):
        with pytest.raises(accelcal.InputError, match=r"of another head than .*'# head: NAME'"):
            found({key: "Alpha"}, {key: "Beta"})
        assert found({key: "Alpha"}, {key: " alpha"}) == found({}, {key: "Beta"})
    moved = {"head": "Alpha", "stand": "2"}
    assert found({"head": "Alpha", "stand": "1"}, moved) == found({}, {})
    german = {"Stand": "12.03.2024"}, {"Stand": "2024-04-01"}  # the state of that day, no stand
    assert found(*german) == found({}, {})


@pytest.mark.parametrize("key", ["head", "stand"])
def test_a_head_is_not_taken_for_another(key):
    """Errors of another head were taken off the readings without a word."""
    _, _, (one, other) = measured(6, units=2)

    def fitted(known, of_test):
        head = accelcal.calibrate_head([dataclasses.replace(one, metadata=known)])
        again = accelcal.HeadCalibration.from_json(head.to_json())
        return accelcal.fit(dataclasses.replace(other, metadata=of_test), head=again)

    told = rf"measured on {key} Beta, but .* are those of {key} Alpha; give the calibration of"
    with pytest.raises(accelcal.InputError, match=told):
        fitted({key: "Alpha"}, {key: "Beta"})
    silent = [({key: "Alpha"}, {key: "alpha"}), ({key: "Alpha"}, {}), ({}, {key: "Beta"})]
    assert len({fitted(*names).tables[0].error_model["k2"].value for names in silent}) == 1


def test_of_many_tables_only_those_of_another_head_are_refused():
    records = [accelcal.simulate(seed=seed) for seed in range(5)]
    named = [
        dataclasses.replace(record, metadata={"head": name})
        for record, name in zip(records, ("Alpha", "Beta", "alpha", "Beta", ""), strict=True)
    ]
    found = calibrate_many(named[1:], Options(head=accelcal.calibrate_head(named[:1])))
    assert sorted(found.failures) == [0, 2]
    assert sorted(place for places, _ in found.stacks for place in places) == [1, 3]


def test_what_is_left_is_held_against_the_replicates():
    """Chance from the whole covariance of the readings, by a design written down anew."""
    from scipy.stats import f as fisher

    _, _, (record,) = measured(11, strokes=2)
    th, y = np.deg2rad(record.angle), record.output
    c, s, one = np.cos(th), np.sin(th), np.ones(th.size)
    runs = [record.run == run for run in (0, 1)]
    own = [column * run for run in runs for column in (one, c, s)]
    design = np.stack([*own, c**2, c**3, c * s], axis=1)
    cell = np.unique(np.stack([record.run, record.angle % 360.0]), axis=1, return_inverse=True)[1]
    repeated = cell.reshape(-1)[:, None] == np.arange(16)
    pure = y - repeated @ (repeated.T @ y / repeated.sum(axis=0))
    dof = y.size - 16.0
    variance = pure @ pure / dof
    head = (record.graduation[:, None] % 360.0 == 45.0 * np.arange(8)) * (-1.3 * s)[:, None]
    covariance = variance * np.eye(y.size) + 4e-10 * head @ head.T
    whitener = np.linalg.inv(np.linalg.cholesky(covariance))
    squares = np.linalg.lstsq(whitener @ design, whitener @ y)[1][0]
    left = y.size - 9.0 - dof
    chance = fisher.sf((squares - dof) / left, left, dof)
    told = accelcal.calibrate_head([record]).gates[1].finding
    assert float(told.split("p = ")[1].rstrip(")")) == pytest.approx(chance, rel=0.06)


@pytest.mark.parametrize("factor", [1e-3, 1.0, 1e6])
def test_what_is_left_of_quiet_readings_is_no_rounding_error(factor):
    """Squares of readings of 1e8 times the noise lost it: 0.0 times as noise explains, or 4."""
    quiet = accelcal.NoiseComponents(reading=5e-9, head=0.0, launch=0.0, launch_sf=0.0)
    record = accelcal.simulate(noise=quiet, seed=1).with_apparatus(head_uncertainty=1e-6)
    found = accelcal.calibrate_head([dataclasses.replace(record, output=factor * record.output)])
    told = {gate.name: gate for gate in found.gates}["what is left"]
    assert told.verdict == "pass"
    assert 0.5 < float(re.search(r"are ([\d.]+) times", told.finding)[1]) < 1.3


def test_small_disturbances_are_told_and_noise_is_not():
    # half the noise of a reading; judged by all residuals, in which replicates outweigh the rest,
    # 2 of 30 were told
    shown = []
    for seed in range(30):
        _, _, (record,) = measured(seed, clampings=(0.0, 45.0, 90.0))
        wave = 1.3 * 2e-6 * np.cos(4 * np.deg2rad(record.angle))
        for output in (record.output, record.output + wave):
            found = accelcal.calibrate_head([dataclasses.replace(record, output=output)])
            shown.append(found.gates[1].verdict == "warn")
    assert sum(shown[::2]) <= 2  # 1 % of 30
    assert sum(shown[1::2]) >= 20


def test_a_fit_tells_what_disturbed_its_head_and_the_head_tells_which_record_did():
    """k2 was off by twice its U, with a head whose residuals were 5 times too large."""
    _, _, (record,) = measured(3)
    wave = 1.3 * 3e-5 * np.cos(2 * np.deg2rad(record.angle)) * (record.run == 1)
    bad = dataclasses.replace(record, output=record.output + wave, source="bad.csv", sha256=None)
    good, tested = measured(4)[2][0], one_clamping(measured(5)[2][0])
    clean, disturbed = (accelcal.calibrate_head(own) for own in ([good], [good, bad]))
    (finding,) = (gate.finding for gate in disturbed.gates if gate.verdict == "warn")
    assert "those of bad.csv most" in finding
    for head, told in ((clean, []), (disturbed, ["U does not count what disturbed"])):
        warnings = accelcal.fit(tested, head=head).warnings
        assert [w[:31] for w in warnings if "disturbed the calibration" in w] == told


def test_records_of_one_unit_are_named_by_their_sources():
    given = [("A", "2023.csv"), ("A", "2024.csv"), ("B", "b.csv"), (None, "c.csv")]
    records = [
        dataclasses.replace(accelcal.simulate(seed=seed), serial=serial, source=source)
        for seed, (serial, source) in enumerate(given)
    ]
    units = accelcal.calibrate_head(records).units
    assert [unit.name for unit in units] == ["2023.csv", "2024.csv", "B", "c.csv"]


def test_what_all_runs_tell_of_the_noise_together_counts_once():
    # four runs of one stroke: four returns to the first position, and Student's factor of 4
    _, _, (record,) = measured(12, strokes=1, clampings=(0.0, 90.0, 180.0, 270.0))
    (unit,) = accelcal.calibrate_head([record]).units
    for name in NAMES:
        told = unit.coefficients[f"{name}_o"].after
        assert told.dof == pytest.approx(4.0, rel=1e-4)  # the rest is missed of the head
        assert told.coverage_factor == pytest.approx(2.776445, rel=1e-4)


def test_a_single_stroke_tells_no_noise_from_repetition():
    _, _, (record,) = measured(7, strokes=1)
    found = accelcal.calibrate_head([record])
    assert found.uncertainty < 2e-5


@pytest.mark.parametrize(
    ("seed", "options", "widest"),
    [
        (31, {"strokes": 1}, {"k2": 1.6, "k3": 2.3, "delta_ip": 1.6}),
        (32, {"strokes": 1, "positions": 12}, dict.fromkeys(NAMES, 1.4)),
        (33, {"strokes": 1, "units": 3}, dict.fromkeys(NAMES, 1.4)),
        (34, {"strokes": 1, "units": 3, "clampings": (0.0,)}, dict.fromkeys(NAMES, 1.4)),
        (35, {"strokes": 1, "clampings": (0.0, 90.0, 180.0, 270.0)}, dict.fromkeys(NAMES, 1.5)),
    ],
)
def test_one_stroke_tells_the_noise_beside_the_head(seed, options, widest):
    """Residuals that hold the errors of the head made them up to four times too wide.

    With 8 positions and one unit two returns alone tell the noise of k3: Student's factor of two
    degrees of freedom makes it 1.9 times as wide as if the noise were known.
    """
    rng, found = np.random.default_rng(seed), []
    first = [read(unit) for unit in drawn(np.random.default_rng(0), **options)[1]]
    for _ in range(300 // options.get("units", 1)):
        graduation, units = drawn(rng, **options)
        head = accelcal.calibrate_head(list(map(alike, units, first)))
        found += [(f"{name} of unit", *pair) for name, *pair in of_units(head, units)]
        found += [("head", *pair) for pair in of_harmonics(head, graduation)]
    for name, most in widest.items():
        off, wide = np.array([row[1:] for row in found if row[0] == f"{name} of unit"]).T
        assert 0.915 <= np.mean(np.abs(off) <= wide) <= 0.985
        assert np.mean(wide) < most * 1.96 * np.sqrt(np.mean(off**2))
    off, wide = np.array([row[1:] for row in found if row[0] == "head"]).T
    assert 0.915 <= np.mean(np.abs(off) <= wide) <= 0.975


@pytest.mark.parametrize("runs", [(0, 1), (0, 0)])
def test_units_of_one_stroke_and_clamping_are_calibrated(runs):
    """One of them, or none, tells its noise beside the other."""
    rng = np.random.default_rng(36)
    for _ in range(40):
        _, units = units_on_one_head(rng, units=2, strokes=1)
        whole = [read(unit) for unit in units]
        records = [
            dataclasses.replace(
                r.select(r.run == run), run=np.zeros_like(r.run[r.run == run]), run_labels=("one",)
            )
            for r, run in zip(whole, runs, strict=True)
        ]
        for unit in accelcal.calibrate_head(records).units:
            assert 0.0 < unit.coefficients["k2_o"].after.expanded_uncertainty < 1e-3


def test_a_certificate_may_have_several_declarations_in_a_line():
    """The line was one uncertainty, and refused."""
    text = "# {}\nangle,error [arcsec]\n0,1\n90,-1\n"
    plain = text.format("uncertainty: 1 arcsec\n# coverage: 2")
    told = text.format("uncertainty, arcsec: 1; k=2; head: H-1")
    one, other = (accelcal.read_head(io.StringIO(own)) for own in (plain, told))
    assert other.covariance_matrix == one.covariance_matrix
    assert other.head_name == "H-1"


def test_the_words_of_a_certificate_may_have_other_signs():
    rows = "\n".join(f"{45 * i};{i};1.2" for i in range(8))
    columns = "Winkel;Abweichung in Winkelsekunden;Erweiterte Messunsicherheit U in Winkelsekunden"
    found = accelcal.read_head(io.StringIO(f"# Facteur d’élargissement: 2\n{columns}\n{rows}\n"))
    of_a_second = np.radians(1.0 / 3600.0)
    np.testing.assert_allclose(found.errors, of_a_second * np.arange(8), rtol=1e-12)
    np.testing.assert_allclose(
        np.diagonal(found.covariance_matrix), (0.6 * of_a_second) ** 2, rtol=1e-12
    )


@pytest.mark.parametrize("lines", [True, False])
def test_a_standard_uncertainty_is_not_divided_by_a_coverage_factor(lines):
    of_a_second = np.radians(1.0 / 3600.0)
    for word, size in (("Standardunsicherheit", 0.5), ("uncertainty", 0.25)):
        if lines:
            text = f"# k: 2\n# {word}: 0.5 arcsec\nangle,error [arcsec]\n0,1\n90,2\n"
        else:
            text = f"# k: 2\nangle,error [arcsec],{word} [arcsec]\n0,1,0.5\n90,2,0.5\n"
        found = accelcal.read_head(io.StringIO(text))
        np.testing.assert_allclose(
            np.diagonal(found.covariance_matrix), (size * of_a_second) ** 2, rtol=1e-12
        )


def test_the_only_noise_that_is_told_is_moderated_by_no_other():
    variances, doubt = moderated(np.array([2.0]), np.array([1.5]))
    assert (variances.tolist(), doubt.tolist()) == ([2.0], [0.0])


STD, SAMPLES = ",1e-6,", ",2e-6,4"  # of a reading, of the samples that it is the mean of


@pytest.mark.parametrize(
    ("runs", "dof", "pure", "residuals"),
    [
        # of 8 positions a stroke reads the first twice: 9 S - 8 degrees of freedom of S strokes
        ([(4, ",,"), (4, ",,")], 56.0, 56.0, False),  # these differ by no more than chance
        ([(1, ",,")] * 4, 4.0, 4.0, False),  # those of all tables, once
        ([(4, ",,"), (1, ",,")], 28.0, 29.0, False),  # those of one are among those of all
        ([(1, ",,"), (1, ",,")], 6.0, 0.0, True),  # residuals of 9 readings and 6 coefficients
        ([(4, STD), (4, STD)], np.inf, 0.0, False),
        ([(4, SAMPLES), (4, SAMPLES)], 2 * 36 * 3.0, 0.0, False),
        ([(4, STD), (4, SAMPLES)], 36 * 3.0, 0.0, False),  # nothing to moderate a sure one by
        ([(4, STD), (4, ",,")], 28.0, 28.0, False),
        ([(1, STD), (1, ",,")], 3.0, 0.0, False),  # the residuals of one are taken for its noise
    ],
)
def test_what_tells_the_noise_and_by_how_many_degrees_of_freedom(runs, dof, pure, residuals):
    record = with_declarations([(strokes, 9, std) for strokes, std in runs])
    factors, *told = _noise(record, [prepare(table) for table in record.tables()])
    assert told == [pytest.approx(dof), pytest.approx(pure), residuals]
    expected = [1e-6 if std == ",," else 1.0 for _, std in runs]
    assert factors == pytest.approx(expected, rel=0.5)  # declared ones over the declaration


@pytest.mark.parametrize("turn", [1, -1])
def test_a_run_whose_noise_nothing_tells_is_refused(turn):
    """Behind one that declares its own it ended in an error of the arithmetic."""
    record = with_declarations([(1, 9, STD), (1, 6, ",,")][::turn])
    with pytest.raises(accelcal.InputError, match="the reading noise is unknown"):
        accelcal.calibrate_head([record.with_apparatus(head_uncertainty=2e-5)])


def with_declarations(runs):
    rng = np.random.default_rng(2)
    lines = [
        f"20,{run},{place},{stroke},{np.cos(place * np.pi / 4) + rng.normal(0, 1e-6):.12f}{std}"
        for run, (strokes, places, std) in enumerate(runs)
        for stroke in range(1, strokes + 1)
        for place in range(1, places + 1)
    ]
    text = "\n".join(["temperature,run,position,stroke,output,std,n", *lines])
    return accelcal.read_table(io.StringIO(text))


def drawn(rng, positions=8, **options):
    graduation, units = units_on_one_head(rng, positions=positions, **options)
    header = f"# positions: {positions}\n"
    return graduation, [dataclasses.replace(u, text=header + u.text) for u in units]


def of_units(head, units):
    for told, unit in zip(head.units, units, strict=True):
        for name in NAMES:
            q = told.coefficients[f"{name}_o"].after
            yield name, q.value - getattr(unit, name), q.expanded_uncertainty


def of_harmonics(head, graduation):
    phi = 2.0 * np.pi * np.arange(graduation.size) / graduation.size
    for item in head.harmonics[1:]:
        wave = np.cos if item.name.startswith("cos") else np.sin
        pattern = wave(int(item.name.split()[1]) * phi)
        truth = pattern @ graduation / (pattern @ pattern)
        yield item.amplitude.value - truth, item.amplitude.expanded_uncertainty


def test_posterior_is_that_of_normal_equations():
    rng = np.random.default_rng(8)
    design, truth = rng.normal(size=(20, 4)), np.arange(4.0)
    value, covariance = posterior(design.T @ design, design.T @ (design @ truth))
    np.testing.assert_allclose(value, truth, atol=1e-10)
    np.testing.assert_allclose(covariance, np.linalg.inv(design.T @ design), rtol=1e-9)


# -- in a fit --------------------------------------------------------------------------------------


def error_model(record, head=None):
    return accelcal.fit(record, head=head).tables[0].error_model


def test_the_head_of_one_unit_corrects_another():
    errors = []
    for seed in range(16):
        _, units, (first, other) = measured(seed, units=2)
        head = accelcal.calibrate_head([first])
        other = one_clamping(other)
        for model in (error_model(other), error_model(other, head)):
            errors += [(model[name].value - getattr(units[1], name)) for name in NAMES]
    off = np.array(errors).reshape(-1, 2, 3)
    factor = np.sqrt(np.mean(off[:, 0] ** 2, axis=0) / np.mean(off[:, 1] ** 2, axis=0))
    assert factor.min() > 2.0


def test_intervals_of_a_corrected_fit_hold_the_truth():
    inside = []
    for seed in range(40):
        _, units, (first, other) = measured(seed, units=2)
        model = error_model(one_clamping(other), accelcal.calibrate_head([first]))
        inside += [
            abs(model[name].value - getattr(units[1], name)) <= model[name].expanded_uncertainty
            for name in NAMES
        ]
    assert np.mean(inside) > 0.87  # of 120: 95 % and 4 standard deviations less


def test_a_perfect_certificate_takes_the_errors_out():
    graduation, units, (record,) = measured(9, clampings=(0.0,), strokes=6)
    rows = [f"{45 * i},{error!r}" for i, error in enumerate(graduation.tolist())]
    text = "\n".join(["# uncertainty: 1e-9 rad", "angle,error [rad]", *rows])
    head = accelcal.read_head(io.StringIO(text))
    model = error_model(record, head)
    for name in NAMES:
        assert abs(model[name].value - getattr(units[0], name)) < 6e-6
        assert model[name].standard_uncertainty < 4e-6
    plain = error_model(record)
    assert plain["k2"].standard_uncertainty > 5.0 * model["k2"].standard_uncertainty


def test_a_table_is_not_used_twice(tmp_path):
    _, units, _ = measured(10, units=2)
    records = []
    for number, unit in enumerate(units):
        path = tmp_path / f"{number}.csv"
        path.write_text(unit.text, "utf-8")
        records.append(accelcal.read_table(path))
    both = accelcal.calibrate_head(records)
    other = accelcal.calibrate_head(records[1:])
    left = both.without(records[0].sha256)
    np.testing.assert_allclose(left.errors, other.errors, rtol=1e-9, atol=1e-15)
    mine, theirs = (error_model(records[0], head)["k2"] for head in (both, other))
    assert mine.value == pytest.approx(theirs.value, rel=1e-9)
    assert mine.standard_uncertainty == pytest.approx(theirs.standard_uncertainty, rel=1e-9)
    assert any(
        "the head was calibrated from this table too" in w
        for w in accelcal.fit(records[0], head=both).warnings
    )
    assert not any("of the head:" in w for w in accelcal.fit(records[0], head=other).warnings)


def test_positions_that_the_head_does_not_know_are_refused():
    _, _, (record,) = measured(11)
    head = accelcal.read_head(io.StringIO("# uncertainty: 1 arcsec\nangle,error [arcsec]\n0,1\n"))
    with pytest.raises(accelcal.InputError, match="head position 45 deg is not among the 1"):
        accelcal.fit(record, head=head)


def test_the_name_of_a_file_is_no_head():
    _, _, (record,) = measured(11)
    with pytest.raises(accelcal.InputError, match="str in place of a head; make one by"):
        accelcal.fit(record, head="head.json")


# -- files and the command -------------------------------------------------------------------------


def run(capsys, *arguments):
    code = main([str(item) for item in arguments])
    out, err = capsys.readouterr()
    return code, out, err


@pytest.fixture
def tables(tmp_path):
    _, units, _ = measured(12, units=2)
    paths = [tmp_path / "first.csv", tmp_path / "second.csv"]
    for path, unit in zip(paths, units, strict=True):
        path.write_text(unit.text, "utf-8")
    return paths


def test_head_goes_through_files(tables, tmp_path, capsys):
    path = tmp_path / "head.json"
    code, out, _ = run(capsys, "head", tables[0], "-o", path)
    assert code == 0
    assert "cos 1" in out
    assert json.loads(path.read_text("utf-8"))["schema"] == "accelcal/head/1"
    found = accelcal.read_head(path)
    assert found == accelcal.HeadCalibration.from_json(found.to_json())
    code, out, _ = run(capsys, "fit", tables[1], "--head", path, "--format", "json")
    fitted = json.loads(out)
    assert code == 0
    assert fitted["provenance"]["options"]["head"] == str(tables[0])
    plain = json.loads(run(capsys, "fit", tables[1], "--format", "json")[1])
    size = [
        document["tables"][0]["error_model"]["k2"]["standard_uncertainty"]
        for document in (fitted, plain)
    ]
    assert size[0] < size[1] / 2.0


def test_csv_of_the_head_is_a_certificate(tables, tmp_path, capsys):
    path = tmp_path / "head.csv"
    text = tables[0].read_text("utf-8")
    tables[0].write_text(f"# head: Kopf 7; Süd\n# stand: 2\n{text}", "utf-8")
    path.write_text(run(capsys, "head", tables[0], "--format", "csv")[1], "utf-8")
    own, found = accelcal.calibrate_head([accelcal.read_table(tables[0])]), accelcal.read_head(path)
    assert (found.head_name, found.stand_name) == ("Kopf 7; Süd", "2")
    np.testing.assert_allclose(found.errors, own.errors, rtol=1e-12)
    sizes = np.sqrt(np.diagonal(found.covariance))
    np.testing.assert_allclose(sizes, np.sqrt(np.diagonal(own.covariance)), rtol=1e-12)


def test_a_certificate_may_name_its_head(tables, tmp_path, capsys):
    certificate, text = tmp_path / "certificate.csv", tables[1].read_text("utf-8")
    rows = "".join(f"{angle},0\n" for angle in range(0, 360, 45))
    certificate.write_text(
        f"# Head: Alpha\n# uncertainty: 1 urad\nangle,error [urad]\n{rows}", "utf-8"
    )
    assert accelcal.read_head(certificate).head_name == "Alpha"
    for name, expected in (("alpha", 0), ("Beta", 2)):
        tables[1].write_text(f"# head: {name}\n{text}", "utf-8")
        code, _, err = run(capsys, "fit", tables[1], "--head", certificate)
        told = (
            f"measured on head {name}, but the errors from {certificate} are those of head Alpha;"
        )
        assert (code, told in err) == (expected, expected == 2)


def test_the_zero_of_a_certificate_has_no_uncertainty():
    """Its row was refused, and without it the position was missing."""
    text = "angle,error [urad],u [urad]\n{}\n90,2,1\n180,-1,1\n270,0,1\n360,0,0\n"
    found = accelcal.read_head(io.StringIO(text.format("0,0,0")))
    assert np.diagonal(found.covariance).tolist() == pytest.approx([0.0, *[1e-12] * 3])
    for wrong in ("0,1,0", "45,0,0"):
        table = text.format(wrong).replace("\n360,0,0", "")
        with pytest.raises(
            accelcal.TableError, match=r"is not above 0; write the standard .* 0 deg"
        ):
            accelcal.read_head(io.StringIO(table))


def test_units_and_coverage_of_a_certificate():
    text = "# coverage: 2\nangle;correction_arcsec;u [urad]\n0;-1;2\n90;0,5;2\n360;-1;2\n"
    found = accelcal.read_head(io.StringIO(text))
    np.testing.assert_allclose(found.errors, [ARCSEC, -0.5 * ARCSEC], rtol=1e-12)
    np.testing.assert_allclose(found.covariance, 1e-12 * np.eye(2), rtol=1e-9)


ARCSEC = np.pi / 648000.0


@pytest.mark.parametrize(
    "text",
    [
        "# k: 2\nWinkel;Fehler [Winkelsekunden];U [Winkelsekunden]\n0;1,5;1\n90;-0,5;1\n",
        "# Erweiterungsfaktor k: 2,0\n# Erweiterte Messunsicherheit: 1,0 Winkelsekunden\n"
        "Nennwinkel;Abweichung in Winkelsekunden\n0;1,5\n90;-0,5\n",
        '# Unsicherheit: 0,5"\nStellung [°];Korrektur ["]\n0;-1,5\n90;0,5\n',
        "# Коэффициент охвата: 2\n"
        "Угол, град;Погрешность, угл. с;Расширенная неопределенность, угл. с\n"
        "0;1,5;1\n90;-0,5;1\n",
        "Положение;Поправка (угл. сек.);Неопределённость (угл. сек.)\n0;-1,5;0,5\n90;0,5;0,5\n",
        "angle,deviation_arcsec,incertitude_arcsec\n0,1.5,0.5\n90,-0.5,0.5\n",
        "angle,error [arcsec],U (k=2) [arcsec]\n0,1.5,1\n90,-0.5,1\n",
        "angle,error [arcsec],U (2σ) [arcsec]\n0,1.5,1\n90,-0.5,1\n",
        "angle,error [arcsec],U [arcsec] (2-sigma)\n0,1.5,1\n90,-0.5,1\n",
        "Winkel;Fehler [arcsec];U (2 Sigma) [arcsec]\n0;1,5;1\n90;-0,5;1\n",
        "# k: 2\nWinkel;Fehler [arcsec];Unsicherheit U [arcsec]\n0;1,5;1\n90;-0,5;1\n",
        "Winkel;Fehler [arcsec];Messunsicherheit u [arcsec]\n0;1,5;0,5\n90;-0,5;0,5\n",
        'Nennwinkel in Grad;Fehler, ";U (k = 2), "\n0;1,5;1\n90;-0,5;1\n',
        "Winkel [Grad];Fehler [arcsec];Erweiterte Messunsicherheit U (k = 2, P = 95 %) in arcsec\n"
        "0;1,5;1\n90;-0,5;1\n",
        'Angle nominal (degrés);Erreur en secondes d’arc;Incertitude élargie (k=2, 95 %) ["]\n'
        "0;1,5;1\n90;-0,5;1\n",
        "Угол в градусах;Погрешность, угловых секунд;"
        "Расширенная неопределённость U (k = 2), угл. с\n0;1,5;1\n90;-0,5;1\n",
        "# k: 2\nangle,error [arcsec],U95 (arcsec; k=2)\n0,1.5,1\n90,-0.5,1\n",
        "# Erweiterte Unsicherheit U (k=2): 1,0 arcsec\nangle,error [arcsec]\n0,1.5\n90,-0.5\n",
        "# uncertainty: 1 arcsec (k = 2)\nangle,error [arcsec]\n0,1.5\n90,-0.5\n",
    ],
)
def test_certificates_in_other_languages(text):
    found = accelcal.read_head(io.StringIO(text))
    np.testing.assert_allclose(found.errors, [1.5 * ARCSEC, -0.5 * ARCSEC], rtol=1e-12)
    np.testing.assert_allclose(found.covariance, (0.5 * ARCSEC) ** 2 * np.eye(2), rtol=1e-9)


def test_the_page_lists_every_word_of_a_certificate():
    page = Path(__file__).parents[1].joinpath("docs", "head.md").read_text("utf-8")
    told = {name.casefold().replace(" ", "_") for name in re.findall(r"`(?:# )?([^`\n]+)`", page)}
    of_tables = {*COLUMNS["angle"], *COLUMNS["position"]}
    words = {name for names in HEAD_COLUMNS.values() for name in names} - of_tables | {*EXPANDED}
    keys = {name.removesuffix("_k") for name in HEAD_KEYS["coverage"]} - {"stroke"}
    assert (words | keys) - told == set()


@pytest.mark.parametrize(
    "text",
    [
        "angle,error [arcsec],U [arcsec]\n0,1,1\n90,2,1\n",
        "angle,error [arcsec],expanded uncertainty [arcsec]\n0,1,1\n90,2,1\n",
        "Winkel,Fehler [arcsec],Unsicherheit U [arcsec]\n0,1,1\n90,2,1\n",
        "# expanded uncertainty: 1 arcsec\nangle,error [arcsec]\n0,1\n90,2\n",
    ],
)
def test_an_expanded_uncertainty_needs_its_factor(text):
    """U was taken for a standard uncertainty."""
    with pytest.raises(accelcal.TableError, match=r"expanded; say by which factor, as in '# cov"):
        accelcal.read_head(io.StringIO(text))
    found = accelcal.read_head(io.StringIO("# coverage: 2\n" + text))
    np.testing.assert_allclose(found.covariance, (0.5 * ARCSEC) ** 2 * np.eye(2), rtol=1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("# k: 3\nangle,error [arcsec],U (k=2) [arcsec]", "factor 2, and not 3; write one of"),
        (
            "angle,error [arcsec],standard_uncertainty (k=2) [arcsec]",
            "a standard uncertainty has n",
        ),
        ("angle,error [arcsec],U (k=0) [arcsec]", "factor 0, and not 1"),
        ("angle,error [arcsec],U (95 %) [arcsec]", "is expanded; say by which factor"),
        ("angle,error [arcsec],uncertainty (95 %) [arcsec]", "is expanded; say by which factor"),
        (
            "angle,error [arcsec],U (k=2; 3σ) [arcsec]",
            "has the coverage factors 2 and 3; write one",
        ),
        ("# uncertainty (95%): 1 arcsec\nangle,error [arcsec],x", "is expanded; say by which f"),
        ("# 2σ: 1 arcsec\nangle,error [arcsec],u [arcsec]", "is expanded; say by which factor"),
        (
            "# uncertainty: 2 arcsec\nangle,error [arcsec],u [arcsec]",
            "'2 arcsec' is not that of col",
        ),
        (
            "# coverage: 95 %\nangle,error [arcsec],U [arcsec]",
            "no factor from 1 to 20; write the f",
        ),
        (
            "# coverage: 0.95\nangle,error [arcsec],U [arcsec]",
            "no factor from 1 to 20; write the f",
        ),
        ("Winkel [grad],error [arcsec],u [arcsec]", "is in grad; give it in rad"),
    ],
)
def test_what_a_heading_does_not_tell_for_certain_is_refused(text, message):
    with pytest.raises(accelcal.TableError, match=message):
        accelcal.read_head(io.StringIO(f"{text}\n0,1,1\n90,2,1\n"))


CERTIFICATE = "# uncertainty: 0.5 arcsec\nangle,error [arcsec]\n0,1\n45,2\n"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("error [arcsec]", "error", "has no unit"),
        ("error [arcsec]", "error [gon]", "is in gon"),
        ("error", "miss", "no column error"),
        ("# uncertainty: 0.5 arcsec\n", "", "the uncertainty of the errors is not given"),
        ("0.5 arcsec", "0.5", "has no unit of an angle"),
        ("0.5 arcsec", "-1 arcsec", "write a number above 0"),
        ("# unc", "# coverage: 1\n# Coverage: 2\n# unc", ":2: coverage is '2', but '1' in line 1"),
        ("45,2", "45,2e6", "is no error of a head"),
        ("45,2", "360,2", "of a position that has another error"),
        ("45,2", "45,", "is missing"),
        ("45,2", "45,two", "is not a number"),
        (CERTIFICATE, "", "the file is empty"),
        (CERTIFICATE, "{}", "key schema: missing"),
    ],
)
def test_bad_certificates_are_told_in_a_line(tables, tmp_path, capsys, old, new, message):
    path = tmp_path / "certificate.csv"
    path.write_text(CERTIFICATE.replace(old, new, 1), "utf-8")
    code, out, err = run(capsys, "fit", tables[0], "--head", path)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err
    assert str(path) in err


def test_a_head_uncertainty_beside_a_known_head_is_told(tables, tmp_path, capsys):
    """It was left out without a word."""
    path = tmp_path / "head.json"
    assert run(capsys, "head", tables[0], "-o", path)[0] == 0
    plain = run(capsys, "fit", tables[1], "--head", path)
    beside = run(capsys, "fit", tables[1], "--head", path, "--head-uncertainty", "5e-5")
    assert plain[0] == beside[0] == 0
    assert plain[1] == beside[1]
    note = f"note: {path} tells how uncertain the head is; --head-uncertainty counts for the"
    assert note not in plain[2]
    assert note in beside[2]


@pytest.mark.parametrize(
    "change",
    [
        {"angles_deg": (0.0,)},
        {"angles_deg": (90.0, 0.0)},
        {"covariance_matrix": ((0.0, 1.0),) * 2},
        {"covariance_matrix": ((1.0, 0.5), (-0.5, 1.0))},
        {"covariance_matrix": ((1.0, 1.5), (1.5, 1.0))},
        {"declared_uncertainty_rad": 0.0},
        {"units": (UnitOnHead("a", None, ((1.0,),), (1.0,), {}),)},
    ],
)
def test_a_head_is_whole(change):
    whole = {"angles_deg": (0.0, 90.0), "errors": (0.0, 0.0), "origin": "certificate"}
    whole["covariance_matrix"] = ((1e-12, 0.0), (0.0, 1e-12))
    accelcal.HeadCalibration(**whole)
    with pytest.raises(accelcal.InputError):
        accelcal.HeadCalibration(**whole | change)


# -- searches --------------------------------------------------------------------------------------


def test_a_search_refuses_several_clampings_in_a_line(tmp_path, capsys):
    _, (unit,), (record,) = measured(5)
    alone = one_clamping(record)
    calls = (
        lambda: accelcal.discover(record),
        lambda: accelcal.discover_stand([record, record]),
        lambda: accelcal.compare(accelcal.fit(alone), record),
    )
    for call in calls:
        with pytest.raises(accelcal.InputError, match="clampings at 0 and 90 deg; head errors"):
            call()
    (tmp_path / "two.csv").write_text(unit.text)
    assert main(["discover", str(tmp_path / "two.csv")]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "two.csv: clampings at 0 and 90 deg" in err
    assert not accelcal.discover(alone).effects


def test_the_picture_has_each_error_with_its_interval(tables, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    picture = tmp_path / "head.svg"
    assert run(capsys, "head", *tables, "--plot", picture)[0] == 0
    assert picture.read_text("utf-8").startswith("<?xml")
    found = accelcal.calibrate_head([accelcal.simulate(seed=1)])
    ax = found.plot.errors()
    points, _, (bars,) = ax.containers[0]
    assert np.allclose(points.get_xdata(), found.angles_deg)
    factor = np.ptp(points.get_ydata()) / np.ptp(found.errors)
    assert factor == pytest.approx(1e6)
    half = [q.expanded_uncertainty for q in found.quantities()]
    drawn = [np.ptp(segment[:, 1]) / 2.0 for segment in bars.get_segments()]
    assert np.allclose(drawn, factor * np.array(half))
    assert "rad]" in ax.get_ylabel()
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels == ["declared, 95 %", "error, 95 %"]


def test_an_uncertainty_that_nothing_tells_is_not_shown_as_zero():
    found = accelcal.calibrate_head([accelcal.simulate(seed=1)])
    (unit,) = found.units
    bare = accelcal.Quantity(5.2e-5, None, "g/g^2")
    own = {n: dataclasses.replace(c, before=bare) for n, c in unit.coefficients.items()}
    units = (dataclasses.replace(unit, coefficients=own),)
    text = str(dataclasses.replace(found, units=units))
    assert re.search(r"k2_o +52 +unknown", text)


def test_units_in_the_cells_of_a_certificate():
    """They were no numbers."""
    text = "Winkel;Abweichung;U (k=2)\n0\u00b0;1,5 arcsec;2 arcsec\n90\u00b0;-1 arcsec;2 arcsec\n"
    found = accelcal.read_head(io.StringIO(text))
    np.testing.assert_allclose(found.errors, [1.5 * ARCSEC, -ARCSEC], rtol=1e-12)
    np.testing.assert_allclose(found.covariance, ARCSEC**2 * np.eye(2), rtol=1e-9)


@pytest.mark.parametrize(
    "line",
    [
        "coverage: 2",
        "k: 2",
        "k = 2",
        "coverage factor: 2",
        "coverage: 2 (95 %)",
        "coverage: k = 2",
        "coverage: 2 sigma (95 %)",
    ],
)
def test_a_coverage_factor_goes_by_several_names(line):
    text = f"# uncertainty: 1 arcsec\n# {line}\nangle,error [arcsec]\n0,1\n90,-1\n"
    found = accelcal.read_head(io.StringIO(text)).uncertainty
    assert found == pytest.approx(np.deg2rad(0.5 / 3600.0))


def test_readings_without_noise_tell_nothing_of_the_head():
    """Rounding passed for errors of milliradians."""
    record = accelcal.simulate(seed=1)
    exact = 1.35 * np.cos(np.radians(record.angle)) + 0.01
    record = dataclasses.replace(record, output=np.round(exact, 9))
    with pytest.raises(accelcal.InputError, match="replicates are alike to the last digit"):
        accelcal.calibrate_head([record])


def test_one_run_without_noise_is_refused_too():
    record = accelcal.simulate(seed=1)
    exact = 1.35 * np.cos(np.radians(record.angle)) + 0.01
    output = np.where(record.run == 2, exact, record.output)
    with pytest.raises(accelcal.InputError, match="replicates are alike to the last digit"):
        accelcal.calibrate_head([dataclasses.replace(record, output=output)])
