"""Coefficients level by level: straight lines between the levels, and what U says of them."""

from dataclasses import replace

import numpy as np
import pytest

import accelcal
from accelcal.cli.main import main
from accelcal.compensate.apply import compensate
from accelcal.compensate.choice import compensation
from accelcal.compensate.runs import level_run

ALL = ("k0", "K1", "k2", "k3", "delta", "delta_ip")
SEVEN = (-40.0, -20.0, 0.0, 20.0, 40.0, 60.0, 80.0)
LOOP = (-40.0, -10.0, 20.0, 50.0, 80.0, 50.0, 20.0, -10.0, -40.0)

pytestmark = [
    pytest.mark.filterwarnings("ignore:by levels"),
    pytest.mark.filterwarnings("ignore:checks of the calibration warn"),
]


def fitted(temperatures=(20.0, 80.0, -40.0), seed=1, **plan):
    plan = accelcal.TumblePlan(temperatures=temperatures, **plan)
    return accelcal.fit(accelcal.simulate(plan=plan, seed=seed))


@pytest.fixture(scope="module")
def calibration():
    return fitted()


@pytest.fixture(scope="module")
def seven():
    return fitted(SEVEN)


def interpolated(calibration, name, temperature):
    """By numpy.interp, from the tables alone."""
    tables = sorted(calibration.tables, key=lambda table: table.temperature_degC)
    levels = [table.temperature_degC for table in tables]
    return np.interp(temperature, levels, [table.quantities[name].value for table in tables])


# -- values ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("temperature", [-40.0, -39.9, -10.0, 0.0, 13.7, 20.0, 61.0, 80.0])
@pytest.mark.parametrize("levels", ["calibration", "seven"])
def test_values_are_those_of_interp(levels, temperature, request):
    calibration = request.getfixturevalue(levels)
    found = accelcal.coefficients_at(calibration, temperature, by="levels")
    assert tuple(found) == found.covariance_names == ALL
    for name in ALL:
        expected = interpolated(calibration, name, temperature)
        assert found[name].value == pytest.approx(expected, rel=1e-12)
        assert found[name].unit == calibration.tables[0].quantities[name].unit


def test_at_a_level_it_is_its_table(calibration):
    for table in calibration.tables:
        found = accelcal.coefficients_at(calibration, table.temperature_degC, by="levels")
        for name in ALL:
            own = table.quantities[name]
            assert found[name].value == own.value
            for size in ("standard_uncertainty", "expanded_uncertainty"):
                assert getattr(found[name], size) == pytest.approx(getattr(own, size), rel=1e-3)


def test_order_of_levels_does_not_count(calibration):
    turned = replace(calibration, tables=calibration.tables[::-1])
    for temperature in (-30.0, 35.0):
        one, other = (
            accelcal.coefficients_at(c, temperature, by="levels") for c in (calibration, turned)
        )
        assert [q.value for q in one.values()] == [q.value for q in other.values()]
        assert one.covariance_matrix == other.covariance_matrix


def test_laws_are_the_default(calibration):
    default = accelcal.coefficients_at(calibration, 35.0)
    laws = accelcal.coefficients_at(calibration, 35.0, by="laws")
    assert default == laws
    assert default.covariance_matrix == laws.covariance_matrix
    assert accelcal.apply(calibration, 1.3, 35.0) == accelcal.apply(
        calibration, 1.3, 35.0, by="laws"
    )


def test_levels_beside_t0_are_enough():
    """The laws have no values there."""
    record = replace(
        accelcal.simulate(plan=accelcal.TumblePlan(temperatures=(-40.0, 80.0)), seed=3),
        reference_temperature=20.0,
    )
    calibration = accelcal.fit(record)
    with pytest.raises(accelcal.InputError, match="no coefficients at T0"):
        accelcal.coefficients_at(calibration, 30.0)
    found = accelcal.coefficients_at(calibration, 30.0, by="levels")
    assert found["K1"].value == pytest.approx(interpolated(calibration, "K1", 30.0), rel=1e-12)


# -- uncertainties ---------------------------------------------------------------------------------


