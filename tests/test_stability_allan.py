"""The Allan deviation against Stable32, and noise terms that are there or not."""

from collections import Counter

import numpy as np
import pytest
from real_data import real_file

from accelcal.stability.allan import even_series, overlapping_allan
from accelcal.stability.noise_terms import TERMS, _products, noise_terms
from accelcal.stability.record import Launch

STABLE32 = {  # factor: differences, alpha, lower, deviation, upper at one sigma
    1: (999, 0, 2.8515e-01, "2.9223e-01", 2.9987e-01),
    2: (997, 0, 1.9520e-01, "2.0102e-01", 2.0738e-01),
    4: (993, 0, 1.3931e-01, "1.4479e-01", 1.5098e-01),
    8: (985, 0, 1.0038e-01, "1.0570e-01", 1.1198e-01),
    16: (969, 0, 5.7696e-02, "6.1915e-02", 6.7217e-02),
    32: (937, 0, 4.3654e-02, "4.8082e-02", 5.4202e-02),
    64: (873, 0, 3.1755e-02, "3.6237e-02", 4.3377e-02),
    128: (745, 0, 2.3045e-02, "2.7674e-02", 3.7027e-02),
}
"""Stable32 1.60 on the file PHASE.DAT, as in tests/phasedat of allantools (LGPL-3+), commit
599dc9ea133ea4852f97e5ed88e51dc11bbdae1f."""


def nist_1000_points():
    """Frequencies of the 1000-point test suite, NIST SP 1065, section 12.4."""
    n, points = 1234567890, []
    for _ in range(1000):
        points.append(n / 2147483647)
        n = 16807 * n % 2147483647
    return np.array(points)


def test_nist_points_are_those_of_the_handbook():
    points = nist_1000_points()  # NIST SP 1065, table 31: minimum, maximum, average
    figures = [f"{x:.6e}" for x in (points.min(), points.max(), points.mean())]
    assert figures == ["1.371760e-03", "9.957453e-01", "4.897745e-01"]


def test_stable32_octaves():
    result = overlapping_allan([nist_1000_points()], factors=list(STABLE32), level=0.6826894921)
    for row, (count, alpha, lower, deviation, upper) in zip(
        result.rows(), STABLE32.values(), strict=True
    ):
        assert (row["count"], row["alpha"]) == (count, alpha)
        assert f"{row['deviation']:.4e}" == deviation
        assert row["lower"] == pytest.approx(lower, rel=4e-4)
        assert row["upper"] == pytest.approx(upper, rel=4e-4)


@pytest.mark.parametrize(
    ("data", "reference"),
    [
        ("ocxo_frequency.txt", "ocxo_stable32_oadev_alltau.txt"),
        ("PHASE.DAT", "phase_dat_oadev.txt"),
    ],
)
def test_stable32_all_averaging_times(data, reference):
    series = np.loadtxt(real_file("stable32_phase_ocxo", data))
    series = np.diff(series) if data == "PHASE.DAT" else series / np.median(series) - 1.0
    table = np.loadtxt(real_file("stable32_phase_ocxo", reference))
    result = overlapping_allan([series], factors=table[:, 0].astype(int))
    assert result.count == tuple(table[:, 2].astype(int))
    assert [f"{x:.4e}" for x in result.deviation] == [f"{x:.4e}" for x in table[:, 5]]


def test_deviation_is_its_definition():
    """The sum of NIST SP 1065, eq. (11), written out."""
    values, interval, m = np.random.default_rng(3).normal(size=50).cumsum(), 0.5, 4
    x = np.concatenate([[0.0], np.cumsum(values) * interval])
    second = [x[i + 2 * m] - 2 * x[i + m] + x[i] for i in range(x.size - 2 * m)]
    expected = np.sqrt(np.mean(np.square(second)) / (2 * (m * interval) ** 2))
    result = overlapping_allan([values], interval, factors=[m])
    assert result.deviation == pytest.approx((expected,), rel=1e-9)


