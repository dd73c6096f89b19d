"""The calibration as a value: frozen, complete, and the same after a trip through JSON."""

import copy
import dataclasses
import io
import json
import math
import pickle
import random
import re
from functools import partial
from pathlib import Path
from typing import get_overloads

import numpy as np
import pytest

import accelcal
from accelcal import Calibration, DesignError, DocumentError, InputError
from accelcal.frozen_mapping import FrozenMapping
from accelcal.geometry import MOUNTINGS
from accelcal.model import coefficient_unit
from accelcal.results.discovery import Discovery
from accelcal.results.documents.stored import all_from_json, all_to_json
from accelcal.results.findings import FoundEffect
from accelcal.results.quantity import ErrorSource, Gate, Quantity, Residuals
from accelcal.results.table import TableCalibration
from accelcal.results.temperature import TemperatureLaw, TemperatureModel
from accelcal.results.verdict import OUTCOMES, Judgement, Verdict

GOLDEN = Path(__file__).parent / "golden" / "calibration-1.json"
COEFFICIENTS = {"K0": 0, "K1": 1, "K2": 2, "K3": 3, "M": 1, "M_ip": 2}
ERRORS = {"k0": "g", "k2": "g/g^2", "k3": "g/g^3", "delta": "rad", "delta_ip": "g/g^2"}
LEAF = {"value", "standard_uncertainty", "unit"}
PARTS = ("at_T0", "above", "below")


def table(levels=(20.0, 70.0, -40.0), strokes=2, positions=8, header="# unit: mA", seed=1):
    rng = random.Random(seed)
    lines = [f"# positions: {positions}", header, "run,temperature,position,stroke,output"]
    for run, level in enumerate(levels, start=1):
        for k in range(1, strokes + 1):
            for j in range(1, positions + 2):
                th = 2.0 * math.pi * (j - 1) / positions + rng.gauss(0.0, 1e-6)
                y = 3.3e-3 - 4e-5 * (level - 20.0) + math.cos(th) + 1.15e-3 * math.sin(th)
                y += 1e-4 * math.cos(th) ** 2 + rng.gauss(0.0, 5e-6)
                lines.append(f"{run},{level},{j},{k},{1.35 * y:.7f}")
    return "\n".join(lines) + "\n"


def fitted(text=None, **options):
    return accelcal.fit(accelcal.read_table(io.StringIO(text or table())), **options)


@pytest.fixture(scope="module")
def calibration():
    return fitted()


@pytest.fixture(scope="module")
def document(calibration):
    return json.loads(calibration.to_json())


# -- the contract ----------------------------------------------------------------------------------


def test_keys_of_the_document(document):
    fixed = {
        "schema": "accelcal/calibration/1",
        "method": "least-squares",
        "acceleration_unit": "g_local",
        "g_local_m_s2": None,
        "output_unit": "mA",
        "serial": None,
        "T0_degC": 20.0,
        "effects": [],
    }
    assert {key: document[key] for key in fixed} == fixed
    assert isinstance(document["warnings"], list)


def test_keys_of_a_table(document):
    assert [t["run"] for t in document["tables"]] == ["1", "2", "3"]
    assert [t["temperature_degC"] for t in document["tables"]] == [20.0, 70.0, -40.0]
    for part in document["tables"]:
        assert (part["readings"], part["dof"]) == (18, 12)
        assert 3e-6 < part["residual_rms"] / 1.35 < 8e-6
        assert list(part["coefficients"]) == list(COEFFICIENTS)
        assert list(part["error_model"]) == list(ERRORS)
        for name, power in COEFFICIENTS.items():
            suffix = {0: "", 1: "/g"}.get(power, f"/g^{power}")
            assert part["coefficients"][name]["unit"] == f"mA{suffix}"
        assert {name: part["error_model"][name]["unit"] for name in ERRORS} == ERRORS
        assert part["covariance"]["names"] == list(COEFFICIENTS)
        assert np.array(part["covariance"]["matrix"]).shape == (6, 6)
        assert isinstance(part["warnings"], list)


def leaves(node):
    """All quantities of a document."""
    if isinstance(node, dict):
        if node.keys() >= LEAF:
            yield node
        for part in node.values():
            yield from leaves(part)
    elif isinstance(node, list):
        for part in node:
            yield from leaves(part)


def test_leaves(document):
    found = list(leaves(document))
    assert len(found) >= 3 * 11
    for leaf in found:
        assert isinstance(leaf["unit"], str)
        assert isinstance(leaf["value"], float)
        assert leaf["standard_uncertainty"] > 0.0
        assert leaf["expanded_uncertainty"] > 1.9 * leaf["standard_uncertainty"]


