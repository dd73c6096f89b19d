"""Laws of tables in which K0, K1 and M stand for different things, as at fewer positions."""

import dataclasses

import numpy as np
import pytest

import accelcal
from accelcal.calibrate.options import Options
from accelcal.calibrate.plan import OnePlan
from accelcal.calibrate.stack import calibration_stack
from accelcal.temperature.one_meaning import tables_of_one_mounting, with_one_meaning

NOTHING = accelcal.NoiseComponents(reading=2e-6, head=0.0, launch=0.0, launch_sf=0.0)
BENT = dataclasses.replace(accelcal.AL15, k3=500e-6)  # 1000 U of K1
PARTS = [(law, part) for law in ("k0", "K1", "delta") for part in ("at_T0", "above", "below")]


def whole(seed=1):
    return accelcal.simulate(BENT, noise=NOTHING, seed=seed)


def eight_at_reference(record):
    """Eight positions at T0, four of them at the extremes."""
    return record.select((record.temperature == 20.0) | (record.angle % 90.0 == 0.0))


def four_at_reference(record):
    return record.select((record.temperature != 20.0) | (record.angle % 90.0 == 0.0))


def crossed(record):
    """Four positions on the axes at T0, four between them elsewhere: no run tells K3."""
    return record.select((record.temperature == 20.0) == (record.angle % 90.0 == 0.0))


def said(calibration, what):
    return [sentence for sentence in calibration.warnings if what in sentence]


@pytest.mark.parametrize("fitted", ["tables", "readings"])
@pytest.mark.parametrize("choose", [eight_at_reference, four_at_reference])
def test_laws_are_those_of_all_positions(choose, fitted):
    of_all, of_some = (
        accelcal.fit(record, temperature_laws=fitted).temperature_model
        for record in (whole(), choose(whole()))
    )
    for law, part in PARTS:
        one, other = (getattr(getattr(model, law), part) for model in (of_all, of_some))
        assert one.value == pytest.approx(other.value, abs=2.0 * other.expanded_uncertainty)
        assert other.expanded_uncertainty < 2.5 * one.expanded_uncertainty


def test_the_report_says_what_is_taken_off_and_by_which_run():
    assert said(accelcal.fit(eight_at_reference(whole())), "K1 stands for K1 + K3; for the") == [
        "runs 2, 3: K1 stands for K1 + K3; for the temperature laws, what run 1 told of k3 is taken"
        " off, as the same at all temperatures"
    ]
    (sentence,) = said(accelcal.fit(four_at_reference(whole())), "taken off")
    assert sentence.startswith("run 1: K1 stands for K1 + K3; ")
    assert "what runs 2, 3 told of k3 is taken off" in sentence
    assert not said(accelcal.fit(whole()), "taken off")


def test_the_tables_themselves_stay_as_measured():
    found = accelcal.fit(eight_at_reference(whole()))
    away = found.tables[1]
    assert away.stands_for == {"K1": "K1 + K3"}
    assert away.coefficients["K1"].value > 1.35 * (1.0 + 520e-6 * 60.0 + 400e-6)


def test_runs_between_which_nothing_tells_the_difference_are_left_out():
    found = accelcal.fit(crossed(whole()))
    (sentence,) = said(found, "the temperature laws leave out run ")
    assert "whose K0 stands for K0" in sentence
    assert "measure the same positions at every temperature" in sentence
    assert not said(accelcal.fit(whole()), "leave out")


def test_the_reason_why_nothing_can_be_applied_is_true():
    with pytest.raises(accelcal.InputError, match="its laws have a level on each side of it"):
        accelcal.apply(accelcal.fit(crossed(whole())), np.array([1.0]), temperature=20.0)


@pytest.mark.parametrize("choose", [eight_at_reference, four_at_reference])
def test_what_is_applied_holds_all_positions(choose):
    """At the extremes a_i goes through K1 and k3, which no table there told apart."""
    found = accelcal.fit(choose(whole()))
    at = accelcal.coefficients_at(found, 80.0)
    assert at["k3"].value == pytest.approx(500e-6, abs=5e-6)
    exact = 1.35 * (1.0 + 520e-6 * 60.0)
    assert at["K1"].value == pytest.approx(exact, rel=5e-6)
    names = found.temperature_model.covariance_names
    assert {"k2", "k3", "delta_ip"} <= set(names)
    K1, k3 = names.index("K1 above"), names.index("k3")
    assert found.temperature_model.covariance[K1, k3] != 0.0


def stacked(record):
    return calibration_stack(OnePlan.of([record]), Options())


def test_errors_go_through_what_is_taken_off():
    """The derivatives of the coefficients that are mended, against those of numbers."""
    stack = stacked(eight_at_reference(whole()))
    tables, estimate = stack.tables, stack.estimate
    at = estimate.place(1, "K1")

    def mended(changed):
        found = with_one_meaning(tables, estimate._replace(coefficients=tuple(changed)))
        return found.coefficients[1][0, 1]

    size, columns = estimate.part(len(tables) - 1).stop, []
    for table, names in enumerate(estimate.names):
        for name in names:
            column = ("K0", "K1", "K2", "K3", "M", "M_ip").index(name)
            pair = []
            for step in (1e-4, -1e-4):
                changed = [values.copy() for values in estimate.coefficients]
                changed[table][0, column] += step
                pair.append(mended(changed))
            columns.append((pair[0] - pair[1]) / 2e-4)
    assert len(columns) == size
    found = with_one_meaning(tables, estimate)
    for source, part in found.components.items():
        by_hand = np.array(columns) @ estimate.components[source].covariance[0] @ columns
        assert part.covariance[0, at, at] == pytest.approx(by_hand, rel=1e-6)


def test_nothing_is_copied_where_all_means_the_same():
    stack = stacked(whole())
    assert with_one_meaning(stack.tables, stack.estimate) is stack.estimate
    assert tables_of_one_mounting(stack.tables, stack.estimate) == [0, 1, 2]


def test_batch_has_the_laws_of_fit(tmp_path):
    path = tmp_path / "mixed.csv"
    accelcal.write_table(eight_at_reference(whole()), path)
    rows = accelcal.batch(path).laws
    told = accelcal.fit(accelcal.read_table(path)).temperature_model.quantities()
    values = [quantity.value for _, quantity in told]
    assert len(values) >= 9
    np.testing.assert_allclose(rows["value"], values, rtol=1e-9)
