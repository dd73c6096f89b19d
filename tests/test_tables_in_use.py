"""Which table or law tells a coefficient: all rooms take the same."""

from dataclasses import replace

import numpy as np
import pytest

import accelcal
from accelcal.compensate.choice import compensation
from accelcal.error_budget.coefficients import coefficients_of
from accelcal.model import CROSS_AXES
from accelcal.planning.prediction import figures
from accelcal.results.quantity import Quantity
from accelcal.results.tables_in_use import nearest_of_mountings, tables_in_use
from accelcal.results.temperature import nearest_level
from accelcal.simulation import NoiseComponents, TumblePlan
from accelcal.stability.record import Launch, StabilityRecord
from accelcal.stability.scale_factor import scale_factor_from
from accelcal.stand_uncertainty.budget import accelerometer_of

pytestmark = pytest.mark.filterwarnings("ignore::accelcal.AccelcalWarning")

NAMES = ("k0", "K1", "k2", "k3", "delta", "delta_ip")


def fitted(mountings=("o+",), temperatures=(20.0, 80.0, -40.0), delta0=0.0, **asked):
    plan = TumblePlan(mountings=mountings, temperatures=temperatures, delta0=delta0)
    return accelcal.fit(accelcal.simulate(plan=plan, seed=3), **asked)


def by_laws(law, rise, relative=False):
    """A bilinear law of an accelerometer or of the error budget at T - T0."""
    slope = law.above if rise > 0.0 else law.below
    slope = getattr(slope, "value", slope)
    at_T0 = getattr(law.at_T0, "value", law.at_T0)
    return at_T0 * (1.0 + slope * rise) if relative else at_T0 + slope * rise


def of_apply(calibration, temperature):
    found = compensation(calibration, same_launch=True, effects=False)
    rise = 0.0 if found.T0_degC is None else temperature - found.T0_degC
    return dict(zip(NAMES, map(float, found.parameters(np.asarray(rise))[0]), strict=True))


def of_coefficients_at(calibration, temperature):
    found = accelcal.coefficients_at(calibration, temperature)
    return {name: found[name].value for name in NAMES}


def of_error_budget(calibration, temperature):
    found = coefficients_of(calibration)
    axis = CROSS_AXES[calibration.main_mounting[0]]
    at_T0 = {n: found.at_T0[n].value for n in ("k0", "K1", "k2", "k3")}
    at_T0["delta"] = found.at_T0[axis.misalignment].value
    at_T0["delta_ip"] = found.at_T0[axis.coupling].value
    if found.reference is None:
        return at_T0
    rise = temperature - found.reference
    change = {n: rise * float(found.slope(n, np.asarray(rise), "value")) for n in found.slopes}
    at_T0["k0"] += change.get("k0", 0.0)
    at_T0["K1"] *= 1.0 + change.get("K1", 0.0)
    at_T0["delta"] += change.get(axis.misalignment, 0.0)
    return at_T0


def of_stand_budget(calibration, temperature):
    found = accelerometer_of(calibration)
    rise = temperature - found.reference_temperature
    return {
        "k0": by_laws(found.bias, rise),
        "K1": by_laws(found.scale_factor, rise, relative=True),
        "k2": found.k2,
        "k3": found.k3,
        "delta": by_laws(found.misalignment, rise),
        "delta_ip": found.cross_coupling,
    }


def of_stability(calibration, temperature):
    time = np.arange(10.0)
    launch = Launch("1", time, time, temperature=np.full(10, temperature))
    return {"K1": scale_factor_from(calibration, StabilityRecord((launch,))).value}


def assert_agreed(calibration, temperature):
    told = of_apply(calibration, temperature)
    for others in (of_coefficients_at, of_error_budget, of_stand_budget, of_stability):
        found = others(calibration, temperature)
        expected = {name: told[name] for name in found}
        assert found == pytest.approx(expected, rel=1e-12, abs=1e-18), others.__name__
    return told


MOUNTINGS = [("o+",), ("o+", "o-"), ("o-", "o+"), ("o+", "p+"), ("p+", "o+", "o-", "p-")]


@pytest.mark.parametrize("temperature", [-40.0, 20.0, 33.0, 80.0])
@pytest.mark.parametrize("mountings", MOUNTINGS)
def test_all_rooms_agree_where_there_are_laws(mountings, temperature):
    """The stand budget took the effective misalignment, and stability the table at 20 degC."""
    assert_agreed(fitted(mountings, delta0=1e-4), temperature)


@pytest.mark.parametrize("levels", [(20.0,), (20.0, 20.4)])
@pytest.mark.parametrize("temperature", [20.0, np.nan])
@pytest.mark.parametrize("mountings", MOUNTINGS)
def test_all_rooms_agree_without_laws(mountings, temperature, levels):
    """Of two runs the stand budget and stability had the nearest one, apply the mean."""
    calibration = fitted(mountings, levels, delta0=1e-4)
    assert calibration.temperature_model is None
    if np.isnan(temperature):
        tables = tuple(replace(table, temperature_degC=None) for table in calibration.tables)
        calibration = replace(calibration, tables=tables, T0_degC=None)
        temperature = 20.0
    assert_agreed(calibration, temperature)


@pytest.mark.parametrize("mountings", MOUNTINGS)
def test_the_figures_of_design_are_of_the_same_tables(mountings):
    calibration = fitted(mountings)
    told, main = assert_agreed(calibration, 20.0), calibration.main_mounting
    found = figures(calibration)
    laws = "" if ("k0 at T0", "") in found else main
    assert found["k0 at T0", laws].value == told["k0"]
    assert found["K1 at T0", laws].value == told["K1"]
    for name in ("k2", "k3", "delta_ip"):
        assert found[name, main].value == told[name]


