"""Uncertainties: against generalised least squares, Monte Carlo, and Student."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from one_record import estimate_of_record
from scipy import stats
from tumble_oracle import (
    AL15,
    UNITY,
    Apparatus,
    forward,
    generalised_least_squares,
    rates,
    record,
    rows,
    turn,
)

from accelcal.calibrate.of_record import table_quantities
from accelcal.estimate.launch import run_shift
from accelcal.estimate.tables import prepare
from accelcal.estimate.uncertainty import (
    Component,
    combined,
    counted,
    interval_stack,
    propagate,
)
from accelcal.model import COEFFICIENTS, ERROR_TERMS
from accelcal.numerics.probability import student_quantile
from accelcal.results.quantity import Quantity

SIGMA = 5e-6
HEAD = 2e-5


# -- generalised least squares ---------------------------------------------------------------------


class Campaign:
    """Runs and mountings of one accelerometer on one head, and all errors of their readings."""

    def __init__(self, angles, where=((0, "o+"),), sigma=None, k=AL15, seed=1):
        self.truth = np.tile(k, len(where))
        self.where = where
        self.angles = [np.asarray(angles, dtype=float)] * len(where)
        rng = np.random.default_rng(seed)
        n = sum(a.size for a in self.angles)
        self.sigma = np.full(n, SIGMA) if sigma is None else rng.uniform(*sigma, n)
        clean = [forward(k, a, 0.0, m) for a, (_, m) in self]
        self.clean = np.concatenate(clean)
        places = np.round(np.mod(np.concatenate(self.angles), 360.0), 6)
        self.same_place = (places[:, None] == np.unique(places)).astype(float)
        self.shifting = self.sensitivity(self.truth)

    def __iter__(self):
        return zip(self.angles, self.where, strict=True)

    @property
    def design(self):
        blocks = [rows(a, 0.0, m) for a, (_, m) in self]
        whole = np.zeros((self.clean.size, 6 * len(blocks)))
        for i, block in enumerate(blocks):
            start = sum(b.shape[0] for b in blocks[:i])
            whole[start : start + block.shape[0], 6 * i : 6 * i + 6] = block
        return whole

    def sensitivity(self, k):
        """What an error of each position of the head does to each reading."""
        slopes = [rates(a, 0.0, m) @ k[6 * i : 6 * i + 6] for i, (a, (_, m)) in enumerate(self)]
        return self.same_place * np.concatenate(slopes)[:, None]

    def textbook(self, y, head):
        """Generalised least squares, of the difference from the truth to keep the digits.

        The sensitivity to the head is that of the weighted fit without it.
        """
        noise = np.diag(self.sigma**2)
        error, _ = generalised_least_squares(self.design, y - self.clean, noise)
        shifting = self.sensitivity(self.truth + error)
        covariance = noise + head**2 * shifting @ shifting.T
        error, spread = generalised_least_squares(self.design, y - self.clean, covariance)
        return self.truth + error, spread

    def outputs(self, rng, head=0.0, launch=0.0, launch_sf=0.0):
        """Readings to first order in the head's errors, with shifts from run to run."""
        errors = self.shifting @ (head * rng.standard_normal(self.shifting.shape[1]))
        runs = np.repeat([run for run, _ in self.where], [a.size for a in self.angles])
        bias, scale = rng.standard_normal((2, runs.max() + 1))
        cosine = np.cos(np.radians(np.concatenate(self.angles)))
        errors += AL15[1] * (launch * bias[runs] + launch_sf * scale[runs] * cosine)
        return self.clean + errors + self.sigma * rng.standard_normal(self.sigma.size)

    def fitted(self, y, **declared):
        whole = record(
            np.concatenate(self.angles),
            y,
            run=np.repeat([run for run, _ in self.where], [a.size for a in self.angles]),
            mounting=np.repeat([m for _, m in self.where], [a.size for a in self.angles]),
            temperature=np.nan,
            std=self.sigma,
        )
        return estimate_of_record([prepare(t) for t in whole.tables()], Apparatus(**declared))


