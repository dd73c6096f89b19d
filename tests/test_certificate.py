"""Digital calibration certificates: their structure, their numbers, what is not stated.

The structure is that of PTB's DCC 3.3.0 with D-SI 2.2.1. Their schemas are not part of this
project; name a copy by the environment variable DCC_SCHEMA (the path of dcc.xsd, with SI_Format.xsd
where it imports it from) and the certificate is validated against them as well.
"""

import os
import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

import accelcal
from accelcal.certificate.dcc import certificate
from accelcal.certificate.results import product, si_unit
from accelcal.cli.main import main
from accelcal.errors import InputError
from accelcal.io.toml.laboratory import Contact, Laboratory, read_laboratory
from accelcal.io.toml.specification import read_specification
from accelcal.results.findings import FoundEffect
from accelcal.verdict.judge import judge

EXAMPLES = Path(__file__).parents[1] / "examples"
DCC, SI = "{https://ptb.de/dcc}", "{https://ptb.de/si}"

NOT_EMPTY = {  # of the schema's notEmptyStringType: no blank at either end
    *("release", "uniqueIdentifier", "value", "model", "role", "norm", "eMail", "phone"),
    *("city", "postCode", "street"),
}

ORDER = {  # children in the order of the schema; those with ! must be there
    "digitalCalibrationCertificate": ("!administrativeData", "!measurementResults"),
    "administrativeData": (
        *("!dccSoftware", "!coreData", "!items", "!calibrationLaboratory", "!respPersons"),
        *("!customer", "statements"),
    ),
    "dccSoftware": ("!software",),
    "usedSoftware": ("!software",),
    "software": ("!name", "!release"),
    "coreData": (
        *("!countryCodeISO3166_1", "!usedLangCodeISO639_1", "!mandatoryLangCodeISO639_1"),
        *("!uniqueIdentifier", "!beginPerformanceDate", "!endPerformanceDate"),
        "!performanceLocation",
    ),
    "items": ("!item",),
    "item": ("!name", "!manufacturer", "model", "!identifications"),
    "identifications": ("!identification",),
    "identification": ("!issuer", "!value"),
    "calibrationLaboratory": ("!contact",),
    "contact": ("!name", "eMail", "phone", "!location"),
    "customer": ("!name", "eMail", "phone", "!location"),
    "manufacturer": ("!name", "eMail", "phone", "location"),
    "person": ("!name", "eMail", "phone", "location"),
    "location": ("further", "city", "countryCode", "postCode", "street"),
    "further": ("!content",),
    "respPersons": ("!respPerson",),
    "respPerson": ("!person", "role", "mainSigner"),
    "statements": ("!statement",),
    "statement": ("!declaration", "conformity"),
    "declaration": ("!content",),
    "measurementResults": ("!measurementResult",),
    "measurementResult": (
        *("!name", "usedMethods", "usedSoftware", "!influenceConditions", "!results"),
    ),
    "influenceConditions": ("!influenceCondition",),
    "influenceCondition": ("!name", "!data"),
    "usedMethods": ("!usedMethod",),
    "usedMethod": ("!name", "description", "norm"),
    "results": ("!result",),
    "result": ("!name", "!data"),
    "data": ("quantity", "list"),
    "list": ("name", "quantity"),
    "quantity": ("name", "noQuantity", "real", "realListXMLList"),
    "real": ("label", "!value", "!unit", "measurementUncertaintyUnivariate"),
    "realListXMLList": ("!valueXMLList", "!unitXMLList"),
    "measurementUncertaintyUnivariate": ("standardMU", "expandedMU"),
    "standardMU": ("!valueStandardMU",),
    "expandedMU": ("!valueExpandedMU", "!coverageFactor", "!coverageProbability"),
    "name": ("!content",),
    "description": ("!content",),
    "noQuantity": ("!content",),
}


def plain(tag):
    return tag.removeprefix(DCC).removeprefix(SI)


