"""Exports: what they say, that they read back, and that the C header computes what Python does."""

import csv
import hashlib
import json
import math
import re
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from c_compiler import COMPILER, STRICT, compiled, needs_compiler, printed_by
from hypothesis import given
from hypothesis import strategies as st

import accelcal
from accelcal.cli.main import main
from accelcal.compensate.choice import compensation
from accelcal.export.c_header import to_c_header
from accelcal.export.c_text import c_prefix
from accelcal.export.content import export_content
from accelcal.export.write import to_csv, to_yaml


def fitted(**plan):
    return accelcal.fit(accelcal.simulate(plan=accelcal.TumblePlan(**plan), seed=1))


CASES = {
    "three levels": {},
    "two levels": {"temperatures": (20.0, 80.0)},
    "one level": {"temperatures": (20.0,)},
    "four positions": {"positions": 4, "temperatures": (20.0,)},
    "other mounting": {"mountings": ("p+",)},
    "both mountings": {"temperatures": (20.0,), "mountings": ("o+", "p-")},
    "runs at one level": {"temperatures": (20.0, 20.0), "mountings": ("o+", "p+")},
}


@pytest.fixture(scope="module", params=CASES)
def calibration(request):
    return fitted(**CASES[request.param])


@pytest.fixture(scope="module")
def al15():
    return fitted()


# -- content ---------------------------------------------------------------------------------------


def test_every_coefficient_has_unit_and_uncertainty(calibration):
    content = export_content(calibration)
    undetermined = compensation(calibration).undetermined
    for row in content["coefficients"]:
        assert row["unit"]
        assert row["meaning"]
        missing = row["symbol"] in undetermined or (
            row["value"] is None and "slope" in row["symbol"]
        )
        assert (row["value"] is None) == missing
        known = row["standard_uncertainty"] is not None
        assert not known if missing else not known or row["standard_uncertainty"] > 0.0


def test_values_are_those_of_the_calibration(al15):
    rows = {row["symbol"]: row for row in export_content(al15)["coefficients"]}
    laws = al15.temperature_model
    for symbol, law in (("k0", laws.k0), ("K1", laws.K1), ("delta_O", laws.delta)):
        for suffix, part in (("", law.at_T0), ("_slope_above", law.above)):
            row = rows[symbol + suffix]
            assert (row["value"], row["unit"]) == (part.value, part.unit)
            assert row["standard_uncertainty"] == pytest.approx(part.standard_uncertainty)
            assert row["expanded_uncertainty"] == pytest.approx(part.expanded_uncertainty)
    table = al15.tables[0].error_model
    for symbol, name in (("k2", "k2"), ("k3", "k3"), ("delta_ip", "delta_ip")):
        told = rows[symbol]["expanded_uncertainty"]
        assert told == pytest.approx(table[name].expanded_uncertainty)


def test_ieee_1293_turns_the_sign_of_delta_p_only():
    fit = fitted(temperatures=(20.0,), mountings=("o+", "p+"))
    content = export_content(fit)
    delta_O, delta_P = (table.error_model["delta"].value for table in fit.tables)
    assert content["ieee_1293"] == {"delta_o": delta_O, "delta_p": -delta_P}
    assert "delta_p = -delta_P" in content["sign_convention"]


def test_the_covariance_says_that_the_second_cross_axis_is_not_in_it(al15):
    both = export_content(fitted(mountings=("o+", "p+")))
    told = "The errors of delta_P, delta_io and their slopes are not in it"
    assert not {"delta_P", "delta_io"} & {*both["covariance"]["symbols"]}
    assert told in both["covariance"]["note"]
    assert "not in it" not in export_content(al15)["covariance"]["note"]


def test_validity(al15):
    validity = export_content(al15)["validity"]
    assert validity["temperature_degC"] == [-40.0, 80.0]
    assert validity["acceleration_g"] == [-1.0, 1.0]
    assert "extrapolated" in validity["note"]


# -- YAML and CSV ----------------------------------------------------------------------------------

scalars = st.none() | st.booleans() | st.integers() | st.text() | st.floats(
    allow_nan=False, allow_infinity=False
)  # fmt: skip
keys = st.from_regex(r"[a-z][A-Za-z0-9_]{2,}[A-Z_]", fullmatch=True)
trees = st.recursive(
    scalars, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(keys, inner, max_size=4)
)


@given(st.dictionaries(keys, trees, min_size=1))
def test_yaml_reads_back(tree):
    yaml = pytest.importorskip("yaml", reason="PyYAML, the oracle, is not installed")
    assert yaml.safe_load(to_yaml(tree)) == tree