def test_temperature_model(document):
    model = document["temperature_model"]
    units = {"k0": ("g", "g/degC"), "K1": ("mA/g", "1/degC"), "delta": ("rad", "rad/degC")}
    for name, (unit, slope) in units.items():
        assert model[name]["at_T0"]["unit"] == unit
        assert model[name]["above"]["unit"] == model[name]["below"]["unit"] == slope
    assert model["k0"]["above"]["value"] == pytest.approx(-4e-5, abs=1e-6)
    assert model["hysteresis"] is None


def test_uncertainties_are_those_of_the_covariance(document):
    for part in document["tables"]:
        sigma = np.sqrt(np.diag(np.array(part["covariance"]["matrix"])))
        shown = [q["standard_uncertainty"] for q in part["coefficients"].values()]
        assert shown == pytest.approx(sigma.tolist(), rel=1e-12)


def test_error_model_is_the_quotient_with_propagated_uncertainty(calibration):
    """Against a numerical derivative of each quotient by all coefficients."""
    quotients = {"k0": "K0", "k2": "K2", "k3": "K3", "delta": "M", "delta_ip": "M_ip"}
    names = list(COEFFICIENTS)
    for part in calibration.tables:
        k = np.array([part.coefficients[name].value for name in names])

        def quotient(values, name):
            return values[names.index(name)] / values[names.index("K1")]

        for error, name in quotients.items():
            step = 1e-6 * np.eye(6)
            slope = [(quotient(k + s, name) - quotient(k - s, name)) / 2e-6 for s in step]
            variance = np.array(slope) @ part.covariance @ slope
            found = part.error_model[error]
            assert found.value == pytest.approx(quotient(k, name), rel=1e-14)
            assert found.standard_uncertainty == pytest.approx(variance**0.5, rel=1e-6)


def test_budget_adds_up(calibration):
    for part in calibration.tables:
        for name, sources in part.budget.items():
            total = math.sqrt(sum(size**2 for size in sources.values()))
            found = part.coefficients[name].standard_uncertainty
            assert total == pytest.approx(found, rel=1e-9)


def test_correlation(calibration):
    part = calibration.tables[0]
    assert np.diag(part.correlation) == pytest.approx(np.ones(6))
    assert part.correlation[1, 3] < -0.9


def test_correlation_where_the_covariance_is_unknown_or_zero(calibration):
    part = calibration.tables[0]
    unknown = dataclasses.replace(part, covariance_names=(), covariance_matrix=())
    assert unknown.covariance.shape == unknown.correlation.shape == (0, 0)
    matrix = ((0.0, 0.0), (0.0, 1.0))
    exact = dataclasses.replace(part, covariance_names=("K0", "K1"), covariance_matrix=matrix)
    assert np.isnan(exact.correlation[0]).all()
    assert exact.correlation[1, 1] == 1.0


def test_the_covariance_over_its_degrees_of_freedom(calibration):
    """It has the degrees of freedom of each quantity, and the part of each source in all pairs."""
    for part in calibration.tables:
        dof = np.diag(part.covariance) / np.diag(part.over_dof)
        told = [part.coefficients[name].dof for name in part.covariance_names]
        assert dof == pytest.approx(told)
        assert np.linalg.eigvalsh(part.over_dof / np.diag(part.over_dof).max()).min() > -1e-12
    laws = calibration.temperature_model
    dof = np.diag(laws.covariance) / np.diag(laws.over_dof)
    told = {name: quantity.dof for name, quantity in laws.quantities()}
    known = dict(zip(laws.covariance_names, dof.tolist(), strict=True))
    assert {name: known[name] for name in told} == pytest.approx(told)


def test_a_document_without_it_has_the_degrees_of_freedom_of_each_quantity(calibration):
    document = calibration.to_document()
    for part in (*document["tables"], document["temperature_model"]):
        del part["covariance"]["over_dof"]
    found = accelcal.Calibration.from_document(document)
    for part, own in zip(found.tables, calibration.tables, strict=True):
        assert np.diag(part.over_dof) == pytest.approx(np.diag(own.over_dof))
    laws, own = found.temperature_model, calibration.temperature_model
    assert np.diag(laws.over_dof)[:9] == pytest.approx(np.diag(own.over_dof)[:9])
    measured = accelcal.apply(found, [1.0], 20.0, same_launch=True)
    assert np.isfinite(measured.expanded_uncertainty).all()


def test_a_matrix_of_another_size_is_refused(calibration):
    document = calibration.to_document()
    document["tables"][0]["covariance"]["over_dof"].pop()
    with pytest.raises(accelcal.errors.DocumentError, match=r"covariance\.over_dof: rows that are"):
        accelcal.Calibration.from_document(document)
    document["tables"][0]["covariance"]["over_dof"] = [[1.0]]
    with pytest.raises(accelcal.errors.DocumentError, match=r"over_dof: no matrix of the size"):
        accelcal.Calibration.from_document(document)