def check_structure(element):
    """Fail where an element, its place or its name is not one of the schema."""
    tag, children = plain(element.tag), [plain(child.tag) for child in element]
    if not children:
        assert (element.text or "").strip(), f"{tag} is empty"
        assert tag not in NOT_EMPTY or element.text.strip() == element.text, f"{tag} has blanks"
        return
    assert children.count("content") < 2, f"{tag} holds several texts in one language"
    order = [name.removeprefix("!") for name in ORDER[tag]]
    places = [order.index(child) for child in children]
    assert places == sorted(places), f"{tag} holds {children}"
    needed = {name[1:] for name in ORDER[tag] if name.startswith("!")}
    assert needed <= set(children), f"{tag} lacks {needed - set(children)}"
    for child in element:
        check_structure(child)


@pytest.fixture(scope="module")
def calibration():
    record = accelcal.read_table(EXAMPLES / "al15.csv", overrides={"local_gravity": 9.8106})
    return accelcal.fit(record)


@pytest.fixture(scope="module")
def laboratory():
    return read_laboratory(str(EXAMPLES / "laboratory.toml"))


@pytest.fixture(scope="module")
def text(calibration, laboratory):
    return certificate(calibration, laboratory)


@pytest.fixture(scope="module")
def root(text):
    return ElementTree.fromstring(text)


def quantities(root):
    """Label -> value, unit and expanded uncertainty of the first result."""
    result = root.find(f".//{DCC}result")
    return {
        real.findtext(f"{SI}label"): (
            float(real.findtext(f"{SI}value")),
            real.findtext(f"{SI}unit"),
            float(real.findtext(f".//{SI}valueExpandedMU")),
        )
        for real in result.iter(f"{SI}real")
        if real.find(f".//{SI}expandedMU") is not None
    }


def test_the_structure_is_that_of_the_schema(root):
    check_structure(root)
    assert root.get("schemaVersion") == "3.3.0"


def test_it_validates_where_the_schema_is_at_hand(text):
    path = os.environ.get("DCC_SCHEMA")
    if not path:
        pytest.skip("not validated here: name a copy of PTB's dcc.xsd by DCC_SCHEMA")
    xmlschema = pytest.importorskip("xmlschema")
    xmlschema.XMLSchema(path).validate(text)


def test_the_numbers_are_those_of_the_calibration(calibration, root):
    found, table, g = quantities(root), calibration.tables[0], 9.8106
    for name, power, unit in (
        ("K1", -1, r"\milli\ampere\metre\tothe{-1}\second\tothe{2}"),
        ("K0", 0, r"\milli\ampere"),
        ("K2", -2, r"\milli\ampere\metre\tothe{-2}\second\tothe{4}"),
    ):
        quantity = table.coefficients[name]
        assert found[name][1] == unit
        assert found[name][0] == pytest.approx(quantity.value * g**power, rel=1e-14)
        assert found[name][2] == pytest.approx(quantity.expanded_uncertainty * g**power, rel=1e-14)
    assert found["k0"][0] == pytest.approx(table.error_model["k0"].value * g, rel=1e-14)
    assert found["delta"][:2] == (table.error_model["delta"].value, r"\radian")


def test_the_covariance_is_that_of_the_calibration(calibration, root):
    table, g = calibration.tables[0], 9.8106
    powers = {"K0": 0, "K1": -1, "K2": -2, "K3": -3, "M": -1, "M_ip": -2}
    result = root.find(f".//{DCC}result")
    told = {}
    for real in result.iter(f"{SI}real"):
        pair = re.fullmatch(r"cov\((\w+),(\w+)\)", real.findtext(f"{SI}label") or "")
        if pair:
            told[pair.groups()] = float(real.findtext(f"{SI}value")), real.findtext(f"{SI}unit")
    names = table.covariance_names
    assert len(told) == len(names) * (len(names) + 1) // 2
    units = quantities(root)
    for (one, other), (value, unit) in told.items():
        wanted = table.covariance_matrix[names.index(one)][names.index(other)]
        assert value == pytest.approx(wanted * g ** (powers[one] + powers[other]), rel=1e-12)
        assert unit == units[one][1] + units[other][1]