def test_yaml_of_a_calibration_reads_back(calibration):
    yaml = pytest.importorskip("yaml", reason="PyYAML, the oracle, is not installed")
    content = export_content(calibration, "0" * 64)
    assert yaml.safe_load(to_yaml(content)) == content


def test_csv_reads_back(calibration):
    content = export_content(calibration)
    text = to_csv(content)
    rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("# ")))
    assert [row["symbol"] for row in rows] == [row["symbol"] for row in content["coefficients"]]
    for read, written in zip(rows, content["coefficients"], strict=True):
        assert (float(read["value"]) if read["value"] else None) == written["value"]
    names = content["covariance"]["symbols"]
    by_symbol = {row["symbol"]: row for row in rows}
    matrix = [[float(by_symbol[a][f"covariance_{b}"]) for b in names] for a in names]
    assert matrix == content["covariance"]["matrix"]
    assert "# sign_convention: Misalignment terms are added with + for both" in text


# -- a program of a laboratory, from the equations of the paper ------------------------------------

LAWS = {"k0", "K1", "delta_O", "delta_P"}


def output_by_the_paper(k, a_i, rise, a_p=0.0, a_o=0.0):
    """Equation (1) with the laws of temperature; what is not determined counts for nothing."""
    slope = {name: k[f"{name}_slope_{'above' if rise > 0.0 else 'below'}"] for name in LAWS & {*k}}
    now = {name: k[name] + slope[name] * rise for name in slope if name != "K1"}
    across = now["delta_O"] * a_p + k["delta_ip"] * a_i * a_p if "delta_O" in k else 0.0
    across += now["delta_P"] * a_o + k["delta_io"] * a_i * a_o if "delta_P" in k else 0.0
    felt = now["k0"] + a_i + k["k2"] * a_i**2 + k["k3"] * a_i**3 + across
    return k["K1"] * (1.0 + slope["K1"] * rise) * felt


def shifts(k, symbols, a_i, rise, across):
    """Shift of the acceleration by each coefficient, relative for K1; the sign is left out."""
    y, tiny = output_by_the_paper(k, a_i, rise, **across), 1e-6
    slope = output_by_the_paper(k, a_i + tiny, rise, **across) - y
    steps = {s: tiny * (k["K1"] if s == "K1" else 1.0) for s in symbols}
    moved = [k | {symbol: k[symbol] + step} for symbol, step in steps.items()]
    return np.array([(output_by_the_paper(m, a_i, rise, **across) - y) / slope for m in moved])


@pytest.mark.parametrize("a_i", [-0.9, 0.4])
@pytest.mark.filterwarnings("ignore::accelcal.AccelcalWarning")
def test_the_numbers_of_an_export_give_acceleration_and_uncertainty(calibration, a_i):
    content = export_content(calibration)
    rows = {row["symbol"]: row for row in content["coefficients"]}
    k = {symbol: row["value"] or 0.0 for symbol, row in rows.items()}
    names, launch = content["covariance"]["symbols"], content["new_launch"]
    across = {a: v for a, v in (("a_p", 0.5), ("a_o", -0.3)) if f" {a}" in content["model"]}
    beside = [s for s, row in rows.items() if row["standard_uncertainty"] and s not in names]
    new = math.hypot(launch["bias"], launch["scale_factor"] * a_i, launch["hysteresis"])
    for degC in {20.0, *(content["validity"]["temperature_degC"] or ())}:
        y = output_by_the_paper(k, a_i, degC - 20.0, **across)
        row = shifts(k, names, a_i, degC - 20.0, across)
        own = math.sqrt(row @ np.array(content["covariance"]["matrix"]) @ row)
        for_each = [rows[symbol]["standard_uncertainty"] for symbol in beside]
        own += np.linalg.norm(shifts(k, beside, a_i, degC - 20.0, across) * for_each)
        found = accelcal.apply(calibration, [y], [degC], **{a: [v] for a, v in across.items()})
        assert found.value[0] == pytest.approx(a_i, abs=1e-14)
        assert found.standard_uncertainty[0] == pytest.approx(math.hypot(own, new), rel=0.01)


# -- C ---------------------------------------------------------------------------------------------


def program_of(folder, header, prefix, axes):
    """A program that reads samples and prints their accelerations and flags."""
    (folder / "export.h").write_text(header, encoding="utf-8")
    names = "".join(f", {axis}" for axis in axes)
    return compiled(
        folder,
        f"""
        #include <stdio.h>
        #include "export.h"
        int main(void)
        {{
            double y, t{names};
            while (scanf("%lf %lf{" %lf" * len(axes)}", &y, &t{names.replace(", ", ", &")}) > 0) {{
                const double a = {prefix}_acceleration(y, t{names});
                printf("%.17g %d\\n", a, {prefix}_inside(t, a));
            }}
            return 0;
        }}
        """,
    )


