"""A unit through its recalibrations: drift, scatter, jumps, and what cannot be compared."""

import io
import json
import re
import time
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy import stats

import accelcal
from accelcal.cli.main import main
from accelcal.errors import InputError
from accelcal.io.documents import read_entries
from accelcal.recalibrations import jumps
from accelcal.recalibrations.comparable import comparable
from accelcal.recalibrations.entries import entries_of, year
from accelcal.recalibrations.history import _told
from accelcal.recalibrations.jumps import jumps_like_bends, line_with_steps, search_jumps
from accelcal.recalibrations.regression import farthest, fit_line, line_of_a_walk, proportions
from accelcal.results.documents.stored import all_to_json

UG = 1e-6


def frame(count=10, *, drift=5.0, jump=0.0, scatter=0.0, seed=1, **columns):
    """Recalibrations of one unit, one a year; sizes in ug."""
    rng = np.random.default_rng(seed)
    number = np.arange(count)
    noise = np.hypot(2.0, scatter) * rng.standard_normal(count)
    bias = 3000.0 + drift * number + jump * (number >= count // 2) + noise
    table = {
        "serial": "A",
        "source": [f"{2010 + n}.csv" for n in number],
        "mounting": "o+",
        "date": [f"{2010 + n}-01-01" for n in number],
        "temperature_degC": 20.0,
        "k0": UG * bias,
        "k0_standard_uncertainty": 2.0 * UG,
        "K1": 1.35 * (1.0 + 1e-6 * rng.standard_normal(count)),
        "K1_standard_uncertainty": 1.35e-6,
        "output_unit": "mA",
    }
    return pd.DataFrame(table | columns)


def run(*arguments):
    return main(["history", *map(str, arguments)])


@pytest.fixture
def results(tmp_path):
    path = tmp_path / "results.csv"
    frame().to_csv(path, index=False)
    return path


# -- regression ------------------------------------------------------------------------------------


def test_the_line_is_the_mean_of_those_of_statsmodels():
    """Over proportions of the variances, by their restricted likelihoods with a free size."""
    sm = pytest.importorskip("statsmodels.api")

    rng = np.random.default_rng(5)
    time = np.sort(rng.uniform(0, 10, 12))
    uncertainty = np.exp(rng.normal(0.0, 0.5, 12))
    columns = line_with_steps(time, [])
    values = 1.0 + 0.1 * time + 0.6 * uncertainty * rng.standard_normal(12)  # overstated
    fit = fit_line(columns, values, uncertainty)
    assert fit.scatter == fit.scatter_limits[0] == 0.0
    lines, shares = [], []
    for variance in proportions(uncertainty**2):
        line = sm.WLS(values, columns, weights=1.0 / variance).fit()
        size = np.sqrt(np.linalg.det(line.normalized_cov_params) / np.prod(variance))
        shares.append(size * line.ssr**-5.0)
        lines.append(line)
    mean = np.average([line.params for line in lines], axis=0, weights=shares)
    parts = [line.bse**2 + (line.params - mean) ** 2 for line in lines]
    assert fit.coefficients == pytest.approx(mean)
    assert fit.uncertainties**2 == pytest.approx(np.average(parts, axis=0, weights=shares))
    assert proportions(uncertainty**2)[0] == pytest.approx(uncertainty**2)
    assert np.ptp(proportions(uncertainty**2)[-1]) == 0.0


def test_the_scatter_is_that_of_paule_and_mandel_with_its_interval():
    from scipy.optimize import brentq

    rng = np.random.default_rng(6)
    uncertainty = rng.uniform(0.5, 2.0, 15)
    columns = line_with_steps(np.arange(15.0), [])
    values = 3.0 * rng.standard_normal(15)

    def squares(tau):
        weights = np.diag(1.0 / (uncertainty**2 + tau**2))
        normal = columns.T @ weights @ columns
        residual = values - columns @ np.linalg.solve(normal, columns.T @ weights @ values)
        return residual @ weights @ residual

    fit = fit_line(columns, values, uncertainty)
    for found, expected in zip(
        (fit.scatter, *fit.scatter_limits),
        (13, stats.chi2.isf(0.025, 13), stats.chi2.isf(0.975, 13)),
        strict=True,
    ):
        root = brentq(lambda tau, expected=expected: squares(tau) - expected, 0.0, 50.0)
        assert found == pytest.approx(root, abs=1e-4)


def test_the_chance_of_a_jump_is_even_where_there_is_none():
    rng = np.random.default_rng(7)
    time = np.arange(8.0)
    chances = np.array([
        search_jumps(time, rng.standard_normal(8), np.full(8, 0.5), 1e-9).rest for _ in range(300)
    ])  # fmt: skip
    for level in (0.05, 0.2, 0.5, 0.8):
        assert stats.binomtest(int((chances < level).sum()), 300, level).pvalue > 1e-3


def test_the_distance_from_the_others_is_that_of_statsmodels():
    outliers = pytest.importorskip("statsmodels.stats.outliers_influence")
    api = pytest.importorskip("statsmodels.api")
    time = np.array([0.0, 1.0, 1.5, 3.0, 5.0, 5.5, 7.0])
    values = np.array([0.3, 0.1, 4.0, -0.2, 0.4, 0.1, 0.3])
    columns = line_with_steps(time, [])
    expected = outliers.OLSInfluence(api.OLS(values, columns).fit()).resid_studentized_external
    place, chance = farthest(columns, values, np.full(7, 0.5))
    assert place == 2
    assert chance == pytest.approx(7 * 2.0 * stats.t.sf(np.abs(expected).max(), 4))


@pytest.mark.parametrize("count", [5, 8, 20])
@pytest.mark.parametrize("unlike", [1.0, 5.0])
def test_the_chance_of_the_farthest_is_not_below_its_rate(count, unlike):
    rng = np.random.default_rng(count)
    uncertainty = np.where(np.arange(count) % 2, 1.0, unlike)
    columns = line_with_steps(np.arange(count), [])
    for scale in (1.0, uncertainty):  # the errors are alike, or as stated
        noise = scale * rng.standard_normal((400, count))
        chances = np.array([farthest(columns, row, uncertainty)[1] for row in noise])
        for level in (0.05, 0.2):
            below = int((chances < level).sum())
            assert stats.binomtest(below, 400, level, alternative="greater").pvalue > 1e-3


def test_values_on_a_line_leave_none_apart():
    time = np.arange(40.0)
    assert farthest(line_with_steps(time, []), time, np.ones(40))[1] == 1.0
    assert farthest(line_with_steps(np.arange(4.0), []), np.eye(4)[3], np.ones(4))[1] == 1.0


def test_the_chance_at_the_only_gap_is_that_of_fisher():
    """Two of five calibrations on one date leave one gap; its F has 1 and 2 degrees of freedom."""
    time = np.array([0.0, 1.0, 2.0, 2.0, 3.0])
    design = line_with_steps(time, [2])
    left = np.linalg.svd(design)[0][:, 3:] @ np.array([0.6, 0.8])  # beside line and step
    step = np.linalg.qr(design)[0][:, 2]
    for chance in (0.01, 0.005, 0.002):
        size = np.sqrt(stats.f.isf(chance, 1, 2) / 2.0)
        found = search_jumps(time, left + size * step, np.full(5, 0.1), 1e-9).rest
        assert found == pytest.approx(chance, abs=3.3 * np.sqrt(chance / 22_000))
    # before, of 1999 values, no chance was below 0.0005
    assert search_jumps(time, left + 1e4 * step, np.full(5, 0.1), 1e-9).rest < 1e-4


# -- history ---------------------------------------------------------------------------------------


def test_a_drift_is_found():
    bias, gain = accelcal.history(frame()).trends
    assert bias.drift.unit == "g/year"
    assert abs(bias.drift.value - 5.0 * UG) < bias.drift.expanded_uncertainty < 2.0 * UG
    assert abs(gain.drift.value) < gain.drift.expanded_uncertainty < 2.0 * UG
    assert bias.jumps == gain.jumps == ()


@pytest.mark.parametrize("scatter", [0.0, 1.0, 40.0])
@pytest.mark.parametrize("count", [3, 4, 9])
def test_the_drift_of_equal_uncertainties_is_that_of_least_squares(count, scatter):
    """Equal weights cancel, whatever the scatter: Student's interval of a straight line."""
    table = frame(count, scatter=scatter, date=[f"{1972 + 4 * n}-01-01" for n in range(count)])
    years = 4.0 * np.arange(count)  # of 365.25 days
    line = stats.linregress(years, table["k0"])
    drift = accelcal.history(table).trends[0].drift
    assert drift.value == pytest.approx(line.slope, rel=1e-6)
    assert drift.dof == count - 2
    expected = stats.t.ppf(0.975, count - 2) * line.stderr
    assert drift.expanded_uncertainty == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("count", [3, 5, 8])
def test_values_on_a_line_leave_the_uncertainty_that_is_stated(count):
    """No scatter at all: the textbook's standard uncertainty of a slope, and not zero."""
    time, stated = np.arange(float(count)), 1e-5
    columns = np.stack([np.ones(count), time - time.mean()], axis=1)
    fit = fit_line(columns, 3e-3 + 5e-6 * time, np.full(count, stated))
    u = stated / np.sqrt(((time - time.mean()) ** 2).sum())
    half = stats.t.ppf(0.975, count - 2) * fit.uncertainties[1]
    assert half == pytest.approx(u, rel=1e-9)


def test_the_interval_of_a_jump_counts_the_search():
    """Of the units whose jump is named at its place, it holds the size; those named are lucky."""
    random, held, textbook, named = np.random.default_rng(8), 0, 0, 0
    for _ in range(120):
        time = np.sort(random.uniform(0.0, 10.0, 8))
        sigma = np.full(8, 1e-5)
        values = random.normal(0.0, 1e-5, 8) + 1e-4 * (np.arange(8) >= 4)
        search = search_jumps(time, values, sigma, 0.02)
        if search.places[:1] != (4,):
            continue
        fit = fit_line(line_with_steps(time, search.places), values, sigma)
        size = _told(fit, 2, "g", searched=search.gaps)
        named, held = named + 1, held + (abs(size.value - 1e-4) <= size.expanded_uncertainty)
        narrow = stats.t.ppf(0.975, fit.dof) * size.standard_uncertainty
        textbook += abs(size.value - 1e-4) <= narrow
    assert search.gaps == 5
    assert named > 40
    assert stats.binomtest(held, named, 0.95, alternative="less").pvalue > 1e-3
    assert textbook < held


def test_uncertainties_that_are_stated_unlike_and_scatter_alike_make_no_jumps():
    """Tests on one head that every other states five times: chances are even, intervals hold.

    Weights as stated named a jump in 40 of them at 1 %, and held the truth in 119.
    """
    random, time = np.random.default_rng(21), np.arange(8.0)
    stated = np.where(np.arange(8) % 2, 5e-5, 1e-5)
    columns, named, held = line_with_steps(time, []), 0, 0
    for _ in range(150):
        values = 3e-3 + 5e-6 * time + 1e-5 * random.standard_normal(8)
        named += search_jumps(time, values, stated, 0.01).places != ()
        drift = _told(fit_line(columns, values, stated), 1, "g/year")
        held += abs(drift.value - 5e-6) <= drift.expanded_uncertainty
    assert stats.binomtest(named, 150, 0.01, alternative="greater").pvalue > 1e-3
    assert stats.binomtest(held, 150, 0.95, alternative="less").pvalue > 1e-3


def test_uncertainties_that_are_unlike_truly_count_as_stated():
    random, time = np.random.default_rng(22), np.arange(12.0)
    stated = np.where(np.arange(12) % 2, 5e-5, 1e-5)
    columns = line_with_steps(time, [])
    drifts = np.array([
        [
            fit_line(columns, values, stated).coefficients[1],
            np.polyfit(time, values, 1)[0],
        ]
        for values in stated * random.standard_normal((200, 12))
    ])  # fmt: skip
    weighted, equal = drifts.std(axis=0)
    assert weighted < 0.6 * equal


def test_scatter_widens_the_interval():
    quiet, loud = (accelcal.history(frame(scatter=s)).trends[0] for s in (0.0, 40.0))
    assert quiet.scatter < 3.0 * UG
    assert 15.0 * UG < loud.scatter < 80.0 * UG
    assert loud.drift.expanded_uncertainty > 5.0 * quiet.drift.expanded_uncertainty


@pytest.mark.parametrize("value", [3.3e-3, 1.35, 1e6])
def test_rounding_is_no_jump(value):
    """Equal values are off their line by rounding alone; a step in them is a jump all the same."""
    random = np.random.default_rng(5)
    for count in range(5, 25):
        time = np.sort(random.uniform(50.0, 60.0, count))
        sigma = np.full(count, 1e-5 * value)
        assert search_jumps(time, np.full(count, value), sigma, 0.01).places == ()
    stepped = value * (1.0 + 1e-4 * (np.arange(24) >= 12))
    assert search_jumps(time, stepped, sigma, 0.01).places == (12,)


def test_a_jump_is_named_with_its_dates():
    bias, gain = accelcal.history(frame(12, jump=100.0)).trends
    (jump,) = bias.jumps
    assert (jump.after, jump.before) == ("2015-01-01", "2016-01-01")
    assert jump.p_value < 0.01
    assert abs(jump.size.value - 100.0 * UG) < jump.size.expanded_uncertainty
    assert abs(bias.drift.value - 5.0 * UG) < bias.drift.expanded_uncertainty
    assert gain.jumps == ()
    assert gain.no_other_jump > 0.01


def test_four_calibrations_tell_no_jump():
    """They leave one degree of freedom beside a line with a step, and any step fits."""
    found = search_jumps(np.arange(4.0), np.array([0.0, 0.1, 9.0, 9.1]), np.full(4, 0.1), 0.02)
    assert (found.places, found.rest) == ((), None)


def test_an_uncertainty_of_zero_is_none():
    table = frame()
    table.loc[3, "k0_standard_uncertainty"] = table.loc[5, "K1_standard_uncertainty"] = 0.0
    found = accelcal.history(table)
    assert "2 of 10 tables have no uncertainty and are left out; repeat strokes" in found.notes
    assert len(found.trends[0].points) == 8


@pytest.mark.skipif(not hasattr(time, "tzset"), reason="the zone of a process is set on Unix only")
def test_a_date_without_a_zone_is_the_same_everywhere(monkeypatch):
    try:
        monkeypatch.setenv("TZ", "UTC-9")
        time.tzset()
        assert year("1971-01-01T06:00") == 1.0
        assert year("1971-01-01T15:00+09:00") == 1.0
    finally:
        monkeypatch.undo()
        time.tzset()


def test_two_jumps_are_named_in_the_order_of_their_dates():
    table = frame(20)
    table.loc[5:, "k0"] += 80.0 * UG
    table.loc[13:, "k0"] -= 150.0 * UG
    found = accelcal.history(table).trends[0].jumps
    assert [jump.before for jump in found] == ["2015-01-01", "2023-01-01"]


@pytest.mark.parametrize("count", [6, 8, 12])
def test_a_jump_and_its_return_are_named_in_few_calibrations(count):
    """They hid each other: none was named, and the scatter told was that of the jumps."""
    table = frame(count)
    table.loc[2:3, "k0"] += 300.0 * UG
    bias, gain = accelcal.history(table).trends
    assert [jump.before for jump in bias.jumps] == ["2012-01-01", "2014-01-01"]
    for jump, size in zip(bias.jumps, (300e-6, -300e-6), strict=True):
        assert abs(jump.size.value - size) < jump.size.expanded_uncertainty
        assert jump.p_value < 0.01
    assert bias.scatter < 10.0 * UG
    assert gain.jumps == ()


def test_pairs_of_jumps_add_little_to_the_false_alarms():
    rng = np.random.default_rng(1)
    chances = [
        jumps._next_pair(np.arange(8.0), rng.standard_normal(8), np.ones(8), [])[1]
        for _ in range(2000)
    ]
    assert np.mean(np.array(chances) < 0.5) < 0.05  # a tenth


def test_the_scale_factor_is_told_from_its_mean():
    table = frame()
    table["K1"] = -table["K1"] * (1.0 + 10e-6 * np.arange(10))
    gain = accelcal.history(table).trends[1]
    assert gain.drift.value == pytest.approx(10e-6, abs=1e-6)
    assert gain.reference == pytest.approx(-1.35, rel=1e-4)
    assert gain.reference_unit == "mA/g"


def calibrations_and_their_frame(count, **simulated):
    records = [
        replace(
            accelcal.simulate(seed=n, **simulated), date=f"201{n}-06-0{n + 1}", source=f"{n}.csv"
        )
        for n in range(count)
    ]
    calibrations = [accelcal.fit(record) for record in records]
    rows = [
        {
            "serial": c.serial,
            "source": c.source,
            "mounting": t.mounting,
            "date": c.date,
            "temperature_degC": t.temperature_degC,
            "output_unit": c.output_unit,
            **columns("k0", t.error_model["k0"]),
            **columns("K1", t.coefficients["K1"]),
        }
        for c in calibrations
        for t in c.tables
    ]
    return calibrations, pd.DataFrame(rows)


def columns(name, quantity):
    return {
        name: quantity.value,
        f"{name}_standard_uncertainty": quantity.standard_uncertainty,
        f"{name}_expanded_uncertainty": quantity.expanded_uncertainty,
    }


def test_calibrations_and_their_frame_tell_the_same():
    calibrations, table = calibrations_and_their_frame(4)
    direct = accelcal.history(calibrations)
    assert accelcal.history(table) == direct
    assert direct.temperature_degC == pytest.approx(20.0, abs=0.1)
    assert "runs at -40, 80 degC are left out" in direct.notes[0]


def test_a_frame_of_polars_tells_the_same():
    class OfPolars:
        """As far as accelcal takes it for a frame."""

        def __init__(self, table):
            self.columns, self._table = list(table), table

        def to_pandas(self):
            return self._table

    assert accelcal.history(OfPolars(frame())) == accelcal.history(frame())


def test_no_digit_of_a_frame_is_lost_in_csv(tmp_path):
    _, table = calibrations_and_their_frame(4)
    table.to_csv(tmp_path / "r.csv", index=False)
    assert read_entries([str(tmp_path / "r.csv")]) == entries_of(table)


@pytest.mark.parametrize("comma", [".", ","])
def test_a_frame_that_a_spreadsheet_saved_again_tells_the_same(tmp_path, comma):
    table = calibrations_and_their_frame(6)[1]
    table.to_csv(tmp_path / "r.csv", index=False)
    table.to_csv(tmp_path / "again.csv", index=False, sep=";", decimal=comma)
    table.to_csv(tmp_path / "tabs.txt", index=False, sep="\t", decimal=comma)
    wanted, *found = (
        read_entries([str(tmp_path / name)]) for name in ("r.csv", "again.csv", "tabs.txt")
    )
    assert found == [wanted, wanted]


def test_a_point_has_the_interval_that_its_calibration_states():
    """Nothing is declared: Student's factor of a head that few residuals tell, not 1.96."""
    calibrations, table = calibrations_and_their_frame(3, declare=False)
    bias, gain = accelcal.history(table).trends
    for calibration, of_bias, of_gain in zip(calibrations, bias.points, gain.points, strict=True):
        first = calibration.tables[0]
        k0, K1 = first.error_model["k0"], first.coefficients["K1"]
        assert k0.coverage_factor > 2.0
        assert of_bias.measured.expanded_uncertainty == k0.expanded_uncertainty
        of_ratio = of_gain.measured.expanded_uncertainty
        assert gain.reference * of_ratio == pytest.approx(K1.expanded_uncertainty)


def test_a_frame_without_intervals_has_those_of_the_normal_distribution():
    point = accelcal.history(frame()).trends[0].points[0].measured
    assert point.expanded_uncertainty == pytest.approx(1.959964 * 2.0 * UG)


def test_runs_of_one_test_count_once():
    table = pd.concat([frame(5), frame(5, seed=2)])
    found = accelcal.history(table)
    assert len(found.trends[0].points) == 5
    assert any("averaged" in note for note in found.notes)


@pytest.mark.parametrize("when", ["-01", "-01T15:30", "-07"])
def test_tests_of_one_week_count_once(when):
    """They share what scatters from week to week: half of such units got a jump that was none."""
    morning = frame(5, scatter=20.0)
    later = morning.assign(k0=morning["k0"] + UG, source="b" + morning["source"])
    later = later.assign(date=later["date"].str.removesuffix("-01") + when)
    found = accelcal.history(pd.concat([morning, later[1:3]]))
    mean = morning.copy()
    for name in ("k0", "K1"):
        mean.loc[1:2, name] = (morning[name] + later[name])[1:3] / 2.0
    for one, other in zip(found.trends, accelcal.history(mean).trends, strict=True):
        assert len(one.points) == 5
        assert one.drift.value == pytest.approx(other.drift.value)
        assert one.drift.expanded_uncertainty == pytest.approx(other.drift.expanded_uncertainty)
    assert found.notes[0] == "tests of a week are averaged: from 2011-01-01 and 2012-01-01"
    sources = [point.source for point in found.trends[0].points]
    assert sources == ["2010.csv", "2011.csv; b2011.csv", "2012.csv; b2012.csv", *sources[3:]]


def test_tests_eight_days_apart_are_two():
    first = frame(5)
    later = first.assign(source="b" + first["source"], date=first["date"].str[:-2] + "09")
    assert len(accelcal.history(pd.concat([first, later])).trends[0].points) == 10


@pytest.mark.parametrize("date", ["2014-01-01T09:00", "2013-12-28"])
def test_tests_between_which_the_unit_changed_are_two(date):
    """As before and after an adjustment: their mean stood between two levels."""
    noon = frame(8, jump=100.0).assign(date=lambda table: table["date"] + "T12:00")
    before = noon[4:5].assign(source="before.csv", k0=noon["k0"][3], date=date)
    found = accelcal.history(pd.concat([noon, before]))
    assert found.notes == (
        "tests that differ from those of the week before by more than their uncertainties are"
        " calibrations of their own: 2014-01-01",
    )
    (jump,) = found.trends[0].jumps
    assert (jump.after, jump.before) == (date[:10], "2014-01-01")
    alike = before.assign(k0=noon["k0"][4] + 5.0 * UG)
    (note,) = accelcal.history(pd.concat([noon, alike])).notes
    assert note == f"tests of a week are averaged: from {date[:10]}"


def test_tests_of_a_month_or_year_are_not_of_one_day():
    """Two calibrations dated by the year alone counted as one, and a note called it a day."""
    years = frame(6, date=["2018", "2018", "2019", "2020-05", "2020-05", "2021"])
    found = accelcal.history(years)
    assert len(found.trends[0].points) == 6
    assert not any("averaged" in note for note in found.notes)
    with pytest.raises(InputError, match="calibrations of 2 dates to compare"):
        accelcal.history(frame(4, date=["2018", "2018", "2019", "2019"]))


def test_tests_of_one_day_make_no_jump():
    named = 0
    for seed in range(30):
        rng = np.random.default_rng(seed)
        days = np.repeat(frame(5, drift=0.0, seed=seed, scatter=40.0)["k0"], 3)
        tests = pd.concat(3 * [frame(5)]).sort_values("date")
        tests["k0"] = days.to_numpy() + 2.0 * UG * rng.standard_normal(15)
        tests["source"] = [f"{n}.csv" for n in range(15)]
        named += bool(accelcal.history(tests).trends[0].jumps)
    assert named <= 2


def test_days_are_counted_where_they_are_too_few():
    table = frame(4, date=["2020-01-01", "2020-01-01T12:00", "1.1.2020", "2021-01-01"])
    with pytest.raises(InputError, match="calibrations of 2 dates to compare, and a drift needs 3"):
        accelcal.history(table)


def test_a_mean_has_the_temperature_and_the_warnings_of_all_that_it_is_of():
    again = frame(5, temperature_degC=20.04, gate_drift="warn", run="2")
    first = frame(5, temperature_degC=20.0, gate_drift="pass", run="1")
    found = comparable(entries_of(pd.concat([first, again])), *3 * [None])
    assert [entry.temperature for entry in found.entries] == pytest.approx([20.02] * 5)
    assert [entry.warned for entry in found.entries] == [("drift",)] * 5


def test_copies_of_a_table_count_once(tmp_path, capsys):
    once = frame(8, scatter=20.0, sha256=[f"{n}" * 64 for n in range(8)])
    copies = pd.concat([once, *(once[3:4].assign(source=name) for name in ("copy.csv", "b.csv"))])
    found, expected = accelcal.history(copies), accelcal.history(once)
    for one, other in zip(found.trends, expected.trends, strict=True):
        assert len(one.points) == 8
        assert one.drift.expanded_uncertainty == pytest.approx(other.drift.expanded_uncertainty)
        assert one.scatter == pytest.approx(other.scatter)
    told = "copy.csv (as in 2013.csv) and b.csv (as in 2013.csv)"
    assert found.notes == (f"the same readings again count once: {told}",)
    copies.to_csv(tmp_path / "results.csv", index=False)
    assert run(tmp_path / "results.csv") == 0
    assert "8 calibrations" in capsys.readouterr().out


def test_a_fit_of_what_a_batch_fitted_counts_once(tmp_path):
    paths = [tmp_path / f"{year}.csv" for year in (2020, 2021, 2022)]
    for number, path in enumerate(paths):
        record = replace(accelcal.simulate(seed=number), date=f"{path.stem}-05-01")
        accelcal.write_table(record, path)
    found = accelcal.batch(tmp_path)
    tables = found.tables
    assert accelcal.history(found) == accelcal.history(tables)  # it was "DataFrame in place of"
    assert accelcal.fleet_history(found) == accelcal.fleet_history(tables)
    accelcal.fit(accelcal.read_table(paths[0])).to_json(tmp_path / "2020.json")
    tables.to_csv(tmp_path / "results.csv", index=False)
    entries = read_entries([str(tmp_path / name) for name in ("results.csv", "2020.json")])
    same = comparable(
        [replace(entry, source=str(n)) for n, entry in enumerate(entries)], *3 * [None]
    )
    assert len(same.entries) == 3


GIVEN_AGAIN = (
    "calibrations that are given more than once, as in a table of batch and in a document of fit,"
    " count once: "
)


def test_a_calibration_in_a_table_and_a_document_is_told_as_such():
    """It was told as runs of one test."""
    records = [replace(accelcal.simulate(seed=n), date=f"{2020 + n}-05-01") for n in range(3)]
    sources = [f"{2020 + n}.csv" for n in range(3)]
    records = [replace(r, source=name) for r, name in zip(records, sources, strict=True)]
    once = [accelcal.fit(record) for record in records]
    twice = accelcal.history([*once, *once[:2]])
    plain = accelcal.history(once)
    assert [note for note in twice.notes if note not in plain.notes] == [
        GIVEN_AGAIN + "2020.csv and 2021.csv"
    ]
    assert twice.trends == plain.trends
    other = accelcal.fit(records[1], coefficients=("K0", "K1"))
    notes = [note for note in accelcal.history([*once, other]).notes if note not in plain.notes]
    assert notes[0] == GIVEN_AGAIN + "2021.csv"
    assert notes[1].startswith("calibrations of the same readings differ, as by other options of")
    assert notes[1].endswith("their mean counts: 2021.csv; give one of each")


def test_a_test_under_two_dates_is_told():
    """Saved anew it has another SHA-256, and made the unit look stable."""
    table = frame()
    table.loc[7, ["k0", "K1"]] = table.loc[4, ["k0", "K1"]]
    told = "the calibrations of 2014-01-01 and 2017-01-01 have the same values in all digits"
    assert [told in note for note in accelcal.history(table).notes].count(True) == 1
    (unit,) = accelcal.fleet_history(table).units
    assert any(told in remark for remark in unit.remarks)
    table.loc[7, "K1"] *= 1.0 + 1e-8  # a hundredth of the noise of another test
    assert not any("in all digits" in note for note in accelcal.history(table).notes)


def test_runs_and_copies_of_a_test_are_told_apart():
    runs = pd.concat([frame(5, run="1"), frame(5, seed=2, run="again")])
    found = accelcal.history(runs)
    assert found.notes == ("runs of one test at the level are averaged",)
    again = accelcal.history(pd.concat([runs, frame(5, run="1")[:2]]))
    assert again.notes == (*found.notes, GIVEN_AGAIN + "2010.csv and 2011.csv")
    assert again.trends == found.trends


def test_sheets_of_one_workbook_are_no_copies():
    sheets = [f"all.xlsx#{n}" for n in range(8)]
    found = accelcal.history(frame(8, source=sheets, sha256="0" * 64))
    assert len(found.trends[0].points) == 8
    assert found.notes == ()


def test_other_levels_can_be_chosen():
    warm = frame(6, drift=50.0, temperature_degC=60.0)
    found = accelcal.history(pd.concat([frame(8), warm]), temperature=60.0)
    assert found.temperature_degC == 60.0
    assert found.trends[0].drift.value == pytest.approx(50.0 * UG, abs=5.0 * UG)


@pytest.mark.parametrize(("apart", "told"), [(0.03, False), (0.3, True), (1.5, True)])
def test_temperatures_that_differ_within_a_level_are_told(apart, told):
    warm = [20.0 + apart * (n == 4) for n in range(8)]
    notes = accelcal.history(frame(8, temperature_degC=warm)).notes
    assert any(f"differ by {apart:g} degC" in note for note in notes) is told


def test_unknown_temperatures_are_told():
    found = accelcal.history(frame(temperature_degC=np.nan))
    assert found.temperature_degC is None
    assert any("temperatures are unknown" in note for note in found.notes)


def test_the_day_of_a_test_is_that_of_its_place():
    """Half past midnight in a zone east of Greenwich is the day before in Greenwich."""
    dates = [f"{2010 + n}-06-01T00:30:00+02:00" for n in range(12)]
    trend = accelcal.history(frame(12, jump=100.0, date=dates)).trends[0]
    assert [point.date for point in trend.points] == [date[:10] for date in dates]
    assert (trend.jumps[0].after, trend.jumps[0].before) == ("2015-06-01", "2016-06-01")


def test_dates_that_are_missing_are_told():
    table = frame()
    table.loc[3, "date"] = None
    table.loc[4, "date"] = "last spring"
    found = accelcal.history(table)
    assert len(found.trends[0].points) == 8
    assert "2 of 10 tables have no date that can be read, first 2013.csv" in found.notes[0]


def test_few_calibrations_have_no_search_for_jumps():
    found = accelcal.history(frame(4, jump=500.0))
    assert found.trends[0].no_other_jump is None
    assert "4 calibrations are too few to look for jumps and bends, which needs 5" in found.notes


def test_the_gates_of_a_frame_are_its_checks_and_no_other_column_is():
    table = frame(remark="warn", gate_lack_of_fit=["pass", "warn", *["pass"] * 8])
    warned = [note for note in accelcal.history(table).notes if "warn" in note]
    assert warned == ["checks of a calibration warn: 2011-01-01 (lack of fit)"]


def test_prefixes_of_units_are_converted():
    alike, mixed = frame(), frame(output_unit=["mA", "uA"] * 4 + ["A", "mA"])
    per_milliampere = mixed["output_unit"].map({"mA": 1.0, "uA": 1e3, "A": 1e-3})
    for column in ("K1", "K1_standard_uncertainty"):
        mixed[column] *= per_milliampere
    one, other = accelcal.history(alike), accelcal.history(mixed)
    assert other.trends[1].drift.value == pytest.approx(one.trends[1].drift.value, rel=1e-9)
    assert other.trends[1].reference_unit == "mA/g"
    assert "scale factors of outputs in uA, A are converted to mA/g" in other.notes


def test_tests_in_a_unit_of_another_quantity_are_left_out():
    """Volts over a load resistor among milliamperes; the history of the others was refused."""
    units = ["V", "mA", "V", "mA", "uA", "mA", "mA", "mA", "V", "V"]
    k1 = [{"V": 13.5, "mA": 1.35, "uA": 1350.0}[unit] for unit in units]
    found = accelcal.history(frame(K1=k1, output_unit=units))
    assert [len(trend.points) for trend in found.trends] == [6, 6]
    assert any("mA is followed: left out are 4 of 10 tables, V in 2010" in n for n in found.notes)


@pytest.mark.parametrize(
    ("table", "options", "message"),
    [
        (frame(2), {}, "serial A has calibrations of 2 dates to compare, and a drift needs 3"),
        (frame(date=None), {}, "10 of 10 tables have no date that can be read, first 2010.csv"),
        (frame(), {"serial": "B"}, "no serial 'B' in the results; there is A"),
        (frame(serial=42), {"serial": "0042"}, r"there is 42; read them .* dtype={'serial': str}"),
        (
            frame(serial=list("ABABABABAB")),
            {},
            "several units; choose one by its serial, or take fleet_history: A and B",
        ),
        (frame(), {"mounting": "p+"}, "no mounting 'p\\+' in the results; there is o\\+"),
        (frame(), {"temperature": 80.0}, "no calibration at 80 degC; there is 20 degC"),
        (frame(), {"alpha": 2.0}, "alpha is 2; it is a chance from 0.001 to 1"),
        (frame(k0_standard_uncertainty=np.nan), {}, "10 of 10 tables have no uncertainty"),
        (frame(4, output_unit=["mA", "mA", "V", "V"]), {}, "left out are 2 of 4 tables, V in 2012"),
        (frame(4, output_unit=["mA", "mA", None, None]), {}, "none given in 2012.csv; .* '# unit"),
        (frame().drop(columns="K1"), {}, "no column 'K1' in the frame"),
        (frame(0), {}, "no calibration is given"),
        (frame(temperature_degC=np.nan), {"temperature": 20.0}, "leave out the temperature"),
    ],
)
def test_what_cannot_be_followed_is_told(table, options, message):
    with pytest.raises(InputError, match=message) as told:
        accelcal.history(table, **options)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("date", "expected"),
    [
        ("2024-05-31", 54.413),
        ("2024-05-31T12:00:00+02:00", 54.414),
        ("31.05.2024", 54.413),
        ("2024/05/31", 54.413),
        ("31.05.2024 12:00", 54.414),  # as a table may have it
        ("2024/5/31 12:00", 54.414),
        ("2024-05", 54.330),
        ("2024", 53.999),
        ("last spring", None),
        ("11/10/2026", None),  # the day or the month first?
        ("", None),
        (None, None),
    ],
)
def test_dates(date, expected):
    assert year(date) == (None if expected is None else pytest.approx(expected, abs=1e-3))