def test_a_list_of_numbers_has_one_unit(root):
    """PTB's reader, dccQuantities 3.0.4, gives all numbers of a list the first of its units."""
    lists = list(root.iter(f"{SI}realListXMLList"))
    assert lists
    assert all(len(element.findtext(f"{SI}unitXMLList").split()) == 1 for element in lists)


def test_both_sides_of_an_axis_certify_what_is_free_of_the_fixture_angle(laboratory):
    plan = accelcal.TumblePlan(temperatures=(20.0,), mountings=("o+", "o-"), delta0=1e-3)
    both = replace(accelcal.fit(accelcal.simulate(plan=plan, seed=1)), g_local_m_s2=9.81)
    root = ElementTree.fromstring(certificate(both, laboratory))
    check_structure(root)
    *sides, reversal = root.iter(f"{DCC}result")
    told = {real.findtext(f"{SI}label"): real for real in reversal.iter(f"{SI}real")}
    for label, truth in (("delta0", 1e-3), ("delta_free", 1.15e-3)):  # of the simulation
        wide = float(told[label].findtext(f".//{SI}valueExpandedMU"))
        assert abs(float(told[label].findtext(f"{SI}value")) - truth) < 1.5 * wide < 1e-4
    coupling = float(told["delta_ip"].findtext(f"{SI}value"))  # it was left out
    assert coupling == pytest.approx(9.81**-1 * both.fixture_angle[0].couplings[0].value)
    effective = [
        name
        for side in sides
        for name in side.itertext()
        if name.startswith("effective misalignment delta")
    ]
    assert len(effective) == len(sides) == 2


@pytest.mark.parametrize(("mountings", "label"), [(("o+",), "delta"), (("o+", "o-"), "delta_free")])
@pytest.mark.filterwarnings("ignore::accelcal.AccelcalWarning")
def test_the_mean_of_runs_at_one_level_is_certified(laboratory, mountings, label):
    plan = accelcal.TumblePlan(temperatures=(20.0, 20.0), mountings=mountings)
    found = accelcal.fit(accelcal.simulate(plan=plan, seed=1))
    root = ElementTree.fromstring(certificate(found, laboratory))
    check_structure(root)
    results = {result[0][0].text: result for result in root.iter(f"{DCC}result")}
    told = {r.findtext(f"{SI}label"): r for r in results["mean of runs 1 and 2"].iter(f"{SI}real")}
    delta = accelcal.coefficients_at(found, 20.0)["delta"]
    assert float(told[label].findtext(f"{SI}value")) == pytest.approx(delta.value, rel=1e-12)
    wide = float(told[label].findtext(f".//{SI}valueExpandedMU"))
    assert wide == pytest.approx(delta.expanded_uncertainty, rel=1e-12)


@pytest.mark.parametrize("mountings", [("o+",), ("o+", "p+")])
def test_the_temperature_laws_of_each_axis_are_certified(laboratory, mountings):
    record = accelcal.simulate(plan=accelcal.TumblePlan(mountings=mountings), seed=1)
    found = replace(accelcal.fit(record), g_local_m_s2=9.8106)
    root = ElementTree.fromstring(certificate(found, laboratory))
    check_structure(root)
    laws = [r for r in root.iter(f"{DCC}result") if "temperature laws" in "".join(r[0].itertext())]
    models = [m for m in (found.temperature_model, found.second_axis_model) if m is not None]
    assert len(models) == len(mountings)
    power = {"g": 1, "g/degC": 1, "mA/g": -1}
    for result, model in zip(laws, models, strict=True):
        known = dict(model.quantities())
        for real in result.iter(f"{SI}real"):
            quantity = known.pop(real.findtext(f"{SI}label"))
            in_si = 9.8106 ** power.get(quantity.unit, 0)
            value, wide = (
                float(real.findtext(f".//{SI}{n}")) for n in ("value", "valueExpandedMU")
            )
            assert value == pytest.approx(quantity.value * in_si, rel=1e-12)
            assert wide == pytest.approx(quantity.expanded_uncertainty * in_si, rel=1e-12)
        assert known == {}
        names = [name for name in result.itertext() if "at_T0" in name]
        assert names == ["k0 at_T0", "K1 at_T0", "delta at_T0"]  # labels for programs alone
    told = [name.strip() for name in laws[0].itertext()]
    assert "slope of the bias over scale factor above T0 lam1" in told