def test_residuals_are_in_g(calibration):
    """Readings minus (1) with the coefficients of the result, over K1."""
    part = calibration.tables[1]
    record = accelcal.read_table(io.StringIO(table()))
    own = record.output[record.run == 1]
    a = accelcal.accelerations(part.residuals.angle_deg)
    values = {n.replace("M", "M_O") if n == "M" else n: q for n, q in part.coefficients.items()}
    model = accelcal.output({name: q.value for name, q in values.items()}, a)
    scale = part.coefficients["K1"].value
    assert np.array(part.residuals.value) == pytest.approx((own - model) / scale, abs=1e-8)


# -- what is unknown -------------------------------------------------------------------------------


def test_nulls_where_nothing_tells():
    text = (
        "# stroke: 1\n# temperature: unknown\nposition,output\n1,1.354\n3,.006\n5,-1.346\n7,.003\n"
    )
    found = json.loads(fitted(text).to_json())
    part = found["tables"][0]
    assert found["T0_degC"] is found["output_unit"] is found["temperature_model"] is None
    assert part["temperature_degC"] is None
    assert part["coefficients"]["K1"]["value"] == pytest.approx(1.35)
    assert part["coefficients"]["K1"]["standard_uncertainty"] is None
    assert part["coefficients"]["K3"]["value"] is None
    assert part["coefficients"]["K3"]["unit"] == "output unit/g^3"
    assert part["error_model"]["delta_ip"]["value"] is None
    assert part["covariance"] == {"names": [], "matrix": [], "over_dof": []}
    assert (part["dof"], part["residual_rms"]) == (0, 0.0)
    assert part["stands_for"] == {"K1": "K1 + K3"}


def test_degrees_of_freedom_are_null_where_the_noise_does_not_matter():
    found = json.loads(fitted(table(header="# unit: mA\n# head_uncertainty: 0.05")).to_json())
    shown = [leaf["dof"] for leaf in leaves(found)]
    assert None in shown
    assert all(dof is None or dof < 1e6 for dof in shown)


def test_serial_gravity_date_and_angle_are_kept():
    header = "# serial: AL-15\n# g: 9.8106\n# date: 2009-03-01\n# T0: 25\n# unit: V"
    found = json.loads(fitted(table(header=header), delta0=-2e-4).to_json())
    assert (found["serial"], found["g_local_m_s2"], found["date"]) == (
        "AL-15",
        9.8106,
        "2009-03-01",
    )
    assert (found["T0_degC"], found["delta0_rad"], found["output_unit"]) == (25.0, -2e-4, "V")


ALIKE = "head error as large as the noise, and 2 degrees of freedom cannot tell"


def simulated(*, head, positions=8, strokes=6, seed=3):
    """Sentences of a fit of readings with a noise of 5 ug."""
    plan = accelcal.TumblePlan(positions=positions, strokes=strokes, temperatures=(20.0,))
    noise = accelcal.NoiseComponents(reading=5e-6, head=head)
    record = accelcal.simulate(plan=plan, noise=noise, seed=seed)
    return " ".join(accelcal.fit(record.with_apparatus(head_uncertainty=None)).warnings)


@pytest.mark.parametrize("head", [0.0, 5e-6, 2e-4])
def test_a_head_of_one_degree_of_freedom_has_no_honest_interval(head):
    """Seven positions leave one pattern that no coefficient absorbs."""
    said = simulated(head=head, positions=7)
    assert "with 1 degree of freedom: no honest interval can be had" in said
    assert "too wide or too narrow" not in said
    assert "no honest interval" not in simulated(head=head)


def test_a_head_error_as_large_as_the_noise_is_said():
    said = simulated(head=5e-6)
    assert ALIKE in said
    assert "may be too wide or too narrow" in said
    assert ALIKE not in simulated(head=2e-4)
    estimated = simulated(head=2e-4)
    assert "head error estimated from the lack of fit with 2 degrees" in estimated
    assert "accelcal discover looks for" in estimated
    assert "cannot tell" not in simulated(head=5e-6, positions=12)


def test_u_may_lack_a_head_error_where_none_shows():
    """Such intervals were said to hold the truth in 93 to 99 of 100."""
    said = simulated(head=0.0, seed=1)
    assert "no head error shows above the noise, and 2 degrees of freedom cannot tell" in said
    assert "U may lack one as large as the noise" in said
    assert "held the truth" not in said


FEW = "noise and head error come from the same few residuals: no honest interval can be had"


def unrepeated(positions, **apparatus):
    """Sentences of a fit of one stroke that does not return to its first position."""
    angles = tuple(360.0 / positions * j for j in range(positions))
    plan = accelcal.TumblePlan(angles=angles, strokes=1, temperatures=(20.0,))
    record = accelcal.simulate(plan=plan, seed=4)
    undeclared = {"head_uncertainty": None} | apparatus
    return " ".join(accelcal.fit(record.with_apparatus(**undeclared)).warnings)