@pytest.mark.parametrize("temperature", [-25.0, -10.0, 35.0, 65.0])
def test_errors_that_levels_share_count_as_in_the_laws(calibration, temperature):
    """Laws through three levels are the straight lines, and know all correlations of their tables.

    Less the curvature, which the laws do not count, the uncertainty is theirs; that of the noise
    counted as one error at both levels.
    """
    laws = accelcal.coefficients_at(calibration, temperature)
    table, rise = compensation(calibration, by="levels").table, np.array([temperature - 20.0])
    missed = table.departures(0 if rise[0] < 0.0 else 1, rise)[:, 0]
    alone = table.errors_at(rise[0])[0] - missed.T @ missed
    for place, name in enumerate(ALL):
        if name in ("k0", "K1", "delta"):
            share = np.sqrt(alone[place, place]) / laws[name].standard_uncertainty
            assert share == pytest.approx(1.0, abs=1e-3)


def test_curvature_counts_as_the_levels_show_it(seven):
    """The curve through the neighbours is the parabola itself, so half a parabola's error is u."""
    found = compensation(seven, by="levels")
    rise, bent = found.table.rise, np.zeros_like(found.table.values)
    bent[:, 0] = 1e-7 * rise**2
    errors = np.zeros((2, 7, 6, 6))
    table = found.table._replace(values=bent, common=errors, own=errors)
    for at in (-55.0, -31.0, 10.0, 45.0):
        true = 1e-7 * at**2
        line = table.at(np.array(at))[0]
        u = np.sqrt(table.errors_at(at)[0][0, 0])
        assert u == pytest.approx(abs(true - line), rel=1e-9)


def test_acceleration_carries_the_covariance(seven):
    """Through the derivatives of (2), by matrices of their own."""
    for temperature in (-40.0, -13.0, 20.0, 71.0, 80.9):
        found = accelcal.coefficients_at(seven, temperature, by="levels")
        k0, K1, k2, k3 = (found[name].value for name in ALL[:4])
        for a in (-0.7, 0.3, 1.0):
            seen = k0 + a + k2 * a**2 + k3 * a**3
            steep = 1.0 + 2.0 * k2 * a + 3.0 * k3 * a**2
            jacobian = np.array([1.0, seen / K1, a**2, a**3, 0.0, 0.0]) / steep
            told = accelcal.apply(seven, K1 * seen, temperature, same_launch=True, by="levels")
            assert told.value == pytest.approx(a, rel=1e-12)
            u = np.sqrt(jacobian @ found.covariance @ jacobian)
            assert told.standard_uncertainty == pytest.approx(u, rel=1e-9)


def test_covariance_is_one(seven):
    for temperature in np.linspace(-40.0, 80.0, 25):
        found = accelcal.coefficients_at(seven, float(temperature), by="levels")
        sigma = np.sqrt(np.diagonal(found.covariance))
        assert np.linalg.eigvalsh(found.covariance / np.outer(sigma, sigma)).min() > 0.0


def test_runs_of_a_level_are_averaged_and_lie_within_u():
    hidden = [accelcal.effect("temperature-hysteresis").of(5e-5)]
    record = accelcal.simulate(plan=accelcal.TumblePlan(temperatures=LOOP), effects=hidden, seed=4)
    calibration = accelcal.fit(record)
    assert calibration.temperature_model.hysteresis.value == pytest.approx(5e-5, abs=2e-5)
    h = calibration.temperature_model.hysteresis.value
    for level in (-40.0, -10.0, 20.0, 50.0, 80.0):
        own = [t for t in calibration.tables if t.temperature_degC == level]
        found = accelcal.coefficients_at(calibration, level, by="levels")
        for name in ALL:
            values = [t.quantities[name].value for t in own]
            assert min(values) <= found[name].value <= max(values)
            assert np.ptp(values) / 2.0 <= 1.05 * found[name].standard_uncertainty
        assert found["k0"].standard_uncertainty >= h  # on the branches, at the ends too