def test_administrative_data_come_from_the_file(root):
    told = " ".join(root.itertext())
    for part in ("EX-2026-0042", "Example Laboratory", "Musterstadt", "A. Person", "AL-15"):
        assert part in told
    assert root.findtext(f".//{DCC}beginPerformanceDate") == "2026-11-19"
    assert root.findtext(f".//{DCC}mainSigner") == "true"


def test_what_is_not_stated_is_said(calibration):
    bare = replace(calibration, date="2026-11-20", serial=None)
    root = ElementTree.fromstring(certificate(bare))
    check_structure(root)
    for tag in ("contact", "customer", "person", "manufacturer"):
        assert root.findtext(f".//{DCC}{tag}/{DCC}name/{DCC}content") == "not stated"
    assert root.findtext(f".//{DCC}identification/{DCC}value") == "not stated"
    assert root.findtext(f".//{DCC}countryCodeISO3166_1") == "ZZ"
    assert root.findtext(f".//{DCC}endPerformanceDate") == "2026-11-20"


def declarations(root):
    return [found.text for found in root.iter(f"{DCC}content") if found.text]


def test_what_the_report_tells_of_the_test_is_stated(laboratory):
    record = accelcal.simulate(effects=[accelcal.effect("hysteresis").of(5e-5)], seed=3)
    hidden = accelcal.fit(record)
    stated = declarations(ElementTree.fromstring(certificate(hidden, laboratory)))
    warned = [text for text in stated if text.startswith("A check of the test warns. ")]
    assert any("Run 2, forward against back: mean" in text for text in warned)
    assert len(warned) == str(hidden).count("WARNING: ")
    plan = accelcal.TumblePlan(temperatures=(20.0,), positions=4)
    absorbing = accelcal.fit(accelcal.simulate(plan=plan, seed=1))
    stated = declarations(ElementTree.fromstring(certificate(absorbing, laboratory)))
    assert any("K1 stands for K1 + K3" in text for text in stated)


def test_that_the_gravity_counts_as_exact_is_stated(calibration, laboratory):
    """K1 in mA/(m/s^2) is K1 in mA/g over g: both relative uncertainties add in squares."""
    root = ElementTree.fromstring(certificate(calibration, laboratory).encode())
    (said,) = [text for text in declarations(root) if "local gravity 9.8106 m/s^2" in text]
    assert "Its uncertainty is not in theirs" in said
    bare = certificate(replace(calibration, g_local_m_s2=None), laboratory)
    assert "converted by the local gravity" not in bare


def found(name):
    return FoundEffect(name, name, {}, 0.0, 2e-5, 5e-6, None, None, (), "")


def test_effects_that_the_coefficients_are_free_of_are_stated(calibration, laboratory):
    freed = replace(calibration, effects=(found("warm-up"),))
    root = ElementTree.fromstring(certificate(freed, laboratory).encode())
    assert any(text.startswith("warm-up: the fit took it out") for text in declarations(root))