# -- command ---------------------------------------------------------------------------------------


def test_the_command_tells_the_drift(results, capsys):
    assert run(results) == 0
    printed = capsys.readouterr().out
    assert "10 calibrations from 2010-01-01 to 2019-01-01, at 20 degC, mounting o+" in printed
    assert "ug/year" in printed
    assert re.search(r"  scatter  [\d.]+ \([\d.]+ to [\d.]+\) ug from", printed)
    assert "no jump at alpha = 0.01" in printed
    assert max(map(len, printed.splitlines())) <= 100


def test_the_newest_calibrations_are_shown(tmp_path, capsys):
    path = tmp_path / "results.csv"
    frame(50).to_csv(path, index=False)
    assert run(path) == 0
    printed = capsys.readouterr().out
    assert "2059-01-01 " in printed
    assert "    2019-01-01 " not in printed
    assert "and 10 earlier ones (CSV and JSON have all)" in printed


def test_nothing_is_told_of_how_a_long_table_is_read(tmp_path, recwarn):
    """A text far down a column of empty cells had pandas warn of its types."""
    path = tmp_path / "results.csv"
    many = dict.fromkeys(map(str, range(2000)), 1)  # of so many columns pandas takes 512 rows
    tables = [*60 * [frame(serial="B", stands_for=None, **many)], frame(stands_for="K3", **many)]
    pd.concat(tables).to_csv(path, index=False)
    assert run(path, "--serial", "A") == 0
    assert not list(recwarn)


