"""Numbers with their units in header lines and options, converted to those of the library."""

import io
import math
import re

import click
import pytest

import accelcal
from accelcal.cli.main import main
from accelcal.cli.values import duration, quantities, quantity, temperature
from accelcal.errors import TableError
from accelcal.planning.targets import target_value
from accelcal.units import UNITS, size_of, spellings

ARCSEC = math.radians(1.0 / 3600.0)
TABLE = "temperature,position,stroke,output\n20,1,1,1.3\n20,3,1,0.01\n20,5,1,-1.3\n"


def declared(*lines, **overrides):
    text = "".join(f"# {line}\n" for line in lines) + TABLE
    return accelcal.read_table(io.StringIO(text), overrides=overrides)


@pytest.mark.parametrize(
    ("line", "value"),
    [
        ("head_uncertainty: 20 urad", 2e-5),
        ("head_uncertainty: 20 \u00b5g", 2e-5),
        ("head_uncertainty: 5e-3 mrad", 5e-6),
        ("head_uncertainty = 2 arcsec", 2.0 * ARCSEC),
        ("head_uncertainty [arcsec]: 2", 2.0 * ARCSEC),
        ("head_uncertainty: 2 Winkelsekunden", 2.0 * ARCSEC),
        ('head_uncertainty: 2"', 2.0 * ARCSEC),
        ("head_uncertainty: 0.5 угл. сек.", 0.5 * ARCSEC),
        ("head_uncertainty: 0.5'", 30.0 * ARCSEC),
        ("launch_uncertainty: 20 ug", 2e-5),
        ("launch_uncertainty: 0.02 mg", 2e-5),
        ("launch_sf_uncertainty: 15 ppm", 15e-6),
        ("launch_sf_uncertainty: 0.01 %", 1e-4),
        ("temperature_uncertainty: 50 mK", 0.05),
        ("temperature_uncertainty: 0.5 \u00b0C", 0.5),
        ("g: 981062.3 mGal", 9.810623),
        ("g: 9.8106 м/с\u00b2", 9.8106),
    ],
)
def test_a_unit_of_a_header_line(line, value):
    key = line.replace("=", ":").replace("[", ":").split(":")[0].strip()
    name = {"g": "local_gravity"}.get(key, key)
    assert getattr(declared(line).apparatus, name) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("number", ["20", "5", "2.3", "0.1", "1e1"])
def test_powers_of_ten_are_exact(number):
    """20 times 1e-6 are not 2e-05."""
    assert declared(f"launch_uncertainty: {number} ug").apparatus.launch_uncertainty == float(
        f"{float(number)}e-6"
    )


def test_the_fixture_angle_may_be_in_minutes():
    assert float(declared("delta0: -3 arcmin").metadata["delta0"]) == -180.0 * ARCSEC


def test_a_resolution_is_converted_to_the_unit_of_the_outputs():
    assert declared("unit: mA", "resolution: 0.1 uA").apparatus.resolution == 1e-4
    assert declared("resolution: 2 мкВ", unit="mV").apparatus.resolution == 2e-3
    with pytest.raises(TableError, match=r":2: resolution is given in 'uA'; give it in mV"):
        declared("unit: mA", "resolution: 0.1 uA", unit="mV")


@pytest.mark.parametrize("key", ["launch_uncertainty", "head_uncertainty"])
def test_an_acceleration_may_be_in_metres_where_gravity_is_known(key):
    line = f"{key}: 20 mGal"
    expected = pytest.approx(2e-4 / 9.81, rel=1e-15)
    assert getattr(declared(line, "g: 9.81").apparatus, key) == expected
    assert getattr(declared(line, local_gravity=9.81).apparatus, key) == expected
    with pytest.raises(TableError, match="without the local gravity; give it in g, or declare"):
        declared(line)


def test_a_decimal_comma_before_a_unit():
    text = "# head_uncertainty: 0,5 arcsec\n" + TABLE.replace(",", ";").replace(".", ",")
    found = accelcal.read_table(io.StringIO(text)).apparatus.head_uncertainty
    assert found == pytest.approx(0.5 * ARCSEC, rel=1e-15)