@pytest.mark.parametrize("mounting", MOUNTINGS)
@pytest.mark.parametrize(("angle", "told"), [(0.02, "delta0 is"), (0.12, "shifted by")])
def test_a_fixture_angle_is_told_with_its_sign(mounting, angle, told):
    """On the sides o- and p- it was told with the wrong one, and K1 got worse by following it."""
    plan = accelcal.TumblePlan(temperatures=(20.0,), mountings=(mounting,), delta0=angle)
    said = " ".join(str(accelcal.fit(accelcal.simulate(plan=plan, seed=1), delta0=0.0)).split())
    found = float(re.search(rf"{told} (\S+)", said)[1])
    found = found if told == "delta0 is" else math.radians(found)
    assert found == pytest.approx(angle, abs=2e-3)  # with the misalignment of the unit in it


def test_a_large_fixture_angle_is_said_with_what_it_takes_off_the_scale_factor():
    """A head of another zero, 2 deg off, made K1 651 ppm too small, with a U of 15 ppm."""
    plan = accelcal.TumblePlan(temperatures=(20.0,), delta0=-0.0349066)
    record = dataclasses.replace(accelcal.simulate(plan=plan, seed=2), metadata={})
    wrong, right = accelcal.fit(record, delta0=0.0), accelcal.fit(record, delta0=-0.0349066)
    k1 = [found.tables[0].coefficients["K1"].value for found in (wrong, right)]
    (said,) = (text for text in wrong.warnings if text.startswith("delta is 36"))
    assert "K1 is 651 ppm too small, and delta0 is -0.0361 rad" in said
    assert 1e6 * (k1[1] / k1[0] - 1.0) == pytest.approx(650.0, abs=2.0)
    assert not any("is the fixture angle or the zero" in text for text in right.warnings)


def test_a_large_misalignment_is_told_of_its_table():
    """No run was named, so that nobody knew which of three it was."""
    record = accelcal.simulate(seed=2, plan=accelcal.TumblePlan(delta0=-0.0349066))
    found = accelcal.fit(dataclasses.replace(record, metadata={}), delta0=0.0)
    largest = max(found.tables, key=lambda table: abs(table.error_model["delta"].value))
    (said,) = (text for text in found.warnings if text.startswith("delta is 36"))
    assert f"mrad in table {found.tables.index(largest) + 1} of 3: if all" in said


@pytest.mark.parametrize("angle", [-0.2, 0.2])
def test_a_misalignment_that_no_unit_has_is_no_fixture_angle_either(angle):
    record = accelcal.simulate(plan=accelcal.TumblePlan(temperatures=(20.0,), delta0=angle), seed=2)
    found = accelcal.fit(record, delta0=0.0)
    assert found.tables[0].error_model["delta"].value == pytest.approx(-angle, rel=0.05)
    assert not any("is the fixture angle or the zero" in text for text in found.warnings)


def test_both_sides_tell_which_fixture_angle_the_tables_lack():
    """It was guessed from M of one side, with the misalignment in it: 0.0362 rad, 654 ppm."""
    plan = accelcal.TumblePlan(temperatures=(20.0,), mountings=("o+", "o-"), delta0=0.0349066)
    record = dataclasses.replace(accelcal.simulate(plan=plan, seed=2), metadata={})
    wrong, right = accelcal.fit(record, delta0=0.0), accelcal.fit(record, delta0=0.034911)
    k1 = [
        np.mean([table.coefficients["K1"].value for table in found.tables])
        for found in (wrong, right)
    ]
    (said,) = (text for text in wrong.warnings if text.startswith("both sides tell"))
    assert "delta0 of 0.034911 rad, and the tables take it as 0 rad" in said
    assert "K1 is 609 ppm too small" in said
    assert 1e6 * (k1[1] / k1[0] - 1.0) == pytest.approx(609.0, abs=3.0)
    silent = " ".join(right.warnings)
    assert "both sides tell" not in silent
    assert "is the fixture angle or the zero" not in silent


def test_one_stroke_that_shows_too_little_is_said():
    assert FEW in unrepeated(8)
    assert "measure two strokes or declare head_uncertainty" in unrepeated(12)
    assert FEW not in unrepeated(24)
    assert FEW not in unrepeated(8, head_uncertainty=6.7e-6)
    assert FEW in simulated(head=2e-5, positions=7, strokes=1)
    assert FEW not in simulated(head=2e-5, strokes=1)
    assert "neither declared nor visible" in simulated(head=2e-5, positions=6, strokes=1)


def test_noise_told_together_with_the_head_has_no_degrees_of_freedom_of_its_own():
    """It holds a part of the head's errors: its chi-squared range held the noise in 27 to 71 %."""
    plan = accelcal.TumblePlan(strokes=1, temperatures=(20.0,))
    record = accelcal.simulate(plan=plan, seed=4)
    together, declared = (
        accelcal.fit(record.with_apparatus(head_uncertainty=head)) for head in (None, 2e-5)
    )
    assert together.error_sources[0].source == declared.error_sources[0].source == "residuals"
    assert together.error_sources[0].dof is None
    assert declared.error_sources[0].dof >= 1.0
    assert "(residuals, together with the head error)" in str(together)
    assert re.search(r"\(residuals, [\d.]+ degrees? of freedom\)", str(declared))