@pytest.mark.parametrize("levels", [(20, 20, 80, 80), (20, 20, 20, 80), (20, 20, 20, 80, 80)])
def test_what_repeats_tell_of_launches_is_all_theirs(levels):
    """The rest is of the declared head, whose degrees of freedom do not end."""
    record = accelcal.simulate(plan=accelcal.TumblePlan(temperatures=levels), seed=1)
    record = record.with_apparatus(launch_uncertainty=None, launch_sf_uncertainty=None)
    found = accelcal.fit(record)
    for table in found.tables:
        run = level_run(found, table, found.tables)
        (_, rest), (_, launches) = (np.diagonal(e, 0, 1, 2)[:, :2] for e in (run.common, run.shift))
        assert (np.abs(rest) < 0.01 * launches).all()


def test_temperatures_of_runs_of_a_level_may_differ():
    """What the slope makes of half a degree is no scatter."""
    calibration = fitted((20.0, 80.0, -40.0, 20.0), seed=2)
    *others, last = calibration.tables
    K1, slope = last.coefficients["K1"], 1.35 * 500e-6
    moved = {**last.coefficients, "K1": replace(K1, value=K1.value + 0.5 * slope)}
    last = replace(last, temperature_degC=20.5, coefficients=moved)
    shifted = replace(calibration, tables=(*others, last))
    was = accelcal.coefficients_at(calibration, 20.0, by="levels")["K1"]
    now = accelcal.coefficients_at(shifted, 20.25, by="levels")["K1"]
    assert now.value == pytest.approx(was.value + 0.25 * slope, rel=1e-6)
    assert now.standard_uncertainty < 1.2 * was.standard_uncertainty


def test_no_covariance_is_no_uncertainty(calibration):
    tables = [
        replace(t, covariance_names=(), covariance_matrix=(), over_dof_matrix=())
        for t in calibration.tables
    ]
    bare = replace(calibration, tables=tuple(tables))
    with pytest.warns(accelcal.AccelcalWarning, match="no covariance"):
        found = accelcal.coefficients_at(bare, 35.0, by="levels")
    assert [q.standard_uncertainty for q in found.values()] == [None] * 6
    assert found.covariance.shape == (0, 0)
    with pytest.warns(accelcal.AccelcalWarning, match="no covariance"):
        told = accelcal.apply(bare, [1.3, 0.2], 35.0, by="levels")
    assert np.isfinite(told.value).all()
    assert np.isnan(told.standard_uncertainty).all()


# -- what is said and refused ----------------------------------------------------------------------


def test_what_the_lines_do_not_know_is_said(calibration):
    with pytest.warns(accelcal.AccelcalWarning, match="nothing was measured between the levels"):
        accelcal.coefficients_at(calibration, 35.0, by="levels")
    with pytest.warns(accelcal.AccelcalWarning, match="two levels tell no curvature"):
        accelcal.coefficients_at(fitted((20.0, 80.0)), 35.0, by="levels")


def refused(calibration, temperature=20.0, **how):
    with pytest.raises(accelcal.InputError) as caught:
        accelcal.coefficients_at(calibration, temperature, **{"by": "levels", **how})
    return str(caught.value)


def test_refusals(calibration):
    assert "by 'level' is unknown; choose from laws, levels" in refused(calibration, by="level")
    assert "run=... and by='levels' are both given" in refused(calibration, run=1)
    assert "90 degC is more than 1 degC outside" in refused(calibration, 90.0)
    assert "the calibration has one, 20 degC" in refused(fitted((20.0, 20.0)))
    bare = replace(calibration.tables[1], temperature_degC=None)
    unknown = replace(calibration, tables=(calibration.tables[0], bare))
    assert "that of run 2 is not known" in refused(unknown)


def test_outside_it_is_told_and_wider(calibration):
    with pytest.warns(accelcal.AccelcalWarning, match="90 degC is more than 1 degC outside"):
        far = accelcal.coefficients_at(calibration, 90.0, by="levels", extrapolate=True)
    end = accelcal.coefficients_at(calibration, 80.0, by="levels")
    one, two = (interpolated(calibration, "K1", T) for T in (70.0, 80.0))
    assert far["K1"].value == pytest.approx(2.0 * two - one, rel=1e-9)
    assert far["K1"].standard_uncertainty > end["K1"].standard_uncertainty
    with pytest.raises(accelcal.InputError, match="outside"):
        accelcal.apply(calibration, [1.3], [90.0], by="levels")