@pytest.mark.parametrize("row", ['delta0;0.01"', '# delta0: 0.01"', 'delta0;"0.01"""'])
def test_a_quote_at_the_end_is_the_unit_of_seconds(row):
    """It was taken off, and 0.01" were 0.01 rad."""
    text = f"{row}\n{TABLE.replace(',', ';')}"
    found = accelcal.read_table(io.StringIO(text)).metadata["delta0"]
    assert float(found) == pytest.approx(0.01 * ARCSEC)


@pytest.mark.parametrize("kind", UNITS)
def test_every_way_of_writing_has_its_size(kind):
    for spelling, name in spellings(kind).items():
        assert size_of(spelling, kind) == UNITS[kind][name]
        assert size_of(spelling.capitalize(), kind) in (UNITS[kind][name], None)
    assert size_of("furlong", kind) is None


@pytest.mark.parametrize(("unit", "kind"), [("Mrad", "angle"), ("MG", "acceleration")])
def test_mega_is_not_milli(unit, kind):
    assert size_of(unit, kind) is None
    assert size_of(unit.lower(), kind) == 1e-3


# -- options ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "value"),
    [("2 arcsec", 2.0 * ARCSEC), ('2"', 2.0 * ARCSEC), ("20urad", 2e-5), ("6.7e-6", 6.7e-6)],
)
def test_an_option_with_a_unit(text, value):
    assert quantity("rad", "angle")(text) == pytest.approx(value, rel=1e-15)


def test_options_have_their_own_first_units():
    assert quantity("h", "time")("90 min") == 1.5
    assert quantity("h", "time")("2") == 2.0
    assert duration("0.5 d") == 43200.0
    with pytest.raises(click.BadParameter, match="it is one of V, mV, uV, nV"):
        quantity("V", "voltage")("1 mA")


@pytest.mark.parametrize(
    ("one", "text", "values"),
    [
        (quantity("g", "acceleration"), "-1 g, 500 mg", (-1.0, 0.5)),
        (temperature, "-40 °C,20C", (-40.0, 20.0)),
        (temperature, "233.15 K,68 °F", (-40.0, 20.0)),
        (quantity("deg", "angle"), "0,90,180", (0.0, 90.0, 180.0)),
    ],
)
def test_each_number_of_a_list_may_have_a_unit(one, text, values):
    assert quantities(one)(text) == values