def test_the_method_names_the_effects_that_it_took_out(calibration, laboratory):
    """Those of the stand too, which the accelerometer does not have in use."""
    taken = (found("backlash"), found("x"))
    for effects, told in (
        (taken, " Effects that it took out of the readings: backlash, x."),
        ((), ""),
    ):
        text = certificate(replace(calibration, effects=effects), laboratory)
        method = ElementTree.fromstring(text).find(f".//{DCC}usedMethod/{DCC}description")
        assert method.findtext(f"{DCC}content") == f"Estimator: least-squares.{told}"


def test_without_local_gravity_values_in_g_are_text(calibration, laboratory):
    root = ElementTree.fromstring(certificate(replace(calibration, g_local_m_s2=None), laboratory))
    check_structure(root)
    found = quantities(root)
    assert "K0" in found
    assert "K1" not in found
    told = [" ".join(e.itertext()) for e in root.iter(f"{DCC}noQuantity")]
    assert any("mA/g" in text and "expanded uncertainty" in text for text in told)


def test_a_run_of_unknown_temperature_is_certified_without_one(calibration, laboratory):
    tables = tuple(replace(table, temperature_degC=None) for table in calibration.tables)
    told = certificate(replace(calibration, tables=tables, temperature_model=None), laboratory)
    check_structure(ElementTree.fromstring(told))
    assert "run 1, mounting o+<" in told


def conditions(root):
    """Name -> values and unit, or what is said in their place."""
    found = {}
    for condition in root.iter(f"{DCC}influenceCondition"):
        _, told = condition.find(f"{DCC}data/{DCC}quantity")
        name = condition.findtext(f"{DCC}name/{DCC}content")
        if plain(told.tag) == "noQuantity":
            found[name] = told.findtext(f"{DCC}content")
        else:
            found[name] = ([float(v) for v in told[0].text.split()], told[1].text)
    return found


def test_the_conditions_of_the_test_are_stated(root, laboratory):
    gravity = ([9.8106], r"\metre\second\tothe{-2}")
    levels = ([20.0, 80.0, -40.0], r"\degreecelsius")
    assert conditions(root) == {"local gravity": gravity, "temperature": levels}
    plan = accelcal.TumblePlan(temperatures=(20.0,), mountings=("o+", "o-"))
    one = certificate(accelcal.fit(accelcal.simulate(plan=plan, seed=1)), laboratory)
    told = {"local gravity": "not stated", "temperature": ([20.0], r"\degreecelsius")}
    assert conditions(ElementTree.fromstring(one)) == told


def test_what_is_no_unit_of_the_si_is_told_in_one_text(laboratory):
    """Texts in one language beside each other are one text to a reader: it takes the first."""
    found = accelcal.fit(accelcal.read_table(EXAMPLES / "al15.csv", overrides={"unit": "counts"}))
    root = ElementTree.fromstring(certificate(found, laboratory))
    check_structure(root)
    k1 = found.tables[0].coefficients["K1"]
    told = [element.findtext(f"{DCC}content") for element in root.iter(f"{DCC}noQuantity")]
    (said,) = {text for text in told if text.startswith(f"{k1.value!r} counts/g;")}
    assert f"expanded uncertainty (95 %) {k1.expanded_uncertainty!r} counts/g" in said


def test_blanks_around_a_text_are_left_out(calibration):
    """The schema has no blank at the ends of a text that is not empty."""
    place = Contact(name=" A ", email=" ", city=" C  D ", street=" ", role=" main signer ")
    known = Laboratory(
        identifier="  ",
        model=" AL ",
        performed_from="2026-11-20",
        laboratory=place,
        customer=place,
        persons=place,
    )
    for serial, stated in ((" ", "not stated"), (" A  15\n", "A  15")):
        text = certificate(replace(calibration, serial=serial, software="accelcal  "), known)
        root = ElementTree.fromstring(text)
        check_structure(root)
        assert root.findtext(f".//{DCC}identification/{DCC}value") == stated
        assert root.findtext(f".//{DCC}city") == "C  D"
        assert root.findtext(f".//{DCC}mainSigner") == "true"
        assert root.find(f".//{DCC}eMail") is None