# -- there and back --------------------------------------------------------------------------------


class Parts:
    """Parts of random content: every field, nulls, extremes, odd texts."""

    TEXTS = ("", "AL-15", "µ日本 ☃", '"\\/\n\x00\x1b', "<b>", "null", "\U0001f600", r"\ud83d")

    def __init__(self, rng):
        self.rng = rng

    def number(self):
        gauss, wide = self.rng.gauss(0.0, 1.0), 10.0 ** self.rng.uniform(-300, 40)
        return self.rng.choice([0.0, -1.5, gauss, wide, 5e-324])

    def size(self):
        number = abs(self.number())
        return number if number > 1e-60 else 0.0

    def freedom(self):
        return max(abs(self.number()), 0.1)

    def text(self):
        return self.rng.choice(self.TEXTS)

    def maybe(self, make):
        return None if self.rng.random() < 0.3 else make()

    def several(self, make, least=0):
        return tuple(make() for _ in range(least + self.rng.randrange(3)))

    def quantity(self, unit=None):
        value, (standard, *others) = (
            self.maybe(self.number),
            [self.maybe(make) for make in (self.size, self.size, self.freedom)],
        )
        return Quantity(value, standard, unit or self.text(), *others)

    def coefficients(self):
        units = {name: coefficient_unit(name, self.output_unit) for name in COEFFICIENTS}
        return {name: Quantity(-1.5, self.maybe(self.size), unit) for name, unit in units.items()}

    def gate(self):
        return Gate(self.text(), self.text(), self.text())

    def source(self):
        size, text = self.size, self.text
        return ErrorSource(text(), self.maybe(size), text(), self.maybe(self.freedom), text())

    def law(self, at_T0, slope):
        units = (at_T0, slope, slope)
        return TemperatureLaw(*(self.maybe(partial(self.quantity, unit)) for unit in units))

    def laws(self):
        hysteresis = self.maybe(partial(self.quantity, "g"))
        scale_factor = coefficient_unit("K1", self.output_unit)
        units = (("g", "g/degC"), (scale_factor, "1/degC"), ("rad", "rad/degC"))
        return TemperatureModel(*(self.law(*pair) for pair in units), hysteresis, (self.text(),))

    def judgement(self):
        texts, outcome = [self.text() for _ in range(3)], self.rng.choice(OUTCOMES)
        numbers = (self.maybe(self.number) for _ in range(5))
        return Judgement(*texts, outcome, self.text(), *numbers)

    def verdict(self):
        texts = [self.text() for _ in range(4)]
        return Verdict(*texts, self.several(self.judgement, least=1))

    def effect(self):
        return FoundEffect(
            id=self.text(),
            name=self.text(),
            parameters={"tau": self.quantity()},
            p_value=abs(self.number()),
            gap_before=abs(self.number()),
            gap_after=abs(self.number()),
            heldout_before=self.maybe(self.number),
            heldout_after=self.maybe(self.number),
            indistinguishable=(self.text(),),
            to_tell_apart=self.text(),
        )

    def residuals(self, n):
        made = [tuple(make() for _ in range(n)) for make in (self.number, int, self.number)]
        return Residuals(*made)

    def table(self):
        n, p = self.rng.randrange(4), self.rng.choice([0, 2, 3])
        spread = self.size()
        return TableCalibration(
            run=self.text(),
            mounting="o+",
            temperature_degC=self.maybe(self.number),
            readings=n,
            dof=self.rng.randrange(9),
            residual_rms=self.number(),
            coefficients=self.coefficients(),
            error_model={name: self.quantity(unit) for name, unit in ERRORS.items()},
            covariance_names=tuple(COEFFICIENTS)[:p],
            covariance_matrix=tuple(
                tuple(spread if i == j else -spread / 2.0 for i in range(p)) for j in range(p)
            ),
            budget={"K0": {"head": self.number()}},
            stands_for={"K1": self.text()},
            residuals=self.residuals(n),
            gates=self.several(self.gate),
            warnings=self.several(self.text),
            over_dof_matrix=self.rng.choice([(), ((spread,) * p,) * p]),
        )

    def calibration(self):
        self.output_unit = self.maybe(self.text)
        return Calibration(
            method=self.text(),
            output_unit=self.output_unit,
            tables=self.several(self.table, least=1),
            serial=self.maybe(self.text),
            g_local_m_s2=self.maybe(self.number),
            T0_degC=self.number(),
            delta0_rad=self.number(),
            robust=self.rng.random() < 0.5,
            source=self.text(),
            date=self.maybe(self.text),
            error_sources=self.several(self.source),
            gates=self.several(self.gate),
            warnings=self.several(self.text),
            software=self.text(),
            temperature_model=self.maybe(self.laws),
            verdict=self.maybe(self.verdict),
            effects=self.several(self.effect),
        )