@needs_compiler
@pytest.mark.filterwarnings("ignore::accelcal.AccelcalWarning")
def test_c_agrees_with_python(tmp_path, calibration):
    found = compensation(calibration)
    axes = [axis.name for axis in found.axes]
    rng = np.random.default_rng(3)
    size = 2000
    output = np.concatenate(
        [rng.uniform(-1.4, 1.4, size), rng.uniform(-40, 40, size), [1e300, -1e9, 1]]
    )
    temperature = rng.uniform(-60, 100, output.size)
    cross = {axis: rng.uniform(-2, 2, output.size) for axis in axes}
    cross[axes[0]][-1] = 1e300
    program = program_of(
        tmp_path, to_c_header(export_content(calibration), found), c_prefix(found.serial), axes
    )
    values, inside = printed_by(program, np.column_stack([output, temperature, *cross.values()])).T
    python = accelcal.apply(calibration, output, temperature, **cross, extrapolate=True)
    assert np.isnan(values[-3:]).all()
    np.testing.assert_array_equal(np.isnan(values), np.isnan(python.value))
    # a few units in the last place of the largest term of the sum
    limit = 4 * np.spacing(np.maximum(1.0, np.abs(python.value)))
    assert (np.abs(values - python.value)[:-3] <= limit[:-3]).all()
    np.testing.assert_array_equal(inside, python.inside)


@needs_compiler
@pytest.mark.parametrize(
    ("first", "second"),
    [("A-1", "A.1"), (None, None), ("A-1", "A-1")],
    ids=["signs", "none", "twice"],
)
def test_two_calibrations_of_one_name_do_not_compile_together(tmp_path, first, second):
    for number, serial in enumerate((first, second)):
        record = replace(accelcal.simulate(seed=number), serial=serial)
        accelcal.fit(record).export(tmp_path / f"{number}.h")

    def together(*names):
        lines = "".join(f'#include "{name}.h"\n' for name in names)
        (tmp_path / "main.c").write_text(lines + "int main(void) { return 0; }\n")
        return subprocess.run(
            [COMPILER, *STRICT, "-c", "main.c"], cwd=tmp_path, capture_output=True, text=True
        )

    assert together(0, 0).returncode == together(1, 1).returncode == 0
    told = together(0, 1)
    assert told.returncode != 0
    assert "two calibrations have the names accelcal" in told.stderr


@needs_compiler
def test_c_without_covariance(tmp_path):
    one = fitted(temperatures=(20.0,))
    table = replace(one.tables[0], covariance_names=(), covariance_matrix=())
    bare = replace(one, tables=(table,), serial=None)
    found = compensation(bare)
    header = to_c_header(export_content(bare), found)
    assert "NAN, NAN" in header
    program = program_of(tmp_path, header, "accelcal", ["a_p"])
    assert np.isfinite(printed_by(program, [[1.35, 20.0, 0.0]])).all()


@needs_compiler
@pytest.mark.parametrize(
    "serial", ["*/ int x; /*", "a\\", "??/", "line\nfeed", "15", "Ünit 7", "", "// x"]
)
def test_no_serial_can_break_the_header(tmp_path, al15, serial):
    named = replace(al15, serial=serial, source=serial)
    header = to_c_header(export_content(named), compensation(named))
    prefix = c_prefix(serial)
    assert re.fullmatch(r"[A-Za-z_]\w*", prefix, re.ASCII)
    program_of(tmp_path, header, prefix, ["a_p"])


@given(st.text())
def test_prefix_is_an_identifier(serial):
    assert re.fullmatch(r"accelcal(_[A-Za-z0-9_]+)?", c_prefix(serial), re.ASCII)


# -- command ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "start"), [("x.h", "/*\n * schema"), ("x.yaml", "schema: "), ("x.csv", "# schema: ")]
)
def test_the_extension_picks_the_format(tmp_path, al15, name, start):
    cal = tmp_path / "cal.json"
    al15.to_json(cal)
    assert main(["export", str(cal), "-o", str(tmp_path / name)]) == 0
    text = (tmp_path / name).read_text()
    assert text.startswith(start)
    assert hashlib.sha256(cal.read_bytes()).hexdigest() in text


def test_another_extension_is_refused(tmp_path, al15, capsys):
    al15.to_json(tmp_path / "cal.json")
    assert main(["export", str(tmp_path / "cal.json"), "-o", str(tmp_path / "x.doc")]) == 2
    assert (
        "the name ends in none of .h, .hpp, .yaml, .yml, .csv; choose one, or give --format c"
        in capsys.readouterr().err
    )
    assert main(["export", str(tmp_path / "cal.json")]) == 2
    assert main(["export", str(tmp_path / "cal.json"), "--format", "yaml"]) == 0
    assert capsys.readouterr().out.startswith("schema: ")