def test_jumps_are_told_in_text(tmp_path, capsys):
    path = tmp_path / "results.csv.gz"
    frame(12, jump=100.0).to_csv(path, index=False)
    assert run(path, "--serial", "A") == 0
    printed = capsys.readouterr().out
    assert "JUMP     between 2015-01-01 and 2016-01-01: " in printed
    assert "ug, p < 0.001\n" in printed


@pytest.mark.parametrize("serial", ["NA", "None", "nan", "null", "007", "(none)"])
def test_a_serial_is_what_is_written(tmp_path, capsys, serial):
    path = tmp_path / "results.csv"
    units = [frame(4, serial=name) for name in ("NA", "None", "nan", "null", "007", "7", "")]
    pd.concat(units).to_csv(path, index=False)
    assert run(path, "--serial", serial) == 0
    assert "\n4 calibrations from" in capsys.readouterr().out


def test_json_and_csv(results, tmp_path, capsys):
    assert run(results, "--format", "json") == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "accelcal/history/1"
    assert [trend["name"] for trend in document["trends"]] == ["bias", "scale factor"]
    assert run(results, "--format", "csv", "-o", tmp_path / "history.json") == 0
    assert json.loads((tmp_path / "history.json").read_text("utf-8")) == document
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("serial,quantity,date,source,value,standard_uncertainty")
    assert len(lines) == 21