def test_pieces_are_pooled_and_their_levels_do_not_matter():
    random = np.random.default_rng(4)
    pieces = [random.normal(size=300), 1e3 + random.normal(size=500)]
    pooled = overlapping_allan(pieces, factors=[1, 8])
    single = [overlapping_allan([piece], factors=[1, 8]) for piece in pieces]
    assert pooled.count == tuple(a + b for a, b in zip(*(s.count for s in single), strict=True))
    assert pooled.deviation[0] == pytest.approx(1.0, rel=0.1)
    assert pooled.edf[1] > max(s.edf[1] for s in single)


WHITE = (lambda random, n: random.normal(size=n), lambda m: m**-0.5)
STEPS = (  # sums of white steps: (2 m^2 + 1) / 6 m, from the definition
    lambda random, n: np.cumsum(random.normal(size=n)),
    lambda m: ((2.0 * m**2 + 1.0) / (6.0 * m)) ** 0.5,
)


@pytest.mark.parametrize(("make", "truth"), [WHITE, STEPS], ids=["white", "random walk"])
def test_intervals_of_the_deviation_cover(make, truth):
    """At all averaging times, those with a handful of means as well."""
    random = np.random.default_rng(5)
    held = Counter()
    for _ in range(200):
        for row in overlapping_allan([make(random, 1024)], factors=[1, 8, 32, 64, 128]).rows():
            held[row["tau_s"]] += row["lower"] <= truth(row["tau_s"]) <= row["upper"]
    # of 200 intervals at 95 %, fewer than 176 hold the truth once in 10 000 tries
    assert min(held.values()) >= 176


def test_few_means_do_not_turn_white_noise_into_another():
    """By 30 means alone, every fourth record of white noise has another kind of noise."""
    random = np.random.default_rng(6)
    records = [overlapping_allan([random.normal(size=1024)]).alpha for _ in range(60)]
    assert np.mean(np.array(records) > 0) == 0.0
    assert np.mean(np.array(records) < 0) < 0.05


def test_an_averaging_time_without_differences_is_left_out():
    assert overlapping_allan([np.arange(10.0)], factors=[1, 8]).tau_s == (1.0,)
    assert overlapping_allan([]).tau_s == ()


# -- noise terms -----------------------------------------------------------------------------------


def identified(series):
    terms = noise_terms(overlapping_allan([series]), "g")
    return "".join(name for name, term in terms.items() if term.value is not None), terms


def random_walk(random, size):
    return np.cumsum(random.normal(size=8 * size)).reshape(-1, 8).mean(axis=1) / 8**0.5


def flicker(random, size):
    k = np.arange(1, size)
    response = np.concatenate([[1.0], np.cumprod((k - 0.5) / k)])
    return np.convolve(random.normal(size=size), response)[:size]


@pytest.mark.parametrize(
    ("make", "found", "truth"),
    [
        (lambda random, n: random.normal(size=n), "N", 1.0),
        (random_walk, "K", 1.0),
        (flicker, "B", None),
        (lambda random, n: np.diff(random.normal(size=n + 1)), "Q", 1.0),
    ],
    ids=["white", "random walk", "flicker", "quantisation"],
)
def test_the_noise_that_is_there_is_identified_alone(make, found, truth):
    for seed in range(5):
        names, terms = identified(make(np.random.default_rng(seed), 4000))
        assert names == found
        if truth:
            term = terms[found]
            assert term.value == pytest.approx(truth, rel=0.15)
            assert term.lower < term.value < term.upper


def test_white_noise_and_ramp():
    names, terms = identified(np.random.default_rng(1).normal(size=4000) + 2e-3 * np.arange(4000))
    assert names == "NR"
    assert terms["R"].value == pytest.approx(2e-3, rel=0.1)


def test_a_minimum_is_no_bias_instability():
    """The curve of white noise and random walk has a flat bottom, and no flicker noise."""
    random = np.random.default_rng(2)
    names, terms = identified(10.0 * random.normal(size=40_000) + random_walk(random, 40_000))
    assert "N" in names
    assert "K" in names
    assert terms["B"].value is None
    assert terms["B"].finding.startswith("not identified")