CAMPAIGNS = {
    "8 positions": Campaign(turn(8, 2)),
    "readings missing": Campaign(np.delete(turn(8, 3), [0, 4, 5, 11, 20])),
    "unequal std": Campaign(turn(8, 2), sigma=(2e-6, 4e-5)),
    "24 positions": Campaign(turn(24)),
    "arbitrary angles": Campaign([3.0, 311.7, -50.0, 98.6, 205.0, 77.0, 160.0, 402.0, 250.0]),
    "two runs": Campaign(turn(8), where=((0, "o+"), (1, "o+"))),
    "four mountings": Campaign(turn(8), where=((0, "o+"), (0, "o-"), (1, "p+"), (1, "p-"))),
}
SHARPER = {
    "two mountings": Campaign(turn(8, 2), where=((0, "o+"), (1, "o-")), k=UNITY),
    "both, unequal std": Campaign(
        turn(12), where=((0, "o+"), (1, "p-")), sigma=(2e-6, 4e-5), k=UNITY
    ),
}
"""Mountings differ by more than noise in what the head does to them, if M is no small thing."""


@pytest.mark.parametrize("head", [0.0, 1e-6, 2e-5, 1e-3])
@pytest.mark.parametrize("name", [*CAMPAIGNS, *SHARPER])
def test_prediction_of_the_head_is_generalised_least_squares(name, head):
    """Best linear prediction from the lack of fit is the inverse of the whole covariance."""
    campaign = (CAMPAIGNS | SHARPER)[name]
    rng = np.random.default_rng(2)
    y = campaign.clean + campaign.sigma * np.clip(rng.standard_normal(campaign.sigma.size), -1, 1)
    found = campaign.fitted(y, head_uncertainty=head)
    assert {noise.source for noise in found.noises} == {"declared"}
    expected, spread = campaign.textbook(y, head)
    sigma = np.sqrt(np.diagonal(spread))
    # between runs and mountings of an accelerometer of the real kind, accelcal leaves out contrasts
    # below 1e-4 of the head's action
    left_out = name in ("two runs", "four mountings")
    tolerance = 1e-9 + (3e-4 * head / SIGMA if left_out else 0.0)
    difference = (np.concatenate(found.coefficients) - expected) / sigma
    assert_allclose(difference, 0.0, atol=tolerance)
    total = found.components["reading"].covariance + found.components["head"].covariance
    scaled = (total - spread) / np.outer(sigma, sigma)
    assert_allclose(scaled, 0.0, atol=tolerance)


def test_the_prediction_moves_the_coefficients():
    """What the test above agrees about is not the fit without a head."""
    campaign = CAMPAIGNS["24 positions"]
    y = campaign.outputs(np.random.default_rng(3), head=HEAD)
    plain, declared = (campaign.fitted(y, head_uncertainty=u) for u in (0.0, HEAD))
    assert np.abs(plain.coefficients[0] - declared.coefficients[0]).max() > 1e-6


# -- Monte Carlo -----------------------------------------------------------------------------------

REGIMES = {
    "noise only": ({"head_uncertainty": 0.0}, {}),
    "head": ({"head_uncertainty": HEAD}, {"head": HEAD}),
    "launch": (
        {"head_uncertainty": 0.0, "launch_uncertainty": 3e-5, "launch_sf_uncertainty": 1e-5},
        {"launch": 3e-5, "launch_sf": 1e-5},
    ),
    "all": (
        {"head_uncertainty": HEAD, "launch_uncertainty": 3e-5, "launch_sf_uncertainty": 1e-5},
        {"head": HEAD, "launch": 3e-5, "launch_sf": 1e-5},
    ),
}


@pytest.mark.parametrize(("declared", "present"), REGIMES.values(), ids=REGIMES)
@pytest.mark.parametrize("name", ["8 positions", "two runs", "four mountings"])
def test_covariance_is_that_of_many_tests(name, declared, present):
    """Squared distances from the truth, in the stated covariance, follow chi-square."""
    campaign = CAMPAIGNS[name]
    rng = np.random.default_rng(4)
    tests = 100
    found = [campaign.fitted(campaign.outputs(rng, **present), **declared) for _ in range(tests)]
    errors = np.array([np.concatenate(one.coefficients) for one in found]) - campaign.truth
    covariance = sum(part.covariance for part in found[0].components.values())
    root = np.linalg.cholesky(covariance)
    unit = np.linalg.solve(root, errors.T).T
    p = campaign.truth.size
    low, high = stats.chi2.ppf([1e-5, 1 - 1e-5], tests * p)
    assert low < (unit**2).sum() < high
    # each direction by itself, and none with another
    low, high = stats.chi2.ppf([1e-6, 1 - 1e-6], tests)
    assert np.all((low < (unit**2).sum(axis=0)) & ((unit**2).sum(axis=0) < high))
    correlation = (unit.T @ unit / tests)[np.triu_indices(p, 1)]
    assert np.abs(correlation).max() < 5.5 / math.sqrt(tests)