def test_random_calibrations_come_back_equal():
    parts = Parts(random.Random(19))
    for _ in range(300):
        made = parts.calibration()
        text = made.to_json()
        assert Calibration.from_json(text) == made
        assert Calibration.from_json(text).to_json() == text
        assert hash(Calibration.from_json(text)) == hash(made)


def test_several_come_back_in_one_document():
    parts = Parts(random.Random(20))
    several = tuple(parts.calibration() for _ in range(3))
    text = all_to_json(several)
    assert set(json.loads(text)) == {"schema", "calibrations"}
    assert all_from_json(Calibration, text) == several
    assert all_from_json(Calibration, all_to_json(several[:1])) == several[:1]
    assert "calibrations" not in json.loads(all_to_json(several[:1]))


def test_type_checkers_take_a_path_that_may_be_none():
    without, _ = get_overloads(Calibration.to_json)
    assert without.__annotations__ == {"path": "None", "return": "str"}


def test_saved_file_comes_back(calibration, tmp_path):
    path = tmp_path / "al15.json"
    assert calibration.to_json(path) is None
    assert path.read_text("utf-8") == calibration.to_json()
    assert [item.name for item in tmp_path.iterdir()] == ["al15.json"]


@pytest.mark.parametrize("as_given", [str, Path])
def test_what_was_written_to_a_path_is_read_from_it(calibration, tmp_path, as_given):
    path = as_given(tmp_path / "al15.json")
    calibration.to_json(path)
    assert Calibration.from_json(path) == calibration


@pytest.mark.parametrize("read", [Calibration.from_json, Discovery.from_json])
@pytest.mark.parametrize(
    ("content", "said"),
    [(None, "no file that can be read"), ("{", "not JSON"), ("\xff", "not JSON")],
)
def test_a_path_that_cannot_be_read_is_named(tmp_path, read, content, said):
    path = tmp_path / "al15.json"
    if content:
        path.write_bytes(content.encode("latin-1"))
    for given in (path, str(path)):
        with pytest.raises(DocumentError, match=rf"al15\.json: .*{said}") as caught:
            read(given)
        assert "\n" not in str(caught.value)


def test_neither_nan_nor_infinity_is_written(calibration):
    for bad in (math.nan, math.inf):
        with pytest.raises(ValueError, match="JSON compliant"):
            dataclasses.replace(calibration, delta0_rad=bad).to_json()


def test_golden_file_stays_readable():
    """Written by the first version of schema 1; every later version reads the same in it."""
    text = GOLDEN.read_text("utf-8")
    found = Calibration.from_json(text)
    assert found.serial == "AL-15"
    assert found.tables[0].coefficients["K1"].value == 1.3500001234
    assert found.tables[0].error_model["k3"].value is None
    assert found.tables[0].covariance_names == ("K0", "K1")
    assert found.temperature_model.k0.below is None
    assert_within(json.loads(text), found.to_document())
    assert "1.350" in str(found)


def assert_within(old, new):
    """Every key of the old document is in the new one, with the same content."""
    if isinstance(old, dict):
        for key, part in old.items():
            assert_within(part, new[key])
    elif isinstance(old, list):
        assert len(old) == len(new)
        for one, other in zip(old, new, strict=True):
            assert_within(one, other)
    else:
        assert old == new


# -- refused documents -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "not JSON"),
        ("{", "not JSON"),
        ("[" * 100_000, "not JSON"),
        ('{"schema": NaN}', "key schema: nan in place of 'accelcal/cal"),
        ("[]", r"^\[\] in place of an object"),
        ("7", "^7 in place of an object"),
        ('{"schema": "accelcal/calibration/2"}', "key schema: 'accelcal/calibration/2' in"),
        ('{"schema": "accelcal/discovery/1"}', "key schema: 'accelcal/discovery/1' in place of"),
        ('{"K_a": [[1]], "cal_type": "Ferraris"}', "key schema: missing"),
        (json.dumps({"schema": Calibration.SCHEMA}), "key acceleration_unit: missing"),
        (
            json.dumps({"schema": Calibration.SCHEMA, "acceleration_unit": "m/s^2"}),
            "acceleration_unit: 'm/s",
        ),
        (
            json.dumps({"schema": Calibration.SCHEMA, "acceleration_unit": "g_local"}),
            "key method: missing",
        ),
    ],
)
def test_foreign_documents_are_refused(text, said):
    for read in (Calibration.from_json, partial(all_from_json, Calibration)):
        with pytest.raises(DocumentError, match=said) as caught:
            read(text)
        assert "\n" not in str(caught.value)
        assert "accelcal" in str(caught.value) or "g_local" in str(caught.value)