def test_documents_of_fit_are_results_too(tmp_path, capsys):
    paths = [tmp_path / f"{n}.json" for n in range(3)]
    for n, path in enumerate(paths):
        record = replace(accelcal.simulate(seed=n), date=f"202{n}-01-01")
        accelcal.fit(record).to_json(path)
    assert run(*paths) == 0
    assert "3 calibrations from 2020-01-01 to 2022-01-01" in capsys.readouterr().out


def test_parquet(tmp_path, capsys):
    pytest.importorskip("pyarrow")
    path = tmp_path / "results.parquet"
    frame().to_parquet(path)
    assert run(path) == 0
    assert "10 calibrations" in capsys.readouterr().out


@pytest.mark.parametrize("form", ["csv", "json"])
def test_standard_input_is_read_once(tmp_path, monkeypatch, capsys, form):
    path = tmp_path / f"results.{form}"
    if form == "csv":
        frame().to_csv(path, index=False)
    else:
        records = [replace(accelcal.simulate(seed=n), date=f"202{n}-01-01") for n in range(3)]
        path.write_text(all_to_json([accelcal.fit(record) for record in records]))
    with path.open("rb") as file:
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(file))
        code = run("-", "--format", "json")
    out, err = capsys.readouterr()
    assert (code, err) == (0, "")
    assert json.loads(out)["serial"] in ("A", "AL-15")