def test_the_components_add_to_what_they_are():
    """Noise only: the textbook's covariance; no components of errors that are not there."""
    campaign = CAMPAIGNS["8 positions"]
    found = campaign.fitted(campaign.clean, head_uncertainty=0.0)
    design = campaign.design
    expected = SIGMA**2 * np.linalg.inv(design.T @ design)
    assert_allclose(found.components["reading"].covariance, expected, rtol=1e-9, atol=1e-22)
    assert list(found.components) == ["reading", "head"]
    assert not found.components["head"].covariance.any()


def test_one_stroke_of_nine_readings():
    """The figures of the theory, per reading of standard deviation s."""
    covariance = CAMPAIGNS["8 positions"]
    one = Campaign(turn(8)).fitted(Campaign(turn(8)).clean, head_uncertainty=0.0)
    sigma = np.sqrt(np.diagonal(one.components["reading"].covariance)) / SIGMA
    assert_allclose(sigma, [0.61, 1.54, 0.93, 1.86, 0.50, 1.00], atol=0.006)
    correlation = one.components["reading"].covariance / np.outer(sigma, sigma) / SIGMA**2
    assert_allclose([correlation[1, 3], correlation[0, 2]], [-0.95, -0.83], atol=0.02)
    assert covariance.sigma.size == 18


@pytest.mark.parametrize("method", ["closed-form", "sign-corrected"])
def test_closed_forms_know_their_own_noise(method):
    """A closed form keeps what the head does to it; its covariance is that of its own map."""
    angles = turn(8, 2)
    rng = np.random.default_rng(5)
    campaign = CAMPAIGNS["8 positions"]
    apparatus = Apparatus(head_uncertainty=HEAD)

    def fitted(y):
        prepared = prepare(record(angles, y, std=campaign.sigma))
        return estimate_of_record([prepared], apparatus, method=method)

    clean = fitted(campaign.clean)
    names = clean.names[0]
    columns = [("K0", "K1", "K2", "K3", "M", "M_ip").index(name) for name in names]
    errors = np.array(
        [
            (fitted(campaign.outputs(rng, head=HEAD)).coefficients[0] - clean.coefficients[0])
            for _ in range(300)
        ]
    )[:, columns]
    covariance = sum(part.covariance for part in clean.components.values())
    unit = np.linalg.solve(np.linalg.cholesky(covariance), errors.T)
    low, high = stats.chi2.ppf([1e-5, 1 - 1e-5], unit.size)
    assert low < (unit**2).sum() < high


# -- intervals -------------------------------------------------------------------------------------


def component(variance, dof):
    return Component(np.array([[variance]]), np.array([float(dof)]))


def interval(*parts):
    named = {str(i): component(*part) for i, part in enumerate(parts)}
    return interval_stack(named).of_record(0)


@given(st.floats(1e-12, 1e12), st.floats(1.0, 9e5))
def test_one_component_is_student(variance, dof):
    found = interval((variance, dof), (0.0, 1.0), (0.0, math.inf))
    assert found.standard == pytest.approx(math.sqrt(variance), rel=1e-12)
    assert found.factor == pytest.approx(stats.t.ppf(0.975, dof), rel=1e-9)
    assert found.expanded == pytest.approx(found.factor * found.standard, rel=1e-12)
    assert found.dof == pytest.approx(dof, rel=1e-6)


def test_a_trace_of_noise_leaves_no_huge_degrees_of_freedom():
    found = interval((1.0, math.inf), (1e-7, 46.0))
    assert found.dof == math.inf
    assert found.factor == pytest.approx(stats.norm.ppf(0.975), rel=1e-9)


def test_declared_components_are_normal():
    found = interval((3.0, math.inf), (1.0, math.inf))
    assert found.standard == 2.0
    assert found.dof == math.inf
    assert found.factor == pytest.approx(stats.norm.ppf(0.975), rel=1e-10)


@given(
    st.lists(
        st.tuples(st.floats(1e-3, 1e3), st.sampled_from([1.0, 2.0, 6.0, 46.0, math.inf])),
        min_size=2,
        max_size=5,
    )
)
def test_a_mixture_lies_between_its_components(parts):
    found = interval(*parts)
    factors = [student_quantile(0.95, dof) for _, dof in parts]
    assert found.standard == pytest.approx(math.sqrt(sum(v for v, _ in parts)), rel=1e-12)
    assert min(factors) * (1 - 1e-9) <= found.factor <= max(factors) * (1 + 1e-9)
    assert found.factor == pytest.approx(student_quantile(0.95, found.dof), rel=1e-9)
    larger = interval(*((1e-40 * v, dof) for v, dof in parts))
    assert larger.factor == pytest.approx(found.factor, rel=1e-9)