def test_intervals_of_the_white_noise_cover():
    random = np.random.default_rng(8)
    terms = [identified(random.normal(size=1000))[1]["N"] for _ in range(100)]
    assert all(term.value is not None for term in terms)
    assert sum(term.lower <= 1.0 <= term.upper for term in terms) >= 85


@pytest.mark.parametrize(
    ("make", "symbol"),
    [
        (lambda random, n: random.normal(size=n), "N"),
        (random_walk, "K"),
        (lambda random, n: np.diff(random.normal(size=n + 1)), "Q"),
        (lambda random, n: 100.0 * random.normal(size=n) + np.arange(float(n)), "R"),
    ],
    ids="NKQR",
)
def test_uncertainty_of_a_term_is_its_scatter(make, symbol):
    """All averaging times see the same samples; the interval knows it."""
    random = np.random.default_rng(11)
    found = [identified(make(random, 2000))[1][symbol] for _ in range(30)]
    scatter = np.std([np.log(term.value) for term in found])
    claimed = np.median([np.log(term.upper / term.lower) for term in found]) / (2.0 * 1.96)
    assert 0.75 < claimed / scatter < 1.6


def test_covariance_of_the_allan_variances_is_that_of_many_records():
    random = np.random.default_rng(12)
    curves = [overlapping_allan([random.normal(size=500)]) for _ in range(400)]
    tau, count = np.array(curves[0].tau_s), np.array(curves[0].count)
    found = np.cov(np.array([curve.deviation for curve in curves]).T ** 2)
    expected = _products(tau, count)[1, 1]  # white noise with itself
    scale = np.sqrt(np.outer(np.diagonal(expected), np.diagonal(expected)))
    # 400 records know a covariance to 10 %; long averaging times feel the ends of the record
    np.testing.assert_allclose((found / scale)[:4, :4], (expected / scale)[:4, :4], atol=0.25)


@pytest.mark.parametrize("sizes", [(500,), (250, 250)], ids=["one piece", "two pieces"])
def test_noise_about_a_ramp_moves_the_allan_variance_with_it(sizes):
    """Of (noise + ramp)^2, the product of both is a part that noise alone has not."""
    random, ramp = np.random.default_rng(13), 0.05
    curves = [
        overlapping_allan([random.normal(size=n) + ramp * np.arange(n) for n in sizes])
        for _ in range(300)
    ]
    products = _products(np.array(curves[0].tau_s), np.array(curves[0].count))
    expected = products[1, 1] + ramp**2 * (products[1, 4] + products[4, 1])
    found = np.var(np.array([curve.deviation for curve in curves]) ** 2, axis=0, ddof=1)
    np.testing.assert_allclose(found / np.diagonal(expected), 1.0, atol=0.3)
    assert expected[-1, -1] > 5.0 * products[1, 1][-1, -1]


def test_what_is_not_identified_has_a_limit_that_holds_it():
    """A random walk below the white noise: K sqrt(tau / 3) is nowhere above the curve."""
    generator, hidden, size = np.random.default_rng(17), 2e-3, 1024
    for _ in range(20):
        steps = hidden * generator.normal(size=size)
        allan = overlapping_allan([generator.normal(size=size) + np.cumsum(steps)])
        walk = noise_terms(allan, "g")["K"]
        assert walk.value is None
        assert walk.lower == 0.0
        assert hidden <= walk.upper
        tau, upper = np.array(allan.tau_s), np.array(allan.upper)
        assert walk.upper == pytest.approx((upper * np.sqrt(3.0 / tau)).min())


def test_too_short_a_record_identifies_nothing():
    names, terms = identified(np.random.default_rng(1).normal(size=20))
    assert names == ""
    assert all("at least 4 octaves" in terms[name].finding for name in TERMS)


# -- even series -----------------------------------------------------------------------------------


def launch(time, label="1"):
    time = np.asarray(time, dtype=float)
    return Launch(label, time, np.sin(time))


def test_regular_samples_stay_as_they_are():
    given = launch(np.arange(0.0, 10.0, 0.1))
    series = even_series([given])
    assert series.notes == ()
    assert series.interval == pytest.approx(0.1)
    np.testing.assert_allclose(series.pieces[0], given.output)