@pytest.mark.parametrize("t0", ["293.15 K", "68°F"])
def test_t0_may_be_in_the_unit_of_the_table(t0, tmp_path, monkeypatch, capsys):
    """It was refused as an option; in a file it was read."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "table.csv").write_text("T [degC]" + TABLE.removeprefix("temperature"))
    assert ": 20 degC" in of_check(capsys, "--t0", t0)[1]
    assert len(accelcal.batch("table.csv", overrides={"reference_temperature": t0})[0]) == 1
    (tmp_path / "table.csv").write_text(TABLE)
    code, told = of_check(capsys, "--t0", t0)
    assert (code, told.endswith(" or T [degC], or give this one in degC\n")) == (2, True)


@pytest.mark.parametrize("text", ["1,500 mg", "0 g,1"])
def test_a_list_with_a_unit_at_some_of_its_numbers_is_refused(text):
    with pytest.raises(click.BadParameter, match="a unit here and none there; write it at each"):
        quantities(quantity("g", "acceleration"))(text)


def test_lists_of_options_have_units(capsys):
    told = []
    for angles, levels in (("0,90,180,270", "20,60"), ("0deg,90deg,180deg,270deg", "20C,60C")):
        assert main(["simulate", "--seed", "1", "--angles", angles, "--temperatures", levels]) == 0
        told.append(capsys.readouterr().out)
    assert told[0] == told[1]


def test_options_of_fit_have_units(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    accelcal.write_table(accelcal.simulate(seed=1), "table.csv")
    options = {
        "--head-uncertainty": ("2 arcsec", repr(2.0 * ARCSEC)),
        "--launch-uncertainty": ("20 ug", "2e-5"),
        "--launch-sf-uncertainty": ("15ppm", "15e-6"),
        "--temperature-uncertainty": ("50 mK", "0.05"),
        "--g": ("980665 mGal", "9.80665"),
        "--t0": ("20 degC", "20"),
        "--delta0": ("1'", repr(60.0 * ARCSEC)),
    }
    told = []
    for i in range(2):
        given = [part for flag, forms in options.items() for part in (flag, forms[i])]
        assert main(["fit", "table.csv", *given]) == 0
        told.append(capsys.readouterr().out)
    assert told[0] == told[1]


def test_an_option_in_another_unit_is_refused(capsys):
    assert main(["fit", "table.csv", "--launch-uncertainty", "2 arcsec"]) == 2
    said = "'2 arcsec' has another unit; it is one of g, mg, ug, ng"
    assert f"invalid value for '--launch-uncertainty': {said}" in capsys.readouterr().err


def of_check(capsys, *arguments):
    code = main(["check", "table.csv", *arguments])
    told = capsys.readouterr()
    return code, re.sub("  +", ": ", told.out) + told.err


def test_a_resolution_of_an_option_is_in_the_unit_of_the_table(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "table.csv").write_text("# unit: mA\n" + TABLE)
    assert "resolution: 0.0001 mA" in of_check(capsys, "--resolution", "0.1 uA")[1]
    assert "resolution: 0.1 uA" in of_check(capsys, "--resolution", "0.1uA", "--unit", "uA")[1]
    code, told = of_check(capsys, "--resolution", "0.1 uV")
    assert (code, told) == (2, "table.csv: resolution is given in 'uV'; give it in mA\n")
    code, told = of_check(capsys, "--resolution", "0.1 furlong")
    assert code == 2
    assert "'0.1 furlong' is in no output unit; it is one of V, mV" in told
    (tmp_path / "table.csv").write_text(TABLE)
    code, told = of_check(capsys, "--resolution", "0.1 uA")
    assert "give it in the output unit, or declare that unit, as in '# unit: mA'" in told


@pytest.mark.parametrize(
    ("flag", "value"), [("--resolution", "-1 uA"), ("--head-uncertainty", "-1 arcsec")]
)
def test_what_is_below_zero_is_told_as_it_is_written(flag, value, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "table.csv").write_text("# unit: mA\n" + TABLE)
    code, told = of_check(capsys, flag, value)
    assert (code, f"{value!r} is below 0; it is 0 or more" in told) == (2, True)
    key = flag[2:].replace("-", "_")
    with pytest.raises(TableError, match=rf":2: {key} is '{value}'; it is a finite number, zero"):
        declared("unit: mA", f"{key}: {value}")
    assert of_check(capsys, flag, "-0 " + value.split()[1])[0] == 0


def test_a_decimal_comma_is_told_beside_a_unit(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "table.csv").write_text("# unit: mA\n" + TABLE)
    told = of_check(capsys, "--resolution", "0,1 uA")[1]
    assert "'0,1 uA' is not a finite number; write a decimal point" in told
    with pytest.raises(TableError, match="'0,1 uA'; give it as a number, with a decimal point"):
        declared("unit: mA", "resolution: 0,1 uA")


def test_an_acceleration_of_an_option_may_be_in_metres(tmp_path, monkeypatch, capsys):
    """It is a multiple of the local gravity, which the table or --g tells."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "table.csv").write_text("# g: 9.81\n" + TABLE)
    for flag, name in (("--launch-uncertainty", "launch"), ("--head-uncertainty", "head")):
        assert f"{name}_uncertainty: 2e-05 " in of_check(capsys, flag, "1.962e-4 m/s²")[1]
        told = of_check(capsys, flag, "1.964e-4 m/s2", "--g", "9.82")[1]
        assert f"{name}_uncertainty: 2e-05 " in told
    (tmp_path / "table.csv").write_text(TABLE)
    code, told = of_check(capsys, "--launch-uncertainty", "20 mGal")
    assert (code, told.count("\n")) == (2, 1)
    assert "without the local gravity; give it in g, or declare '# g: ...', in m/s^2" in told
    assert main(["design", "--noise", "2e-5 m/s^2"]) == 2
    assert "no multiple of the local gravity, which is not known here" in capsys.readouterr().err