@given(st.floats(0.01, 0.99))
def test_a_mixture_is_no_narrower_than_welch_and_satterthwaite(share):
    """GUM (G.2b) trusts a variance that came out small; the difference is at most 15 %."""
    found = interval((share, 2.0), (1.0 - share, 46.0))
    welch = 1.0 / (share**2 / 2.0 + (1.0 - share) ** 2 / 46.0)
    assert found.factor >= student_quantile(0.95, welch) * (1 - 1e-12)


def test_more_of_the_uncertain_component_widens_the_factor():
    factors = [interval((v, 2.0), (1.0, 46.0)).factor for v in (0.0, 0.1, 1.0, 10.0, 1e6)]
    assert np.all(np.diff(factors) > 0)
    assert factors[0] == pytest.approx(student_quantile(0.95, 46.0), rel=1e-9)
    assert factors[-1] == pytest.approx(student_quantile(0.95, 2.0), rel=1e-4)


def test_an_unknown_component_leaves_no_uncertainty():
    found = interval((math.nan, 0.0), (1.0, math.inf))
    assert np.isnan(found).all()
    told = interval_stack({"0": component(math.nan, 0.0)}).around(np.array([1.0]), ["g"])
    assert told == [Quantity(1.0, None, "g")]


def test_no_error_at_all():
    assert interval((0.0, 5.0)).standard == 0.0
    assert interval((0.0, 5.0)).expanded == 0.0


def test_each_estimate_has_its_own_interval():
    parts = {
        "a": Component(np.diag([1.0, 4.0]), np.array([2.0, math.inf])),
        "b": Component(np.diag([0.0, 5.0]), np.array([3.0, math.inf])),
    }
    found = interval_stack(parts)
    assert found.standard.tolist() == [1.0, 3.0]
    assert found.dof.tolist() == [pytest.approx(2.0), math.inf]


# -- propagation -----------------------------------------------------------------------------------


def test_propagation_to_quotients():
    """k0 = K0 / K1 by the law of propagation, against a million draws' worth of algebra."""
    covariance = np.array([[4.0, -1.5], [-1.5, 1.0]]) * 1e-6
    jacobian = np.array([[1 / 1.3, -0.2 / 1.3**2], [0.0, 1.0]])
    found = propagate({"a": Component(covariance, np.array([2.0, 7.0]))}, jacobian)["a"]
    rng = np.random.default_rng(6)
    draws = rng.multivariate_normal([0.2, 1.3], covariance, size=200_000)
    quotient = draws[:, 0] / draws[:, 1]
    assert found.covariance[0, 0] == pytest.approx(quotient.var(), rel=0.02)
    assert found.covariance[0, 1] == pytest.approx(np.cov(quotient, draws[:, 1])[0, 1], rel=0.03)
    assert found.dof.tolist() == [2.0, 7.0]


def test_part_of_a_component():
    whole = Component(np.arange(16.0).reshape(4, 4), np.arange(4.0))
    part = whole.part(slice(1, 3))
    assert part.covariance.tolist() == [[5.0, 6.0], [9.0, 10.0]]
    assert part.dof.tolist() == [1.0, 2.0]


@pytest.mark.parametrize("dof", [1, 2])
@pytest.mark.parametrize("share", [0.1, 0.3, 0.5, 0.8, 0.9, 0.95])
def test_effective_dof_keep_the_level(share, dof):
    """A source of few degrees of freedom beside a known one, at every share of the variance."""
    rng = np.random.default_rng(11)
    draws = 4000
    error = rng.standard_normal(draws)
    estimated = share * rng.chisquare(dof, draws) / dof
    held = 0
    for e, v in zip(error.reshape(-1, 100), estimated.reshape(-1, 100), strict=True):
        few = Component(np.diag(v), np.full(v.size, counted(dof)))
        known = Component((1.0 - share) * np.eye(v.size), np.full(v.size, np.inf))
        expanded = interval_stack({"few": few, "known": known}).expanded
        held += np.count_nonzero(np.abs(e) <= expanded)
    # 93.8 to 97.2 %, of two 94.2 to 96.3 %, with three standard errors of 0.35 % on either side
    lowest, highest = (0.928, 0.983) if dof == 1 else (0.931, 0.974)
    assert lowest < held / draws < highest