@pytest.mark.parametrize("several", [[], {}, None, 5, "ab"])
def test_calibrations_without_a_list_are_refused(several):
    with pytest.raises(DocumentError, match=r"key calibrations: .* in place of a list of 1"):
        all_from_json(
            Calibration, json.dumps({"schema": Calibration.SCHEMA, "calibrations": several})
        )


def test_every_missing_key_is_refused(document):
    needed = "method g_local_m_s2 output_unit serial T0_degC tables temperature_model warnings"
    for key in needed.split():
        cut = {name: part for name, part in document.items() if name != key}
        with pytest.raises(DocumentError, match=f"key {key}: missing"):
            Calibration.from_document(cut)


def test_every_missing_key_of_a_table_is_refused(document):
    needed = "run temperature_degC readings dof residual_rms coefficients error_model covariance"
    for key in [*needed.split(), "warnings"]:
        cut = copy.deepcopy(document)
        del cut["tables"][0][key]
        with pytest.raises(DocumentError, match=rf"key tables\[0\]\.{key}: missing"):
            Calibration.from_document(cut)


@pytest.mark.parametrize("bad", [None, 5, "ab", [1]])
@pytest.mark.parametrize("key", ["coefficients", "covariance", "residuals", "gates"])
def test_damaged_parts_are_refused(document, key, bad):
    damaged = copy.deepcopy(document)
    damaged["tables"][0][key] = bad
    with pytest.raises(DocumentError, match=rf"key tables\[0\]\.{key}"):
        Calibration.from_document(damaged)


def judged(**changed):
    limit = Judgement("bias", "k0", "at T0", "pass", "mg", None, 5.0, 3.3, 0.1, 1.0).to_document()
    limits = [] if changed.get("limit") == "none" else [limit | changed]
    plain = dict.fromkeys(("specification", "source", "rule", "rule_statement"), "")
    return plain | {"outcome": "pass", "limits": limits}


def test_a_verdict_is_read_back(document):
    found = Calibration.from_document({**document, "verdict": judged()})
    assert found.verdict.outcome == "pass"
    assert "Verdict against" in str(found)
    assert "Verdict against" in found._repr_html_()


@pytest.mark.parametrize(
    "bad", ["pass", {}, judged(limit="none"), judged(outcome="good"), judged(value="3,3")]
)
def test_damaged_verdicts_are_refused(document, bad):
    with pytest.raises(DocumentError, match="key verdict"):
        Calibration.from_document({**document, "verdict": bad})


@pytest.mark.parametrize("bad", ["1,35", True, [1.35], {}])
def test_text_for_a_number_is_refused(document, bad):
    damaged = copy.deepcopy(document)
    damaged["tables"][0]["coefficients"]["K1"]["value"] = bad
    with pytest.raises(DocumentError, match="in place of a number"):
        Calibration.from_document(damaged)


def test_truncated_text_is_refused(calibration):
    text = calibration.to_json().rstrip()
    for end in range(0, len(text), 997):
        with pytest.raises(DocumentError):
            Calibration.from_json(text[:end])


# -- frozen ----------------------------------------------------------------------------------------


def parts_of(item):
    """A dataclass and all dataclasses within it."""
    if dataclasses.is_dataclass(item):
        yield item
        for field in dataclasses.fields(item):
            yield from parts_of(getattr(item, field.name))
    elif isinstance(item, FrozenMapping):
        for value in item.values():
            yield from parts_of(value)
    else:
        assert item is None or isinstance(item, str | float | int | tuple), type(item)
        for value in item if isinstance(item, tuple) else ():
            yield from parts_of(value)


def test_nothing_in_it_can_be_set(calibration):
    parts = list(parts_of(calibration))
    assert len(parts) > 40
    for part in parts:
        for field in dataclasses.fields(part):
            with pytest.raises((dataclasses.FrozenInstanceError, TypeError)):
                setattr(part, field.name, 0)


def test_mappings_cannot_be_edited(calibration):
    with pytest.raises(TypeError):
        calibration.tables[0].coefficients["K1"] = None
    with pytest.raises(TypeError):
        del calibration.tables[0].budget["K1"]["reading"]


def test_the_mapping_given_is_copied():
    given = {"K1": 1.35}
    frozen = FrozenMapping(given)
    given["K1"] = 0.0
    assert frozen == {"K1": 1.35}
    assert hash(frozen) == hash(FrozenMapping({"K1": 1.35}))
    assert repr(frozen) == "{'K1': 1.35}"


def test_copies_and_pickles_are_equal(calibration):
    assert copy.deepcopy(calibration) == calibration
    assert pickle.loads(pickle.dumps(calibration)) == calibration
    assert hash(copy.copy(calibration)) == hash(calibration)


# -- as a frame ------------------------------------------------------------------------------------