def test_a_batch_converts_what_is_declared_by_each_table(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "data").mkdir()
    for seed in (1, 2):
        accelcal.write_table(accelcal.simulate(seed=seed), f"data/{seed}.csv")
    options = {
        "--resolution": ("0.5 uA", "5e-4"),
        "--launch-uncertainty": ("1 mGal", repr(1e-5 / 9.81)),
    }
    for i in range(2):
        given = [part for flag, forms in options.items() for part in (flag, forms[i])]
        assert main(["batch", "data", "-o", f"{i}.csv", "--g", "9.81", *given]) == 0
        capsys.readouterr()
    assert (tmp_path / "0.csv").read_text() == (tmp_path / "1.csv").read_text()
    assert main(["batch", "data", "-o", "x.csv", "--unit", "mV", "--resolution", "0.1 uA"]) == 2
    assert "resolution is given in 'uA'; give it in mV" in capsys.readouterr().err


def test_a_simulated_resolution_may_have_a_unit(capsys):
    told = []
    for step in ("0.1 uA", "1e-4"):
        assert main(["simulate", "--seed", "1", "--resolution", step]) == 0
        told.append(capsys.readouterr().out)
    assert told[0] == told[1]
    assert main(["simulate", "--resolution", "0.1 uV"]) == 2
    assert "outputs are in mA; give it in that unit" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("head_uncertainty", "2 arcsec", 2.0 * ARCSEC),
        ("launch_uncertainty", "20 ug", 2e-5),
        ("launch_sf_uncertainty", "15ppm", 15e-6),
        ("local_gravity", "981 Gal", 9.81),
    ],
)
def test_what_a_caller_declares_may_have_a_unit(name, text, value):
    assert getattr(declared(**{name: text}).apparatus, name) == pytest.approx(value, rel=1e-15)
    with pytest.raises(TableError, match=f"^<table>: {name} is given in 'furlong'; give it in"):
        declared(**{name: "2 furlong"})


def test_targets_take_the_same_units():
    for name, text in (("K1", "5 ppm"), ("M", "5\u00b5rad"), ("K1", "5e-4 %"), ("K2", "5 ug/g^2")):
        assert target_value(name, text) == 5e-6


@pytest.mark.parametrize("key", ["head_uncertainity", "Head uncertanty", "launch_bias_uncertainty"])
def test_a_misspelt_key_is_told(key):
    record = declared(f"{key}: 2e-5")
    (note,) = record.notes
    assert note.startswith(f"header line {key!r} declares nothing: the key may be meant as ")
    assert "launch_uncertainty" in note or "head_uncertainty" in note


@pytest.mark.parametrize("line", ["operator: 2", "head_note: 2 of 3", "resolutions: by eye"])
def test_other_keys_are_metadata_without_a_note(line):
    assert declared(line).notes == ()


@pytest.mark.parametrize("key", ["T_0", "Tref", "t_ref"])
def test_other_names_of_the_reference_temperature(key):
    assert declared(f"{key}: 25").reference_temperature == 25.0


@pytest.mark.parametrize(
    "line",
    [
        "head_uncertainty (k=2): 4 arcsec",
        "head_uncertainty: 4 arcsec (k = 2)",
        "head_uncertainty (95 %, k=2): 4 arcsec",
        "launch_uncertainty: 1e-5 g (2 sigma)",
    ],
)
def test_an_uncertainty_with_a_factor_is_refused(line):
    with pytest.raises(TableError, match="with a factor; give the standard uncertainty alone"):
        declared(line)