def test_a_few_missing_samples_are_filled_in():
    series = even_series([launch(np.delete(np.arange(1000.0), [100, 500, 501]))])
    assert [piece.size for piece in series.pieces] == [1000]
    assert series.pieces[0][100] == pytest.approx((np.sin(99) + np.sin(101)) / 2)
    assert series.notes == ("3 missing samples in short gaps: filled in by a straight line",)


def test_many_missing_samples_cut_the_series():
    series = even_series([launch(np.delete(np.arange(100.0), [20, 40, 60, 80]))])
    assert [piece.size for piece in series.pieces] == [20, 19, 19, 19, 19]
    assert "taken as gaps" in series.notes[0]


def test_a_gap_cuts_the_series():
    series = even_series([launch(np.r_[np.arange(50.0), np.arange(90.0, 120.0)])])
    assert [piece.size for piece in series.pieces] == [50, 30]
    assert series.notes == ("1 gap: the series is cut there",)
    series = even_series([launch(np.r_[np.arange(50.0), 90.0, 91.0])])
    assert series.notes[1].startswith("2 of 52 samples not used, in pieces")


def test_irregular_times_are_taken_as_even():
    time = np.cumsum(np.random.default_rng(1).uniform(0.6, 1.5, 2000))
    series = even_series([Launch("1", time, 2.0 + 0.5 * time)])
    assert series.interval == pytest.approx(np.diff(time).mean())
    assert series.notes == ("irregular times: taken as even, 1.051 s apart as on the average",)
    assert [piece.size for piece in series.pieces] == [2000]
    np.testing.assert_allclose(np.diff(series.pieces[0]), 0.5 * series.interval, rtol=1e-8)


def uniform_steps(random):
    return random.uniform(0.6, 1.4, 2000)


def random_times(random):
    """Steps between times that are random altogether."""
    return random.exponential(1.0, 2000)


@pytest.mark.parametrize("steps", [uniform_steps, random_times])
def test_white_noise_at_irregular_times_is_not_too_large(steps):
    """Means over equal spans, of unlike numbers of samples, made it 2 to 9 % larger."""
    random, inside, ratios = np.random.default_rng(3), 0, []
    for _ in range(60):
        time = np.cumsum(steps(random))
        series = even_series([Launch("1", time, random.normal(size=2000))])
        found = noise_terms(overlapping_allan(series.pieces, series.interval), "g")["N"]
        truth = np.diff(time).mean() ** 0.5
        ratios.append(found.value / truth)
        inside += found.lower <= truth <= found.upper
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.01)
    assert inside >= 51


def test_a_ramp_at_random_times_is_not_bent():
    """As even, but for its slope, it would wander by tens of its steps."""
    random = np.random.default_rng(5)
    time = np.cumsum(random_times(random))
    series = even_series([Launch("1", time, time + random.normal(size=2000))])
    found = overlapping_allan(series.pieces, series.interval)
    assert found.deviation[-1] == pytest.approx(found.tau_s[-1] / 2**0.5, rel=0.003)


def test_gaps_cut_irregular_times():
    random = np.random.default_rng(4)
    pieces = [100.0 * n + np.cumsum(random.uniform(0.2, 2.0, 8)) for n in range(60)]
    pieces.append(np.array([9000.0]))
    time = np.concatenate(pieces)
    series = even_series([Launch("1", time, random.normal(size=time.size))])
    assert [piece.size for piece in series.pieces] == [8] * 60
    assert series.notes[0] == "60 gaps: the series is cut there"
    assert series.notes[2] == "1 of 481 samples not used, in pieces of fewer than three"


def test_a_launch_at_another_interval_is_left_out():
    series = even_series([launch(np.arange(50.0)), launch(np.arange(40.0), "2"),
                          launch(10.0 * np.arange(30.0), "slow")])  # fmt: skip
    assert [piece.size for piece in series.pieces] == [50, 40]
    assert series.notes == ("launch slow: left out, sampled at another interval",)