def test_levels_with_other_positions_are_refused():
    record = accelcal.simulate(seed=3)
    at_right_angles = np.isclose(record.angle % 90.0, 0.0)
    calibration = accelcal.fit(record.select((record.temperature == 20.0) | at_right_angles))
    assert "do not mean the same as of run 1" in refused(calibration)


def test_a_triad_has_no_levels():
    triad = accelcal.read_triad("examples/triad.csv")
    found = accelcal.calibrate_triad(triad)
    with pytest.raises(accelcal.InputError, match=r"by=\.\.\. is given for a triad"):
        accelcal.apply(found, [[1.0, 0.0, 0.0]], by="levels")


# -- accelerations ---------------------------------------------------------------------------------


def test_apply_undoes_the_model(seven):
    rng = np.random.default_rng(1)
    temperature, a_i, a_p = rng.uniform(-40.0, 80.0, 50), rng.uniform(-1.0, 1.0, 50), 0.2
    k0, K1, k2, k3, delta, delta_ip = (interpolated(seven, name, temperature) for name in ALL)
    seen = k0 + a_i + k2 * a_i**2 + k3 * a_i**3 + delta * a_p + delta_ip * a_i * a_p
    measured = accelcal.apply(seven, K1 * seen, temperature, a_p=a_p, by="levels")
    assert measured.value == pytest.approx(a_i, abs=1e-12)
    assert measured.inside.all()


def test_each_sample_is_by_itself(seven, monkeypatch):
    found, rng = compensation(seven, by="levels"), np.random.default_rng(1)
    output, temperature = rng.uniform(-1.4, 1.4, (3, 50)), rng.uniform(-45.0, 85.0, 50)
    given = {"output_uncertainty": 1e-6, "temperature_uncertainty": 0.1}
    whole = compensate(found, output, temperature, 0.1 * output, **given)
    monkeypatch.setattr("accelcal.compensate.measured.AT_ONCE", 7)
    again = compensate(found, output, temperature, 0.1 * output, **given)
    for name in ("value", "standard_uncertainty", "expanded_uncertainty"):
        assert getattr(again, name) == pytest.approx(getattr(whole, name), rel=1e-12)
    assert compensate(found, 1.35, 20.0, 0.0).value.shape == ()
    assert compensate(found, [], [], []).value.shape == (0,)
    assert np.isnan(compensate(found, [1.0, 1.0], [20.0, np.nan]).value).tolist() == [False, True]


def test_error_of_the_temperature_is_the_slope(seven):
    """By differences of accelerations at temperatures close by."""
    output, temperature, u = 1.2, 33.0, 0.05
    told = [accelcal.apply(seven, output, T, a_p=0.3, by="levels").value for T in (32.99, 33.01)]
    slope = (told[1] - told[0]) / 0.02
    without, with_u = (
        accelcal.apply(
            seven, output, temperature, a_p=0.3, by="levels", temperature_uncertainty=each
        )
        for each in (0.0, u)
    )
    added = with_u.standard_uncertainty**2 - without.standard_uncertainty**2
    assert np.sqrt(added) == pytest.approx(abs(slope) * u, rel=1e-6)


@pytest.mark.parametrize("by", ["laws", "levels"])
def test_both_cross_axes_count(by):
    calibration = fitted(mountings=("o+", "p+"))
    found = compensation(calibration, by=by)
    assert [axis.name for axis in found.axes] == ["a_p", "a_o"]
    measured = accelcal.apply(calibration, 1.3, 35.0, a_p=0.1, a_o=0.2, by=by)
    main = [t for t in calibration.tables if t.mounting == "o+"]
    other = [t for t in calibration.tables if t.mounting == "p+"]
    k0, K1, k2, k3, d_p, ip = (
        interpolated(replace(calibration, tables=tuple(main)), name, 35.0) for name in ALL
    )
    d_o, io = (
        interpolated(replace(calibration, tables=tuple(other)), name, 35.0)
        for name in ("delta", "delta_ip")
    )
    a = measured.value
    seen = k0 + a + k2 * a**2 + k3 * a**3 + (d_p + ip * a) * 0.1 + (d_o + io * a) * 0.2
    assert K1 * seen == pytest.approx(1.3, abs=1e-9 if by == "levels" else 2e-5)