def test_the_picture_is_legible(results, tmp_path):
    pytest.importorskip("matplotlib")
    assert run(results, "--plot", tmp_path / "history.svg") == 0
    assert (tmp_path / "history.svg").read_text("utf-8").startswith("<?xml")
    table = frame(20, jump=100.0)
    table.loc[4:, "k0"] -= 150.0 * UG
    panels = accelcal.history(table).plot.trends()
    labels = [text.get_text() for text in panels[0].get_legend().get_texts()]
    assert "2 jumps, the least sure p < 0.001" in labels


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("no.csv", None, "no such file"),
        ("empty.csv", "", "empty"),
        ("words.csv", "hello\nworld\n", "no column 'serial'"),
        ("broken.csv", 'a,b\n1,2,3\n4,"5\n', "not a frame of results"),
        ("broken.json", "{", "JSON"),
        ("other.json", '{"schema": "accelcal/discovery/1"}', "accelcal/calibration/1"),
        ("binary.parquet", "no", "binary.parquet: "),
    ],
)
def test_faults_of_files_are_told_in_a_line(tmp_path, capsys, name, content, message):
    path = tmp_path / name
    if content is not None:
        path.write_text(content, encoding="utf-8")
    assert run(path) == 2
    told = capsys.readouterr().err
    assert message in told
    assert len(told.splitlines()) == 1
    assert "Traceback" not in told