@pytest.mark.parametrize("outcome", ["pass", "fail", "undecided", "not tested"])
def test_a_verdict_is_told_to_programs_where_it_is_decided(calibration, laboratory, outcome):
    specification = read_specification(str(EXAMPLES / "al15.toml"))
    judged = judge(calibration, specification)
    one = replace(judged.judgements[0], outcome=outcome)
    certified = replace(calibration, verdict=replace(judged, judgements=(one,)))
    root = ElementTree.fromstring(certificate(certified, laboratory))
    check_structure(root)
    wanted = [outcome] if outcome in ("pass", "fail") else []
    assert [element.text for element in root.iter(f"{DCC}conformity")] == wanted
    assert any(f": {outcome}. " in text for text in declarations(root))


def test_a_coverage_factor_has_no_exponent(calibration, laboratory):
    table = calibration.tables[0]
    wide = replace(table.coefficients["K0"], standard_uncertainty=1e-20, expanded_uncertainty=1.0)
    odd = replace(table, coefficients={**table.coefficients, "K0": wide})
    root = ElementTree.fromstring(certificate(replace(calibration, tables=(odd,)), laboratory))
    factors = [element.text for element in root.iter(f"{SI}coverageFactor")]
    assert float(factors[0]) == pytest.approx(1e20)
    assert all(re.fullmatch(r"[1-9]\d*\.?\d*", text) for text in factors)


def test_the_release_is_of_the_form_of_the_ptb(root):
    """Its rules beside the schema (Schematron): a letter, then up to four numbers."""
    releases = [element.text for element in root.iter(f"{DCC}release")]
    assert len(releases) == 2
    assert all(re.fullmatch(r"[a-zA-Z] ?(\d{1,3}\.){0,3}\d{1,3}", text) for text in releases)


def test_the_same_calibration_gives_the_same_text(calibration, laboratory, text):
    assert certificate(calibration, laboratory) == text
    again = accelcal.Calibration.from_json(calibration.to_json())
    assert certificate(again, laboratory) == text


def test_names_are_escaped(calibration):
    known = Laboratory(performed_from="2026-11-20", model="<&>")
    root = ElementTree.fromstring(certificate(replace(calibration, serial="</x>&"), known))
    assert root.findtext(f".//{DCC}model") == "<&>"
    assert root.findtext(f".//{DCC}identification/{DCC}value") == "</x>&"


@pytest.mark.parametrize(
    ("unit", "found"),
    [
        ("V", (r"\volt", 0, 1.0)),
        ("pA", (r"\pico\ampere", 0, 1.0)),
        ("MHz/g", (r"\mega\hertz\metre\tothe{-1}\second\tothe{2}", -1, 1.0)),
        ("uA/g^3", (r"\micro\ampere\metre\tothe{-3}\second\tothe{6}", -3, 1.0)),
        ("g/degC", (r"\metre\second\tothe{-2}\kelvin\tothe{-1}", 1, 1.0)),
        ("g/g^2", (r"\metre\tothe{-1}\second\tothe{2}", -1, 1.0)),
        ("g/g^3", (r"\metre\tothe{-2}\second\tothe{4}", -2, 1.0)),
        ("1", (r"\one", 0, 1.0)),
        ("mg", (r"\metre\second\tothe{-2}", 1, 1e-3)),  # 1 mg = 0.001 g
        ("ug/g", (r"\one", 0, 1e-6)),
        ("m/s^2", (r"\metre\second\tothe{-2}", 0, 1.0)),
        ("m/s^2/g", (r"\one", -1, 1.0)),
        ("m/s^2/g^2/degC", (r"\metre\tothe{-1}\second\tothe{2}\kelvin\tothe{-1}", -2, 1.0)),
        ("output unit/g", None),
        ("counts", None),
    ],
)
def test_units(unit, found):
    assert si_unit(unit) == found