@pytest.mark.parametrize(
    ("new", "least"), [(0.0, 0.927), (1.0, 0.917)], ids=["mean", "next launch"]
)
@pytest.mark.parametrize("runs", [2, 3])
def test_mean_of_few_runs_is_held_where_their_shifts_are_estimated(runs, new, least):
    """Shifts of a few times the noise: what was taken off left too many estimates near zero."""
    rng = np.random.default_rng(3)
    values = 2.0 * rng.standard_normal((8000, runs))  # shifts of sqrt(3), noise of 1
    shift = run_shift(None, values, np.ones_like(values), np.full(runs, 20.0)).alike()
    parts = [shift.of_run[:, 0] ** 2 * (new + 1.0 / runs), np.full(8000, 1.0 / runs)]
    known = combined(parts, [counted(shift.dof_of_run[0]), np.inf])
    error = values.mean(axis=1) + new * np.sqrt(3.0) * rng.standard_normal(8000)
    assert np.mean(np.abs(error) <= known.expanded) > least


# -- many at once ----------------------------------------------------------------------------------


def test_coverage_factors_of_arrays_are_students():
    dof = np.concatenate([[1.0, 1e6, np.inf], np.geomspace(1.0, 1e5, 200)])
    component = Component(np.ones((dof.size, 1, 1)), dof[:, None])
    found = interval_stack({"a": component}).factor[:, 0]
    assert_allclose(found[:-1], [student_quantile(0.95, d) for d in dof[:-1]], rtol=5e-6)
    within = dof < 1e6
    exact = [student_quantile(0.95, d) for d in dof[within]]
    assert_allclose(found[within], exact, rtol=1e-12)


def test_a_stack_of_intervals_is_that_of_each():
    rng = np.random.default_rng(12)
    parts = {
        "a": Component(rng.uniform(0.0, 1.0, (6, 2, 2)), rng.uniform(1.0, 9.0, (6, 2))),
        "b": Component(np.zeros((6, 2, 2)), np.full((6, 2), np.inf)),
    }
    parts["b"].covariance[1] = np.nan  # unknown
    parts["a"].covariance[2] = 0.0  # nothing at all
    stack = interval_stack(parts)
    for i in range(6):
        one = interval_stack({name: part.of_records(i) for name, part in parts.items()})
        for whole, own in zip(stack.of_record(i), one, strict=True):
            assert whole == pytest.approx(own, nan_ok=True)
    unknown = stack.of_record(1).around(np.array([1.0, 2.0]), ["g", "rad"])
    assert unknown == [Quantity(1.0, None, "g"), Quantity(2.0, None, "rad")]
    assert stack.standard[2].tolist() == [0.0, 0.0]


def test_quotients_have_the_uncertainty_of_the_law_of_propagation():
    """By the formula of their variances as by the Jacobian, where tables tell different things."""
    rng = np.random.default_rng(8)
    names = (COEFFICIENTS, ("K0", "K1", "M"))
    roots = rng.standard_normal((2, 5, 9, 9))
    dof = np.repeat([[4.0, 11.0], [np.inf, np.inf]], [6, 3], axis=1)
    parts = zip(roots @ roots.swapaxes(-1, -2), dof, strict=True)
    components = {str(i): Component(c, np.tile(d, (5, 1))) for i, (c, d) in enumerate(parts)}
    values = rng.uniform(1.0, 3.0, (2, 5, 6)) * [[[1.0] * 6], [[1.0, 1.0, 0.0, 0.0, 1.0, 0.0]]]
    found = table_quantities(names, list(values), components, "mA").error_model
    assert_allclose(found.value[:, 1, [0, 3]], values[1][:, [0, 4]] / values[1][:, [1]], rtol=1e-12)
    assert np.isnan(found.value[:, 1, [1, 2, 4]]).all()
    for table, part in enumerate((slice(0, 6), slice(6, 9))):
        k = values[table][:, [COEFFICIENTS.index(name) for name in names[table]]]
        jacobian = np.eye(k.shape[1]) / k[:, 1, None, None]
        jacobian[:, :, 1] -= k / k[:, [1]] ** 2
        own = {name: component.part(part) for name, component in components.items()}
        expected = interval_stack(propagate(own, jacobian))
        kept = [i for i, name in enumerate(names[table]) if name != "K1"]
        told = [list(ERROR_TERMS).index(names[table][i]) for i in kept]
        for one in ("standard", "expanded", "dof"):
            assert_allclose(
                getattr(found, one)[:, table, told], getattr(expected, one)[:, kept], rtol=1e-10
            )