def test_both_cross_axes_are_as_uncertain_as_by_the_laws():
    calibration = fitted(mountings=("o+", "p+"))
    laws, levels = (
        accelcal.apply(calibration, 0.006, 20.0, a_p=[0.0, 0.2, 0.2], a_o=[0.7, 0.0, 0.7], by=by)
        for by in ("laws", "levels")
    )
    assert levels.standard_uncertainty == pytest.approx(laws.standard_uncertainty, rel=1e-6)


def test_second_axis_of_one_level_is_taken_as_constant():
    record = accelcal.simulate(plan=accelcal.TumblePlan(mountings=("o+", "p+")), seed=3)
    some = record.select((record.mounting == "o+") | (record.temperature == 20.0))
    calibration = accelcal.fit(some)
    with pytest.warns(accelcal.AccelcalWarning, match="was measured at 20 degC only"):
        told = accelcal.apply(calibration, 1.3, 35.0, a_p=0.1, a_o=0.2, by="levels")
    assert np.isfinite(told.expanded_uncertainty).all()


def test_second_axis_narrows_the_range():
    record = accelcal.simulate(plan=accelcal.TumblePlan(mountings=("o+", "p+")), seed=3)
    some = record.select((record.mounting == "o+") | (record.temperature >= 20.0))
    assert compensation(accelcal.fit(some), by="levels").temperatures == (20.0, 80.0)


@pytest.mark.parametrize("temperature", [-40.0, 20.0, 80.0])
def test_misalignment_is_free_of_the_angle_where_one_level_tells_it(temperature):
    """Both sides were measured at 20 degC only: elsewhere the laws know the change from there."""
    record = accelcal.simulate(plan=accelcal.TumblePlan(mountings=("o+", "o-")), seed=3)
    some = record.select((record.mounting == "o+") | (record.temperature == 20.0))
    calibration = accelcal.fit(some)
    laws, levels = (
        accelcal.coefficients_at(calibration, temperature, by=by)["delta"]
        for by in ("laws", "levels")
    )
    assert levels.value == pytest.approx(laws.value, abs=laws.expanded_uncertainty)
    assert levels.standard_uncertainty >= 0.99 * laws.standard_uncertainty


@pytest.mark.filterwarnings("ignore:scale-factor-asymmetry")
def test_static_effects_are_taken_up():
    hidden = [accelcal.effect("scale-factor-asymmetry").of(2e-4)]
    record = accelcal.simulate(effects=hidden, seed=3)
    calibration = accelcal.fit(record, model=accelcal.discover(record))
    laws, levels = (
        accelcal.apply(calibration, [1.3, -1.3], [35.0, 50.0], by=by).value
        for by in ("laws", "levels")
    )
    assert levels == pytest.approx(laws, abs=1e-5)
    without = replace(calibration, effects=())
    assert accelcal.apply(without, [1.3, -1.3], [35.0, 50.0], by="levels").value != pytest.approx(
        levels, abs=5e-5
    )


# -- the command -----------------------------------------------------------------------------------


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def run_on(calibration, *options):
        calibration.to_json("cal.json")
        text = "# serial: AL-15\n# unit: mA\noutput,temperature\n1.35,20\n1.2,50\n-1.3,-15\n"
        (tmp_path / "data.csv").write_text(text)
        code = main(["apply", "cal.json", "data.csv", *options])
        told = capsys.readouterr()
        return code, told.out, told.err

    return run_on


def test_command(run, calibration):
    code, out, err = run(calibration, "--by", "levels")
    assert code == 0
    assert "nothing was measured between the levels" in err
    assert out.splitlines()[2].endswith(", by levels")
    told = np.array([row.split(",")[:3] for row in out.splitlines()[-3:]], dtype=float)
    found = accelcal.apply(calibration, [1.35, 1.2, -1.3], [20.0, 50.0, -15.0], by="levels")
    assert told[:, 0] == pytest.approx(found.value, abs=1e-9)
    assert told[:, 1] == pytest.approx(found.standard_uncertainty, rel=5e-3)
    assert run(calibration, "--by", "laws")[1] == run(calibration)[1] != out