def test_results_that_were_cut_off_are_refused(results, tmp_path, capsys):
    """Of the last number digits were lost: a bias of 3 g counted beside those of 3 mg."""
    rows = results.read_text("utf-8").rstrip("\n").split("\n")
    place = rows[0].split(",").index("k0_standard_uncertainty")
    short = ",".join(rows[-1].split(",")[:place]) + ",1.6"
    path = tmp_path / "cut.csv"
    path.write_text("\n".join([*rows[:-1], short]), "utf-8")
    assert run(path) == 2
    assert (
        f"the last row has {place + 1} of {rows[0].count(',') + 1} fields"
        in capsys.readouterr().err
    )
    path.write_text("\n".join(rows), "utf-8")
    assert run(path) == run(results)


def test_a_file_of_results_is_not_overwritten(results, capsys):
    assert run(results, "-o", results) == 2
    assert "is a file to be read" in capsys.readouterr().err


def test_reprs():
    found = accelcal.history(frame(12, jump=100.0))
    assert repr(found) == "<History serial A: 12 calibrations, 1 jump>"
    assert found.to_frame().shape[0] == 24
    assert found.to_frame()["date"].dtype == "datetime64[us]"


def test_checks_that_warn_are_told_from_a_frame_as_from_calibrations():
    gates = {"gate_lack_of_fit": ["pass"] * 9 + ["warn"], "gate_closure": ["not assessed"] * 10}
    told = "checks of a calibration warn: {} (lack of fit)"
    assert accelcal.history(frame(**gates)).notes == (told.format("2019-01-01"),)
    assert accelcal.history(frame()).notes == ()
    record = accelcal.simulate(effects=[accelcal.effect("hysteresis").of(5e-5)], seed=3)
    faulty = replace(accelcal.fit(record), date="2024-05-01")
    sound = accelcal.fit(accelcal.simulate(seed=1))
    others = [replace(sound, date=f"{year}-05-01") for year in (2022, 2023)]
    (note,) = (n for n in accelcal.history([faulty, *others]).notes if "warn" in n)
    assert note == told.format("2024-05-01").replace("lack of fit", "forward against back")