def test_the_unit_one_is_no_factor_of_a_product():
    assert product(r"\one", r"\one") == r"\one"
    assert product(r"\one", r"\volt") == product(r"\volt", r"\one") == r"\volt"
    assert product(r"\volt", r"\volt") == r"\volt\volt"


@pytest.mark.parametrize(
    ("unit", "step"), [("g", 9.8106), ("mg", 9.8106e-3), ("ug", 9.8106e-6), ("m/s^2", 1.0)]
)
def test_outputs_that_are_accelerations_are_in_si_units(laboratory, unit, step):
    """K0 [unit] is K0 * step m/s^2, and K1 [unit per g] a number: K1 * step / g."""
    found = accelcal.fit(
        accelcal.read_table(
            EXAMPLES / "al15.csv", overrides={"unit": unit, "local_gravity": 9.8106}
        )
    )
    root = ElementTree.fromstring(certificate(found, laboratory))
    check_structure(root)
    values, table = quantities(root), found.tables[0]
    for name, per_g, text in (
        ("K0", 0, r"\metre\second\tothe{-2}"),
        ("K1", 1, r"\one"),
        ("K2", 2, r"\metre\tothe{-1}\second\tothe{2}"),
    ):
        quantity, factor = table.coefficients[name], step / 9.8106**per_g
        assert values[name][0] == pytest.approx(quantity.value * factor, rel=1e-14)
        assert values[name][1] == text
        assert values[name][2] == pytest.approx(quantity.expanded_uncertainty * factor, rel=1e-14)
    units = {element.text for element in root.iter(f"{SI}unit")}
    assert r"\one" in units
    assert not any(r"\one" in u for u in units - {r"\one"})


# -- the command -----------------------------------------------------------------------------------


@pytest.fixture
def folder(calibration, tmp_path, monkeypatch):
    calibration.to_json(tmp_path / "cal.json")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_command_writes_it(folder, text):
    lab = str(EXAMPLES / "laboratory.toml")
    assert main(["report", "cal.json", "--dcc", "c.xml", "--dcc-data", lab]) == 0
    assert (folder / "c.xml").read_text("utf-8") == text


def test_a_certificate_without_a_day_is_refused(folder, capsys):
    assert main(["report", "cal.json", "--dcc", "c.xml"]) == 2
    assert "states the days of the test, and here they are not stated; " in capsys.readouterr().err
    assert not (folder / "c.xml").exists()


@pytest.mark.parametrize(
    ("written", "day"),
    [
        ("20.11.2026", "2026-11-20"),
        ("2026/11/20 09:30", "2026-11-20"),
        ("2026-11-20T23:30:00-05:00", "2026-11-20"),  # the day of the laboratory, not that of UTC
    ],
)
def test_the_day_of_a_table_is_read_as_everywhere(calibration, written, day):
    root = ElementTree.fromstring(certificate(replace(calibration, date=written)))
    assert root.findtext(f".//{DCC}beginPerformanceDate") == day


@pytest.mark.parametrize("written", ["2026-13-45", "11/10/2026", "2026-11-20 to 2026-11-22"])
def test_what_is_no_day_is_not_certified(calibration, written):
    with pytest.raises(InputError, match="states the days of the test"):
        certificate(replace(calibration, date=written))