@pytest.mark.parametrize(
    ("temperatures", "options", "said"),
    [
        ((20.0, 80.0, -40.0), ("--run", "1"), "both given"),
        ((20.0,), (), "needs levels more than 1 degC apart"),
        ((20.0, 60.0), (), "data.csv:6: temperature -15 degC is more than 1 degC outside"),
    ],
)
def test_command_refuses_in_one_line(run, temperatures, options, said):
    code, out, err = run(fitted(temperatures), "--by", "levels", *options)
    assert (code, out) == (2, "")
    assert said in err.splitlines()[-1]


# -- coverage --------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [0.0, 8e-9, 8e-8])
def test_intervals_hold_a_curved_truth(size):
    """A parabola of the bias, 0, 7 and 72 ug off the chords of the AL-15 between three levels.

    Of 30 units at 4 temperatures times 2 coefficients 95 % are 228. Those of a unit go together, so
    that 190 would be four standard deviations fewer.
    """
    hidden = [accelcal.effect("bias-temperature-quadratic").of(size)] if size else []
    bias, scale = accelcal.AL15.bias, accelcal.AL15.scale_factor
    held = 0
    for seed in range(30):
        calibration = accelcal.fit(accelcal.simulate(effects=hidden, seed=seed))
        for temperature in (-25.0, -10.0, 50.0, 70.0):
            rise = temperature - 20.0
            found = accelcal.coefficients_at(calibration, temperature, by="levels")
            side = "above" if rise > 0.0 else "below"
            truth = {
                "k0": bias.at_T0 + getattr(bias, side) * rise + size * rise**2,
                "K1": scale.at_T0 * (1.0 + getattr(scale, side) * rise),
            }
            held += sum(
                abs(found[n].value - truth[n]) <= found[n].expanded_uncertainty for n in truth
            )
    assert held >= 190


def test_errors_of_temperature_are_new_in_each_run_of_a_level():
    """They counted as common to the runs, and their scatter was added: U was twice as wide."""
    rng, found = np.random.default_rng(3), []
    plan = accelcal.TumblePlan(temperatures=(20.0, 80.0, -40.0) * 3, strokes=2)
    for seed in range(40):
        record = accelcal.simulate(plan=plan, seed=seed)
        wrong = rng.normal(scale=0.2, size=len(record.run_labels))[record.run]
        apparatus = replace(record.apparatus, temperature_uncertainty=0.2)
        record = replace(record, temperature=record.temperature + wrong, apparatus=apparatus)
        record = replace(record, reference_temperature=20.0)
        levels = accelcal.fit(record)
        found.append(accelcal.coefficients_at(levels, 79.0, by="levels", extrapolate=True)["K1"])
    off = np.array([q.value for q in found])
    off -= off.mean()
    wide = np.array([q.expanded_uncertainty for q in found])
    standard = np.mean([q.standard_uncertainty for q in found])
    assert standard < 1.6 * off.std(ddof=1)
    assert np.mean(np.abs(off) <= wide) >= 0.9


@pytest.mark.filterwarnings("ignore:shift from launch to launch estimated")
@pytest.mark.parametrize("temperature", [20.0, 50.0, 80.0])
def test_shifts_of_launches_keep_their_degrees_of_freedom(temperature):
    """Each run has its own shift: their mean is known as well as one, by as many launches."""
    plan = accelcal.TumblePlan(temperatures=(20.0, 80.0) * 3)
    record = accelcal.simulate(plan=plan, seed=3)
    apparatus = replace(record.apparatus, launch_uncertainty=None, launch_sf_uncertainty=None)
    calibration = accelcal.fit(replace(record, apparatus=apparatus))
    (launch,) = [s for s in calibration.error_sources if s.name == "launch"]
    found = accelcal.coefficients_at(calibration, temperature, by="levels")["k0"]
    assert found.dof >= launch.dof