def test_the_other_mounting_tells_nothing_beside_the_laws():
    """Of a table in p+ that comes first, at T0 too, the stand budget had k2, k3 and delta_ip."""
    calibration = fitted(("o+", "p+"))
    first = next(t for t in calibration.tables if t.mounting == "p+" and t.temperature_degC == 20.0)
    own = tuple(t for t in calibration.tables if t.mounting == "o+")
    told = assert_agreed(replace(calibration, tables=(first, *own)), 20.0)
    assert told["k2"] == own[0].error_model["k2"].value != first.error_model["k2"].value


def test_the_other_side_tells_nothing_beside_the_laws():
    """Both sides of an axis were as one: of the table in o- that comes first, budget had k2."""
    calibration = fitted(("o+", "o-"))
    first = next(t for t in calibration.tables if t.mounting == "o-" and t.temperature_degC == 20.0)
    own = tuple(t for t in calibration.tables if t.mounting == "o+")
    told = assert_agreed(replace(calibration, tables=(first, *own)), 20.0)
    assert told["k2"] == own[0].error_model["k2"].value != first.error_model["k2"].value


def without(table, name):
    none = Quantity(None, None, table.error_model[name].unit)
    return replace(table, error_model={**table.error_model, name: none})


def test_a_term_that_the_nearest_table_does_not_tell_is_that_of_the_next_one():
    """Budgets took k3 as zero, where the laws and apply had it of the table at -40 degC."""
    calibration = fitted(temperatures=(20.0, 90.0, -40.0))
    near, hot, cold = calibration.tables
    told = assert_agreed(replace(calibration, tables=(without(near, "k3"), hot, cold)), 20.0)
    assert told["k3"] == cold.error_model["k3"].value
    assert told["k2"] == near.error_model["k2"].value


def test_a_table_of_unknown_temperature_is_no_table_at_zero():
    """Design took it for one at 0 degC, 20 degC from T0, and not for the farthest."""
    calibration = fitted(temperatures=(60.0, 100.0))
    unknown = replace(calibration.tables[1], temperature_degC=None, run="9")
    tables = (unknown, *calibration.tables)
    found = replace(calibration, tables=tables, temperature_model=None, T0_degC=20.0)
    assert tables_in_use(found).main.temperature_degC == 60.0
    assert figures(found)["k2", "o+"].value == calibration.tables[0].error_model["k2"].value


def test_laws_are_those_of_the_mounting_that_tells_them():
    """Three tables in p+ without M had the name of the laws, which are of two in o+."""
    calibration = fitted(("o+", "p+"))
    none = Quantity(None, None, "mA/g")
    tables = [
        replace(t, coefficients={**t.coefficients, "M": none}) if t.mounting == "p+" else t
        for t in calibration.tables
        if t.mounting == "p+" or t.temperature_degC > 0.0
    ]
    found = replace(calibration, tables=tuple(tables))
    assert (found.main_mounting, found.second_mounting) == ("o+", "p+")
    assert tables_in_use(found).main.mounting == "o+"


def test_of_tables_as_near_the_first_is_taken():
    assert nearest_level([20.0 + 1e-9, 20.0, 20.0 - 1e-9], 20.0) == 0
    calibration = fitted(("o+", "p+"))
    assert list(nearest_of_mountings(calibration.tables, None)) == ["o+", "p+"]


def test_the_main_mounting_is_that_of_most_runs_without_laws_too(tmp_path):
    """Of runs in p+, o+ and o+ the mean was for the axis of the first one, and the page of it."""
    calibration = fitted(("p+", "o+"), (20.0, 20.0))
    (first, *_), own = (
        [t for t in calibration.tables if t.mounting == mounting] for mounting in ("p+", "o+")
    )
    found = replace(calibration, tables=(first, *own))
    told = compensation(found)
    assert (told.cross.name, told.other.name) == ("a_p", "a_o")
    low, high = sorted(table.coefficients["K1"].value for table in own)
    assert low <= told.K1.at_T0 <= high
    assert accelerometer_of(found).scale_factor.at_T0 == told.K1.at_T0
    found.report(tmp_path / "page.md")
    page = (tmp_path / "page.md").read_text(encoding="utf-8")
    assert "by the mean of runs 3 and 4" in page


def test_the_picture_of_the_budget_is_of_the_main_mounting():
    pytest.importorskip("matplotlib")
    calibration = fitted(("o+", "o-"))
    first = next(t for t in calibration.tables if t.mounting == "o-" and t.temperature_degC == 20.0)
    own = tuple(t for t in calibration.tables if t.mounting == "o+")
    found = replace(calibration, tables=(replace(first, run="minus"), *own))
    ax = found.plot.budget()
    titles = [ax.get_title(loc=side) for side in ("left", "center")]
    assert any(title.endswith(f"run {own[0].run}") for title in titles)


@pytest.mark.parametrize("method", ["least-squares", "closed-form"])
def test_noise_of_a_method_averages_out_over_runs(method):
    """By the closed form u of k2 was 12.4 for a scatter of 7.8: noise counted as common to runs."""
    quiet = NoiseComponents(reading=2e-5, head=0.0, launch=0.0, launch_sf=0.0)

    def sizes(runs):
        plan = TumblePlan(temperatures=(20.0,) * runs)
        calibration = accelcal.fit(accelcal.simulate(plan=plan, noise=quiet, seed=1), method=method)
        return np.sqrt(np.diagonal(compensation(calibration).covariance)[:6])

    np.testing.assert_allclose(sizes(4), 0.5 * sizes(1), rtol=0.15)