def test_frame(calibration):
    frame = calibration.to_frame()
    laws = [f"{name} {part}" for name in ("k0", "K1", "delta") for part in PARTS]
    assert len(frame) == 3 * 11 + len(laws)
    assert frame.coefficient.tolist()[3 * 11 :] == laws
    slope = calibration.rows()[3 * 11 + 4]
    assert slope["value"] == calibration.temperature_model.K1.above.value
    assert (slope["run"], slope["unit"], slope["temperature_degC"]) == (None, "1/degC", 20.0)
    assert {"run", "coefficient", "value", "standard_uncertainty", "unit"} <= set(frame.columns)
    bias = frame[frame.coefficient == "k0"].set_index("run").value
    expected = {part.run: part.error_model["k0"].value for part in calibration.tables}
    assert bias.to_dict() == expected


def test_frame_says_what_a_coefficient_stands_for():
    frame = fitted(table(positions=4)).to_frame().drop_duplicates("coefficient")
    meaning = frame.set_index("coefficient").stands_for
    assert meaning["K1"] == "K1 + K3"
    assert meaning["k0"] == "k0"
    six = "# stroke: 1\n# temperature: 20\nposition,output\n"
    six += "1,1.354\n2,.959\n3,.006\n4,-.949\n5,-1.346\n7,.003\n"
    meaning = fitted(six).to_frame().set_index("coefficient").stands_for
    assert meaning["M_ip"] == "M_ip - 0.707 K3"
    assert meaning["delta_ip"] == "(M_ip - 0.707 K3)/K1"


# -- what fit refuses ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "error", "said"),
    [
        ({"method": "magic"}, InputError, "method 'magic' is unknown; choose from least-squares"),
        (
            {"reference_temperature": math.nan},
            InputError,
            "reference_temperature is nan; it is a finite number",
        ),
        ({"temperature_laws": "magic"}, InputError, "temperature_laws 'magic' is unknown; choose"),
        ({"delta0": math.inf}, InputError, "delta0 is inf"),
        ({"coefficients": ("K0", "K1", "K4")}, DesignError, "coefficient 'K4' is unknown"),
        ({"coefficients": ("K0",)}, DesignError, "K1 is not among the coefficients"),
        ({"coefficients": ()}, DesignError, "K1 is not among the coefficients"),
    ],
)
def test_refused_options(options, error, said):
    with pytest.raises(error, match=said):
        fitted(**options)


@pytest.mark.parametrize(
    ("positions", "options", "said"),
    [
        (4, {"strict": True}, "K3 cannot be told apart from K1"),
        (12, {"method": "closed-form"}, "eight positions"),
        (8, {"robust": True}, "three"),
    ],
)
def test_design_errors_name_the_table(positions, options, said, tmp_path):
    path = tmp_path / "table.csv"
    path.write_text(table(positions=positions, strokes=1))
    with pytest.raises(DesignError, match=said) as caught:
        accelcal.fit(accelcal.read_table(path), **options)
    assert str(caught.value).startswith(f"{path}:4: ")
    assert "; " in str(caught.value)
    assert "\n" not in str(caught.value)


def test_coefficients_in_any_order():
    one = fitted(coefficients=("M", "K1", "K0"))
    assert one == fitted(coefficients=("K0", "K1", "M"))
    assert one.tables[0].coefficients["K2"].value is None


@pytest.mark.parametrize("function", [accelcal.fit, accelcal.batch])
def test_the_misprinted_method_is_warned_of_where_it_is_asked_for(tmp_path, function):
    given = record = accelcal.simulate(seed=1)
    if function is accelcal.batch:
        given = tmp_path / "a.csv"
        accelcal.write_table(record, given)
    with pytest.warns(accelcal.AccelcalWarning, match="misprinted") as told:
        function(given, method="printed")
    assert [warning.filename for warning in told] == [__file__]


def test_what_temperature_laws_lack_is_told():
    """A run without temperature was not named; nor a twin where an accelerometer belongs."""
    record = accelcal.simulate(seed=1)
    unknown = np.where(record.run == 1, np.nan, record.temperature)
    (told,) = (
        warning
        for warning in accelcal.fit(dataclasses.replace(record, temperature=unknown)).warnings
        if warning.startswith("no temperature laws")
    )
    assert "they need the temperature of each run, and" in told
    with pytest.raises(InputError, match=r"or take that of accelcal.twin\(discovery\)"):
        accelcal.simulate(accelcal.twin(accelcal.discover(record)))


def test_the_residuals_of_a_table_are_a_frame():
    record = accelcal.simulate(seed=1)
    table = accelcal.fit(record).tables[0]
    frame = table.residuals.to_frame()
    assert frame.groupby("stroke")["value"].size().tolist() == [9] * 6
    assert frame["value"].tolist() == list(table.residuals.value)
    assert frame.attrs["units"] == {"angle_deg": "deg", "value": "g"}
    assert "<table" in table.residuals._repr_html_()