@pytest.mark.parametrize("day", ["2026-11-20", '"20.11.2026"', '"2026-11-20"'])
def test_days_of_the_file_as_toml_or_text(folder, day):
    (folder / "lab.toml").write_text(f'schema = "accelcal/laboratory/1"\nperformed_from = {day}\n')
    assert read_laboratory("lab.toml").performed_from == "2026-11-20"


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Laboratory(country="Germany"), "country is 'Germany'; it is two capital letters"),
        (lambda: Laboratory(model=None), "model is None; it is a text of one line"),
        (lambda: Laboratory(performed_to="soon"), "performed_to is 'soon'; it is a day such as"),
        (lambda: Laboratory(performed_from=None), "performed_from is None; it is a day such as"),
        (lambda: Laboratory(performance_location=["x"]), "it is one of laboratory, "),
        (lambda: Laboratory(customer="Example"), "str in place of a contact; make one by"),
        (lambda: Laboratory(persons=["A. Person"]), "str in place of a contact; make one by"),
        (lambda: Laboratory(statements=[3]), "a statement is 3; it is a text of one line"),
        (lambda: Contact(name=" "), "name is ' '; it is a text of one line"),
        (lambda: Contact(city="a\nb"), "it is a text of one line"),
        (lambda: Contact(country="de"), "country is 'de'; it is two capital letters"),
    ],
)
def test_a_laboratory_in_python_keeps_the_same_rules(make, said):
    with pytest.raises(InputError) as caught:
        make()
    assert said in str(caught.value)


def test_one_person_and_one_statement_need_no_list():
    known = Laboratory(persons=Contact(name="A"), statements="made today")
    assert (known.persons, known.statements) == ((Contact(name="A"),), ("made today",))


HEADED = 'schema = "accelcal/laboratory/1"\n'


@pytest.mark.parametrize(
    ("lab", "said"),
    [
        ("schema = 1", "schema 1 is unknown; write schema ="),
        ("x = [", "lab.toml: not TOML"),
        ("\nx = ]", "lab.toml:2: not TOML"),
        (HEADED + 'lab = "x"', "key 'lab' is unknown"),
        (HEADED + 'customer = "x"', "it is a table such as [customer]"),
        (
            'schema = "accelcal/laboratory/1"\n[customer]\nnam = "x"',
            "customer: key 'nam' is unknown",
        ),
        (
            'schema = "accelcal/laboratory/1"\n[customer]\nname = 3',
            "customer: name is 3; it is a text",
        ),
        (HEADED + 'country = "Germany"', "two capital letters"),
        (HEADED + 'performed_from = "yesterday"', "a day such as"),
        (HEADED + 'statements = "x"', "it is a list, of texts"),
        (HEADED + 'performance_location = "x"', "it is one of lab"),
        (HEADED + 'persons = ["x"]', "it is a table such as"),
    ],
)
def test_a_bad_laboratory_is_one_line(folder, lab, said, capsys):
    (folder / "lab.toml").write_text(lab)
    assert main(["report", "cal.json", "--dcc", "c.xml", "--dcc-data", "lab.toml"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("lab.toml")
    assert said in error
    assert error.count("\n") == 1


def test_the_method_writes_what_the_command_writes(calibration, tmp_path):
    dated, lab = replace(calibration, date="2026-11-20"), EXAMPLES / "laboratory.toml"
    dated.to_json(tmp_path / "cal.json")
    for data in ([], [lab]):
        dated.certificate(tmp_path / "method.xml", *data)
        command = ["report", tmp_path / "cal.json", "--dcc", tmp_path / "command.xml"]
        assert main([str(part) for part in (*command, *(["--dcc-data", lab] if data else []))]) == 0
        assert (tmp_path / "method.xml").read_bytes() == (tmp_path / "command.xml").read_bytes()


@pytest.mark.parametrize(
    ("date", "first", "last"),
    [("2024-05-01", "2026-11-19", "2026-11-20"), ("2026-11-21", "2026-11-19", "")],
)
def test_a_test_of_another_day_is_not_certified(calibration, date, first, last):
    """The days of a file of the laboratory that was left from another test were certified."""
    known = Laboratory(performed_from=first, performed_to=last)
    with pytest.raises(accelcal.InputError, match=f"{date}, which is not within .* {first} to"):
        certificate(replace(calibration, date=date), known)
    assert certificate(replace(calibration, date=first), known)


def test_the_method_writes_nothing_without_a_day(calibration, tmp_path):
    with pytest.raises(accelcal.InputError, match="days of the test"):
        replace(calibration, date=None).certificate(tmp_path / "method.xml")
    assert not list(tmp_path.iterdir())