# -- places ----------------------------------------------------------------------------------------


def test_calibrations_of_two_places_are_told_in_one_local_g():
    plain = frame(12)
    gravity = np.where(np.arange(12) < 8, 9.8106, 9.7803)
    ratio = gravity / 9.8106
    moved = plain.assign(g_local_m_s2=gravity)
    for name, factor in (("k0", 1.0 / ratio), ("K1", ratio)):
        for column in (name, f"{name}_standard_uncertainty"):
            moved[column] = plain[column] * factor
    found, expected = accelcal.history(moved), accelcal.history(plain)
    assert found.notes[-1] == (
        "calibrations where g is 9.7803 m/s^2 are converted to g = 9.8106 m/s^2"
    )
    for one, other in zip(found.trends, expected.trends, strict=True):
        assert one.drift.value == pytest.approx(other.drift.value, abs=1e-12)
        assert one.scatter == pytest.approx(other.scatter, abs=1e-12)
        assert len(one.jumps) == len(other.jumps)
    moved.loc[3, "g_local_m_s2"] = np.nan
    assert accelcal.history(moved).notes[-1].endswith("; 1 table without gravity is not")
    assert accelcal.history(plain.assign(g_local_m_s2=9.8)).trends == expected.trends


def test_a_jump_that_the_temperature_may_make_is_not_named():
    """At 19.8 degC, then at 20.2: a scale factor of 520 ppm/degC looks like a jump of 208 ppm."""
    warm = np.where(np.arange(10) < 5, 19.8, 20.2)
    heated = 1.35 * (1.0 + 520e-6 * (warm - 20.0) + 1e-6 * np.sin(7.0 * np.arange(10)))
    found = accelcal.history(frame(10, temperature_degC=warm, K1=heated))
    assert (found.trends[1].jumps, found.trends[1].no_other_jump) == ((), None)
    assert any("a jump of the scale factor between 2014-01-01 and 2015" in n for n in found.notes)
    alike = accelcal.history(frame(10, K1=heated))
    assert len(alike.trends[1].jumps) == 1


def test_a_larger_jump_is_named_with_an_interval_that_counts_the_temperature():
    warm = np.where(np.arange(10) < 5, 19.95, 20.05)
    found = accelcal.history(frame(10, jump=100.0, temperature_degC=warm))
    (jump,) = found.trends[0].jumps
    assert jump.size.value == pytest.approx(100.0 * UG, abs=15.0 * UG)
    assert jump.size.expanded_uncertainty > 1.9 * 0.1 * 40.0 * UG
    without = accelcal.history(frame(10, jump=100.0)).trends[0].jumps[0]
    assert jump.size.expanded_uncertainty > without.size.expanded_uncertainty


def test_a_room_that_gets_warmer_is_no_certain_drift():
    warm = 20.0 + 0.04 * np.arange(10)
    heated = 1.35 * (1.0 + 520e-6 * (warm - 20.0))
    drift = accelcal.history(frame(10, temperature_degC=warm, K1=heated)).trends[1].drift
    assert drift.value == pytest.approx(20.8e-6, rel=0.01)
    assert abs(drift.value) < drift.expanded_uncertainty


def told_of_bends(found):
    return [note for note in found.notes if note.startswith("a line that bends")]


@pytest.mark.parametrize("constant", [1.5, 3.0])
def test_a_jump_that_a_settling_unit_makes_is_told(constant):
    number = np.arange(15)
    table = frame(15, drift=0.0, scatter=10.0)
    table["k0"] += 500.0 * UG * np.exp(-number / constant)
    found = accelcal.history(table)
    (jump,) = found.trends[0].jumps
    (note,) = told_of_bends(found)
    assert f"fits the bias better than its jump between {jump.after} and {jump.before}:" in note


def test_bends_and_steps_are_held_against_values_of_unlike_uncertainties():
    time, uncertainty = np.arange(10.0), np.where(np.arange(10) % 2, 5.0, 1.0)
    for place in range(2, 5):
        step, settled = 1.0 * (time >= place), np.exp(-time / 2.0)
        assert jumps_like_bends(time, step, uncertainty, (place,)) == ()
        assert jumps_like_bends(time, settled, uncertainty, (place,)) == (place,)


def test_true_jumps_are_not_taken_for_bends():
    found = [accelcal.history(frame(12, jump=100.0, scatter=10.0, seed=n)) for n in range(20)]
    assert sum(len(each.trends[0].jumps) for each in found) >= 15
    assert sum(map(len, map(told_of_bends, found))) <= 1


def told_of_changes(found):
    return [note for note in found.notes if note.startswith("the drift of the bias ")]


@pytest.mark.parametrize(("count", "constant"), [(6, 1.0), (8, 2.0), (12, 3.0)])
def test_a_unit_that_settles_without_a_jump_is_told(count, constant):
    """A drift per year stood there without a word, which the last years do not have."""
    number = np.arange(count)
    table = frame(count, drift=0.0)
    table["k0"] += 100.0 * UG * np.exp(-number / constant)
    found = accelcal.history(table)
    assert found.trends[0].jumps == ()
    (note,) = told_of_changes(found)
    assert re.match(
        r"the drift of the bias slows \(chance [\de.-]+\): its figure per year is", note
    )
    assert told_of_changes(accelcal.history(frame(count))) == []


@pytest.mark.parametrize("size", [200.0, -200.0])
def test_a_unit_that_settles_after_its_jump_is_told(size):
    """Only lines without a jump were searched for bends, and no note told of it."""
    table = frame(12, jump=500.0, scatter=5.0)
    assert told_of_changes(accelcal.history(table)) == []
    since = np.maximum(table.index - 6, 0)
    table["k0"] += UG * size * np.where(table.index < 6, 0.0, np.exp(-since / 1.5))
    found = accelcal.history(table)
    (jump,) = found.trends[0].jumps
    (note,) = told_of_changes(found)
    assert note.startswith(f"the drift of the bias slows after its jump before {jump.before} (")


@pytest.mark.parametrize(("drift", "later", "said"), [(3.0, 33.0, "grows"), (33.0, 3.0, "slows")])
def test_a_drift_that_is_another_one_after_a_jump_is_told(drift, later, said):
    """One that was greater from the jump on was told to slow after it."""
    table = frame(12, drift=drift, jump=500.0, scatter=5.0)
    table["k0"] += UG * (later - drift) * np.maximum(table.index - 6, 0)
    found = accelcal.history(table)
    (jump,) = found.trends[0].jumps
    (note,) = told_of_changes(found)
    assert note.startswith(f"the drift of the bias {said} after its jump before {jump.before} (")


def test_a_drift_that_grows_is_told():
    table = frame(10)
    (note,) = told_of_changes(accelcal.history(table.assign(k0=table["k0"] + UG * table.index**2)))
    assert note.startswith("the drift of the bias grows (chance ")


def test_a_straight_line_slows_by_chance_as_often_as_alpha_says():
    found = [accelcal.history(frame(6, scatter=20.0, seed=n), alpha=0.2) for n in range(100)]
    told = sum(len(told_of_changes(each)) for each in found)
    assert stats.binomtest(told, 100, 0.1).pvalue > 1e-3