def test_assumptions_are_said_and_written(tmp_path, capsys):
    fit = fitted(positions=4, temperatures=(20.0,))
    fit.to_json(tmp_path / "cal.json")
    assert main(["export", str(tmp_path / "cal.json"), "-o", str(tmp_path / "x.yaml")]) == 0
    assert "warning: K3, M_ip were not determined and taken as 0" in capsys.readouterr().err
    assert "K1 stands for K1 + K3" in (tmp_path / "x.yaml").read_text()


def test_one_degree_of_freedom_of_launches_is_exported_as_it_counts():
    """A half stood there, and nothing said why."""
    record = accelcal.simulate(plan=accelcal.TumblePlan(temperatures=(20.0, 80.0, 20.0)), seed=4)
    fit = accelcal.fit(replace(record, apparatus=accelcal.Apparatus()))
    told = export_content(fit)["new_launch"]
    assert told["bias_dof"] == told["scale_factor_dof"] == 0.5
    assert "a half is one alone" in told["note"]


def test_covariance_is_plain_json(al15):
    json.dumps(export_content(al15), allow_nan=False)


def test_covariance_holds_the_slopes(al15):
    content = export_content(al15)
    symbols = content["covariance"]["symbols"]
    assert symbols[6:9] == ["k0_slope_above", "K1_slope_above", "delta_O_slope_above"]
    sigma = np.sqrt(np.diagonal(content["covariance"]["matrix"]))
    laws = al15.temperature_model
    told = dict(zip(symbols, sigma, strict=True))
    assert told["k0_slope_below"] == pytest.approx(laws.k0.below.standard_uncertainty)
    model = dict(zip(laws.covariance_names, laws.covariance_matrix, strict=True))
    place = laws.covariance_names.index("k0 above")
    first = content["covariance"]["matrix"][0][symbols.index("k0_slope_above")]
    assert first == model["k0 at_T0"][place]


@needs_compiler
@pytest.mark.parametrize("plan", CASES.values(), ids=CASES)
def test_nothing_unused_is_complained_about(plan, tmp_path):
    found = compensation(fit := fitted(**plan))
    (tmp_path / "cal.h").write_text(to_c_header(export_content(fit), found), encoding="utf-8")
    main = '#include "cal.h"\nint main(void) { return 0; }\n'
    compiled(tmp_path, main, "-Wunused", "-Wunused-const-variable")


# -- from Python -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["al15.h", "al15.yaml", "al15.csv"])
def test_the_method_writes_what_the_command_writes(al15, tmp_path, name):
    document, by_command, by_method = tmp_path / "al15.json", tmp_path / name, tmp_path / f"m{name}"
    al15.to_json(document)
    assert main(["export", str(document), "-o", str(by_command)]) == 0
    al15.export(by_method)
    assert by_method.read_bytes() == by_command.read_bytes()


@pytest.mark.parametrize(
    ("form", "name", "said"),
    [
        ("yaml", "x.csv", "x.csv would hold YAML; end its name in .yaml or .yml"),
        ("c", "x.YAML", "x.YAML would hold a C header; end its name in .h or .hpp"),
    ],
)
def test_no_name_promises_another_form(al15, tmp_path, monkeypatch, capsys, form, name, said):
    monkeypatch.chdir(tmp_path)
    al15.to_json("cal.json")
    assert main(["export", "cal.json", "--format", form, "-o", name]) == 2
    assert capsys.readouterr().err == f"error: {said}\n"
    with pytest.raises(accelcal.InputError, match=re.escape(said)):
        al15.export(name, form=form)
    assert main(["export", "cal.json", "--format", form, "-o", "x.txt"]) == 0


def test_the_method_refuses_other_forms(al15, tmp_path):
    with pytest.raises(accelcal.InputError, match=r"al15\.txt: the name ends in none of \.h, "):
        al15.export(tmp_path / "al15.txt")
    with pytest.raises(accelcal.InputError, match="form 'header' is unknown; choose from c, yaml"):
        al15.export(tmp_path / "al15.txt", form="header")
    assert not list(tmp_path.iterdir())


def test_the_method_exports_one_run_and_warns_of_what_is_assumed(tmp_path):
    calibration = fitted(positions=4)
    with pytest.warns(accelcal.AccelcalWarning, match="K3, M_ip were not determined") as told:
        calibration.export(tmp_path / "run.txt", form="yaml", run=2)
    assert told[0].filename == __file__
    content = export_content(calibration, None, 2)
    assert f"value: {content['coefficients'][0]['value']!r}\n" in (tmp_path / "run.txt").read_text()
    assert content["validity"]["temperature_degC"] == [80.0, 80.0]