def test_a_bend_that_the_temperature_may_make_is_not_told():
    warm = 20.0 + 1.5 * np.exp(-np.arange(10) / 2.0)
    table = frame(10, drift=0.0)
    settled = table.assign(k0=table["k0"] + 40.0 * UG * (warm - 20.0))
    assert len(told_of_changes(accelcal.history(settled))) == 1
    assert told_of_changes(accelcal.history(settled.assign(temperature_degC=warm))) == []


def test_a_calibration_apart_from_all_others_is_told():
    """The last one was 1000 ug off, and the history said that there was no jump, p = 1."""
    table = frame(8)
    table.loc[7, "k0"] += 1000.0 * UG
    found = accelcal.history(table)
    assert found.trends[0].jumps == ()
    (note,) = found.notes
    told = r"the bias of 2017-01-01 is (99\d|1000|1010) ug from what all others say \(chance \de-"
    assert re.match(told, note)
    assert accelcal.history(frame(8)).notes == ()
    warm = table.assign(temperature_degC=np.where(table.index == 7, 21.9, 19.9))
    steep = accelcal.history(warm.assign(k0=frame(8)["k0"] + 70.0 * UG * (table.index == 7)))
    assert not any("all others say" in note for note in steep.notes)


@pytest.mark.parametrize(
    ("place", "cause"),
    [
        (0, "a bad calibration, or a jump after it"),
        (4, "a bad calibration"),
        (7, "a bad calibration, or a jump that no second one confirms; calibrate again"),
    ],
)
def test_a_calibration_between_others_is_no_jump(place, cause):
    table = frame(8)
    table.loc[place, "k0"] += 1000.0 * UG
    (note,) = (note for note in accelcal.history(table).notes if "all others say" in note)
    assert note.partition("): ")[2] == cause


def test_values_closer_than_their_uncertainties_are_no_proof_of_no_scatter():
    found = accelcal.history(frame(8, K1=1.35, K1_standard_uncertainty=1.35e-4))
    assert found.trends[1].scatter_limits == (0.0, 0.0)
    assert "scatter  none: the values lie closer together" in str(found)
    assert found.notes == ()  # what rounding leaves of equal values is alike by chance


def test_a_unit_that_wanders_is_told_of():
    rng = np.random.default_rng(3)
    walks = 4e-3 + UG * np.cumsum(20.0 * rng.standard_normal(30))
    notes = accelcal.history(frame(30, k0=walks)).notes
    assert any(note.startswith("the bias wanders: neighbouring") for note in notes)
    told = [
        any("wanders" in note for note in accelcal.history(frame(12, scatter=20.0, seed=s)).notes)
        for s in range(20)
    ]
    assert sum(told) <= 3


def test_the_drift_of_a_walk_is_that_of_generalised_least_squares():
    """By one share alone it is that of scipy's inverse of the covariance."""
    rng = np.random.default_rng(3)
    time = np.sort(rng.uniform(0.0, 10.0, 9))
    columns = np.stack([np.ones(9), time - time.mean()], axis=1)
    values = 3.0 * time + np.cumsum(rng.standard_normal(9))
    variance = rng.uniform(0.5, 2.0, 9)
    found, uncertainty = line_of_a_walk(time, columns, values, variance)
    walk = np.minimum.outer(time - time[0], time - time[0])
    left = np.eye(9) - columns @ np.linalg.pinv(columns)
    walk *= np.trace(left @ np.diag(variance)) / np.trace(left @ walk)
    drifts, errors, chances = [], [], []
    for share in (0.25, 0.5, 0.75, 1.0):
        inverse = np.linalg.inv((1.0 - share + 1e-6) * np.diag(variance) + share * walk)
        normal = columns.T @ inverse @ columns
        line = np.linalg.solve(normal, columns.T @ inverse @ values)
        rest = values - columns @ line
        squares = rest @ inverse @ rest
        drifts.append(line[1])
        errors.append(squares / 7.0 * np.linalg.inv(normal)[1, 1])
        sizes = np.linalg.slogdet(inverse)[1] - np.linalg.slogdet(normal)[1]
        chances.append(0.5 * sizes - 3.5 * np.log(squares))
    weights = np.exp(np.array(chances) - max(chances))
    mean = np.average(drifts, weights=weights)
    assert found[1] == pytest.approx(mean, rel=1e-6)
    squared = np.average(np.array(errors) + (np.array(drifts) - mean) ** 2, weights=weights)
    assert uncertainty[1] == pytest.approx(squared**0.5, rel=1e-6)


@pytest.mark.parametrize("count", [5, 12])
def test_the_interval_of_a_walk_holds_a_drift_beside_it(count):
    """That of the drift holds it in less than 75 %."""
    held = np.zeros(2)
    for seed in range(120):
        rng = np.random.default_rng([60, seed])
        walk = 20.0 * UG * np.cumsum(rng.standard_normal(count))
        table = frame(count, seed=seed)
        trend = accelcal.history(table.assign(k0=table["k0"] + walk)).trends[0]
        for place, told in enumerate((trend.drift, trend.drift_of_a_walk)):
            held[place] += abs(told.value - 5.0 * UG) <= told.expanded_uncertainty
        assert trend.drift_of_a_walk.expanded_uncertainty >= trend.drift.expanded_uncertainty
    assert held[0] < 90
    assert held[1] > 105


def test_a_history_without_the_drift_of_a_walk_is_read():
    document = json.loads(accelcal.history(frame(), alpha=0.01).to_json())
    for trend in document["trends"]:
        assert trend.pop("drift_of_a_walk")["unit"].endswith("/year")
    again = accelcal.History.from_json(json.dumps(document))
    assert [trend.drift_of_a_walk for trend in again.trends] == [None, None]
    assert "wander" not in str(again)
    assert str(again).count("  drift ") == 2


def test_the_interval_of_a_unit_that_may_wander_is_told_first():
    """The narrow one stood first, which holds the drift of units that wander in 27 to 72 %."""
    found = accelcal.history(frame(12, drift=15.0, jump=100.0, scatter=15.0))
    trend = found.trends[0]
    first, second = str(found).splitlines()[4:6]
    told = [
        f"{UG**-1 * drift.expanded_uncertainty:.2g} ug/year"
        for drift in (trend.drift_of_a_walk, trend.drift)
    ]
    assert told[0] in first
    assert first.endswith(", for a unit that may wander, jumps included")
    assert told[1] in second
    assert second.endswith(" beside the jumps if it does not wander")
    assert str(trend.drift_of_a_walk) in repr(trend)


def test_serials_that_differ_in_case_alone_are_told():
    """Calibrations of al-15 were missing in the history of AL-15 without a word."""
    calibrations = []
    for when in range(2018, 2024):
        record = accelcal.simulate(plan=accelcal.TumblePlan(temperatures=(20.0,)), seed=when)
        serial = "al\u201115" if when == 2020 else "AL-15"
        calibrations.append(accelcal.fit(replace(record, date=f"{when}-05-01", serial=serial)))
    notes = accelcal.history(calibrations, "AL-15").notes
    assert any("count as 2 units; if they are one, write them" in note for note in notes)
