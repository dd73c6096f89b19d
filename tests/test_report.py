"""Reports of calibrations, as an engineer and a notebook see them."""

import io
import itertools
import json
import math
import random
import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

import accelcal
from accelcal.report.calibration_rows import alarms, correlations, first_alarms, residual_grid
from accelcal.report.findings import noise_line
from accelcal.report.numbers import matching_digits, significant
from accelcal.results.quantity import ErrorSource

COUNTS = 1.35e9


def table(
    *,
    positions=8,
    strokes=2,
    levels=("20",),
    header="",
    scale=1.35,
    columns="",
    extra="",
    noise=5e-6,
    fault=lambda *_: 0.0,
):
    """Text of a long table of an AL-15."""
    rng = random.Random(15)
    lines = [
        f"# positions: {positions}",
        header,
        f"run,temperature,position,stroke,output{columns}",
    ]
    for run, level in enumerate(levels, start=1):
        for k in range(1, strokes + 1):
            for j in range(1, positions + 2):
                th = 2.0 * math.pi * (j - 1) / positions
                y = 3.3e-3 + math.cos(th) + 1.15e-3 * math.sin(th) + rng.gauss(0.0, noise)
                y = scale * (y + fault(j, k))
                lines.append(f"{run},{level},{j},{k},{y:.9g}{extra}")
    return "\n".join(filter(None, lines)) + "\n"


def fitted(text=None, **design):
    keys = {"method", "coefficients", "delta0", "robust"}
    options = {key: design.pop(key) for key in keys & design.keys()}
    record = accelcal.read_table(io.StringIO(text or table(**design)))
    return accelcal.fit(record, **options)


LEVELS = tuple(map(str, (20, 80, -40, 0, 60, 40, 20, 30, -20, 70)))
SIX = "# stroke: 1\n# temperature: 20\nposition,output\n" + "".join(
    f"{j},{1.35 * (0.0033 + math.cos(math.pi / 4 * (j - 1))):.6f}\n" for j in (1, 2, 3, 4, 5, 7)
)
FOUR = "# stroke: 1\n# temperature: 20\nposition,output\n1,1.354\n3,0.006\n5,-1.346\n7,0.003\n"
MANY = {
    "plain": {"strokes": 6},
    "temperature unknown": {"levels": ("unknown",)},
    "ten tables": {"levels": LEVELS},
    "no uncertainty": {"text": FOUR},
    "one degree of freedom": {"text": SIX},
    "not determined": {"positions": 4},
    "huge counts": {"scale": COUNTS, "header": "# unit: counts"},
    "tiny current": {"scale": 1.35e-3, "header": "# unit: A\n# g: 9.8106"},
    "mean, std and n": {"columns": ",std,n", "extra": ",1.35e-5,4"},
    "std contradicted": {"columns": ",std,n", "extra": ",1e-6,50", "strokes": 4},
    "36 x 20": {"positions": 36, "strokes": 20},
    "12 x 13": {"positions": 12, "strokes": 13},
    "three coefficients": {"coefficients": ("K0", "K1", "M")},
    "printed": {"method": "printed"},
    "sign-corrected": {"method": "sign-corrected"},
    "closed form": {"method": "closed-form"},
    "robust": {"strokes": 6, "robust": True},
    "delta0": {"delta0": -2e-4, "header": "# g: 9.8106\n# date: 2009-03-01\n# serial: AL-15"},
    "declared": {"header": "# head_uncertainty: 1e-5\n# launch_uncertainty: 2e-5"},
    "outlier": {"strokes": 6, "fault": lambda j, k: 1e-3 * (j == 3 and k == 2)},
    "garbage": {"strokes": 3, "fault": lambda j, k: math.sin(j * k * k)},
    "odd names": {
        "header": "# serial: \x1b[2J\x07µ日本<script>\n# unit: µA",
        "levels": ("20", "unknown"),
    },
    "long run": {"text": table().replace("\n1,", "\nsecond heating after the repair,")},
    "long name": {"header": "# serial: " + "AL-15/" * 40},
}


@pytest.fixture(params=MANY)
def calibration(request):
    if request.param == "printed":
        with pytest.warns(accelcal.AccelcalWarning, match="misprinted"):
            return fitted(**MANY[request.param])
    return fitted(**MANY[request.param])


def test_text_is_readable(calibration):
    text = str(calibration)
    assert {c for c in text if not c.isascii()} <= set("µ日本")  # as the user typed it
    assert all(line.isprintable() for line in text.splitlines())
    assert max(map(len, text.splitlines())) <= 100
    assert not re.search(r"\bnan\b|\binf\b|None|True|(?<![\d.])-0(\.0+)?(?![\d.])", text)
    assert "  \n" not in text


def test_notebook_is_well_formed(calibration):
    root = ElementTree.fromstring(f"<div>{calibration._repr_html_()}</div>")
    assert len(root.findall("table")) >= len(calibration.tables)
    assert "nan" not in "".join(root.itertext())
    assert not root.findall(".//script")


def test_document_comes_back(calibration):
    assert accelcal.Calibration.from_json(calibration.to_json()) == calibration


ROW = re.compile(
    r"^  (scale factor|bias|second order|third order|misalignment|cross-coupling) +"
    r"(\w+)(?: \*)? +(-?[\d.]+) +([\d.]+) +((?:output )?\S+) +([\d.e-]+) +([\d.]+)  \S",
    re.MULTILINE,
)
FACTORS = {"mg": 1e3, "ug/g^2": 1e6, "ug/g^3": 1e6, "urad": 1e6}


def test_digits_follow_the_uncertainty():
    calibration = fitted(strokes=6)
    rows = ROW.findall(str(calibration))
    assert [symbol for _, symbol, *_ in rows] == ["K1", "k0", "k2", "k3", "delta", "delta_ip"]
    found = calibration.tables[0]
    for _, symbol, value, expanded, unit, standard, factor in rows:
        assert len(value.partition(".")[2]) == len(expanded.partition(".")[2])
        assert len(expanded.replace(".", "").strip("0")) <= 2
        quantity = {**found.coefficients, **found.error_model}[symbol]
        scale = FACTORS.get(unit, 1.0)
        step = 10.0 ** -len(value.partition(".")[2])
        assert float(value) == pytest.approx(scale * quantity.value, abs=0.501 * step)
        assert float(expanded) == pytest.approx(scale * quantity.expanded_uncertainty, rel=0.05)
        assert float(standard) == pytest.approx(scale * quantity.standard_uncertainty, rel=0.05)
        assert float(factor) == pytest.approx(quantity.coverage_factor, abs=0.005)


@pytest.mark.parametrize(
    ("value", "uncertainty", "shown"),
    [
        (3.26924, 0.02256, ("3.269", "0.023")),
        (1.0, 0.0996, ("1.00", "0.10")),
        (1.0, 0.00949, ("1.0000", "0.0095")),
        (-0.3, 46000.0, ("0", "46000")),
        (1350016000.0, 12345.0, ("1350016000", "12000")),
        (2.5, 0.0, ("2.5", "0")),
        (2.0, 1e-15, ("2", "1e-15")),
        (1.23456e-12, 2.2e-15, ("1.2346e-12", "2.2e-15")),
        (0.0, 2.2e-15, ("0", "2.2e-15")),
        (1.5, math.nan, ("1.5", "unknown")),
    ],
)
def test_matching_digits(value, uncertainty, shown):
    assert matching_digits(value, uncertainty) == shown


@pytest.mark.parametrize(
    ("value", "digits", "shown"),
    [
        (187.3, 2, "190"),
        (7090.0, 3, "7090"),
        (9.996, 3, "10.0"),
        (0.0, 2, "0"),
        (3e-12, 2, "3e-12"),
    ],
)
def test_significant(value, digits, shown):
    assert significant(value, digits) == shown


# -- what comes first ------------------------------------------------------------------------------


def test_a_report_has_one_set_of_names():
    """K0, K2, K3, M and M_ip are those of (1), in output units; the table shows the error model."""
    text = str(fitted())
    assert not re.findall(r"\b(?:K0|K2|K3|M|M_ip)\b", text)
    assert "strongly correlated: K1 with k3 -0." in text


def test_correlations_are_those_of_what_the_table_shows():
    """With a bias of 0.1 g, K0 hangs on K1 otherwise than k0 = K0/K1 does."""
    unit = replace(accelcal.AL15, bias=accelcal.BilinearLaw(0.1))
    calibration = accelcal.fit(accelcal.simulate(unit, seed=1))
    table = calibration.tables[0]
    found = accelcal.coefficients_at(calibration, table.temperature_degC, run=table.run)
    names, shown = correlations(table)
    order = [found.covariance_names.index(name) for name in names]
    u = np.sqrt(np.diagonal(found.covariance))
    expected = (found.covariance / np.outer(u, u))[np.ix_(order, order)]
    assert shown == pytest.approx(expected, abs=1e-9)
    assert np.abs(shown[1, 0] - table.correlation[0, 1]) > 0.01


def test_warnings_stand_above_the_numbers():
    text = str(fitted(**MANY["outlier"]))
    assert "CLEAR UP THESE WARNINGS FIRST" in text.splitlines()[3]
    assert "by chance in at most 1 % of good records" in text  # some of them are limits, no tests
    warning = text.index("WARNING: run 1, outlier: stroke 2 at 90 deg (line 14) is")
    assert "; correct it or leave its cell empty; --robust" in " ".join(text.split())
    assert warning < text.index("scale factor")
    assert "gates that WARN, see above: outlier" in text


@pytest.mark.parametrize("changes", [{"robust": True}, {"strokes": 2}])
def test_robust_is_no_remedy_of_a_robust_fit_or_of_two_strokes(changes):
    text = str(fitted(**{**MANY["outlier"], **changes}))
    assert "correct it or leave its cell empty" in " ".join(text.split())
    assert "--robust" not in text


def test_what_to_do_about_a_gate_is_told_once():
    found = accelcal.fit(accelcal.simulate(seed=1, effects=[accelcal.effect("backlash").of(2e-4)]))
    for told in (first_alarms(found), alarms(found)):
        alike = [sentence for sentence in told if "forward against back: mean" in sentence]
        assert len(alike) == 3
        assert [sentence.count("run accelcal discover") for sentence in alike] == [1, 0, 0]


def test_warnings_of_many_runs_that_are_alike_are_told_once():
    """A step in another unit was told of each run, 36 times alike."""
    plan = accelcal.TumblePlan(temperatures=(20.0, 60.0, -30.0) * 2)
    record = accelcal.simulate(plan=plan, seed=1)
    declared = replace(record.apparatus, resolution=1e-4)
    calibration = accelcal.fit(
        replace(record, apparatus=declared, output=np.round(record.output, 7))
    )
    for text in (str(calibration), calibration._repr_html_()):
        assert text.count("resolution: U counts the rounding") == 1
        assert (
            "resolution: warns of 5 other tables too: run 2, run 3, run 4, run 5 and run 6"
            in " ".join(text.split())
        )


def test_warnings_that_do_not_stand_above_stand_with_their_table():
    """Of outliers in more than three runs, the readings of the others were told nowhere."""
    plan = accelcal.TumblePlan(temperatures=(20.0, 60.0, -30.0, 0.0))
    record = accelcal.simulate(plan=plan, seed=1)
    output = record.output.copy()
    where = [np.flatnonzero(record.run == run)[5 + run] for run in range(4)]
    output[where] += 1e-2
    calibration = accelcal.fit(replace(record, output=output))
    found = [gate for t in calibration.tables for gate in t.gates if gate.name == "outlier"]
    assert [gate.verdict for gate in found] == ["warn"] * 4
    text = " ".join(str(calibration).split())
    assert all(text.count(gate.finding) == 1 for gate in found)
    assert text.count("gates that WARN, see above: outlier") == 1
    alone = calibration.tables[0]._repr_html_()
    assert "see above" not in alone
    assert found[0].finding in " ".join(alone.split())


def test_clean_report_does_not_alarm():
    text = str(fitted(strokes=6))
    assert "BELIEVE" not in text
    assert "WARN" not in text
    passed = re.search(r"^  gates passed: ((?:.+\n)+)", text, re.MULTILINE)[1].split()
    names = "closure, forward against back, order of positions, outlier, proportions, units"
    assert {word.rstrip(",") for word in passed} >= set(names.replace(",", "").split())


def test_notebook_warns_first():
    html = fitted(**MANY["outlier"])._repr_html_()
    assert html.index("WARNING: run 1, outlier") < html.index("<table>")


def test_printed_form_is_called_no_calibration():
    with pytest.warns(accelcal.AccelcalWarning):
        text = str(fitted(method="printed"))
    assert text.index("NOT A CALIBRATION") < text.index("scale factor")
    assert "* K1 stands for 0.25 K3" in text


# -- what cannot be told ---------------------------------------------------------------------------


def test_four_positions():
    text = str(fitted(positions=4, strokes=3))
    assert re.search(r"scale factor +K1 \* ", text)
    assert "  * K1 stands for K1 + K3\n" in text
    assert re.search(r"third order +k3 +not determined +ug/g\^3\n", text)
    assert "M_ip leaves no trace at these angles and is not estimated" in text


def test_unknown_uncertainty_says_why():
    text = str(fitted(FOUR))
    assert re.search(r"bias +k0 +3\.\d\d\d +unknown +mg +unknown\n", text)
    assert text.split("\n\n")[1].startswith("NO UNCERTAINTY: the uncertainty of run 20 is unknown:")
    assert "NO UNCERTAINTY" not in str(fitted())
    assert "no uncertainty: one reading a coefficient and no declared std" in text
    assert "reading noise, run 20: unknown" in text


@pytest.mark.parametrize(
    ("count", "remedy"),
    [
        (None, "if it is that of single samples, give their number in a column n"),
        (4.0, "check the columns std and n"),
    ],
)
def test_a_declared_std_far_above_the_scatter_of_the_strokes_is_told(count, remedy):
    """Without n the std of samples made U ten times too wide without a word."""
    frame = accelcal.simulate(seed=1).to_frame()
    samples = frame.assign(
        std=6.75e-5 if count is None else 13.5e-5, **({"n": count} if count else {})
    )
    calibration = accelcal.fit(accelcal.read_arrays(samples))
    for table in calibration.tables:
        (note,) = [w for w in table.warnings if "declared std" in w]
        assert re.match(
            r"the declared std is (9|1\d)(\.\d)? times the scatter of the strokes", note
        )
        assert remedy in note
    alike = accelcal.fit(accelcal.read_arrays(frame.assign(std=6.75e-6)))
    assert not any("declared std" in w for table in alike.tables for w in table.warnings)


def test_standard_uncertainties_of_other_programs_are_uncertainties():
    document = json.loads(fitted().to_json())
    for table in document["tables"]:
        for quantity in (*table["coefficients"].values(), *table["error_model"].values()):
            del quantity["expanded_uncertainty"]
    text = str(accelcal.Calibration.from_json(json.dumps(document)))
    assert "NO UNCERTAINTY" not in text
    assert re.search(r"scale factor +K1 +1\.350 +unknown +output unit/g +1\.\de-05\n", text)


def test_head_error_of_zero_is_told_in_words():
    calibration = fitted()
    head = ErrorSource("head", 0.0, "rad", 2.0, "estimated")
    others = tuple(source for source in calibration.error_sources if source.name != "head")
    said = "head position: none shows above the reading noise (estimated, 2 degrees of freedom)"
    assert said in str(replace(calibration, error_sources=(*others, head)))


def test_one_degree_of_freedom_is_told_in_the_singular():
    """Beside the noise of discover it was "1 degrees of freedom"."""
    source = ErrorSource("reading", 5e-6, "g", 1.0, "replicates")
    assert noise_line([source]) == "noise: reading 5.0 ug (replicates, 1 degree of freedom)"


def test_scale_factor_that_is_not_determined_has_its_unit():
    calibration = fitted(levels=("20", "80", "-40"))
    laws = calibration.temperature_model
    unit = laws.K1.at_T0.unit
    bare = replace(laws, K1=replace(laws.K1, at_T0=None))
    text = str(replace(calibration, temperature_model=bare))
    assert re.search(rf"scale factor at T0 +K1N +not determined +{unit}\n", text)


@pytest.mark.parametrize(
    ("cells", "said"),
    [
        ({"0"}, "std is zero at all readings"),
        ({"0", "1e-5"}, "std is zero at some readings"),
        ({"", "1e-5"}, "std is missing at some readings"),
        ({"", "0", "1e-5"}, "std is missing or zero at some readings"),
    ],
)
def test_std_of_zero_is_not_called_missing(cells, said):
    head, *rows = table(columns=",std", extra=",STD").splitlines()
    written = itertools.cycle(sorted(cells))
    rows = [row.replace("STD", next(written)) if "STD" in row else row for row in rows]
    assert said in str(fitted("\n".join([head, *rows]) + "\n"))


def test_unknown_temperature():
    assert "Run 1: temperature unknown, mounting o+, 18 readings" in str(
        fitted(levels=("unknown",))
    )


def test_both_sides_of_a_mounting():
    rows = [
        f"{side},{j},{k},20,{math.cos(t + 1e-3) + sign * 1e-3 * math.sin(t) + 1e-6 * (j * k % 3)}"
        for side, sign in (("o+", 1), ("o-", -1))
        for k in (1, 2)
        for j in range(1, 10)
        for t in [math.pi / 4 * (j - 1)]
    ]
    text = str(fitted("mounting,position,stroke,temperature,output\n" + "\n".join(rows) + "\n"))
    assert "the reversed mounting would separate them" not in text
    assert "Fixture angle apart from the misalignment, mountings o+ and o-" in text
    (angle,) = [line.split() for line in text.splitlines() if line.startswith("  fixture angle")]
    assert angle[2] == "delta0"
    assert float(angle[3]) == pytest.approx(1000.0, abs=0.5)
    assert "mounting o-" in text


# -- noise, units, gravity -------------------------------------------------------------------------


def test_declared_noise_is_shown_in_its_unit():
    """std 1.35e-5 over sqrt(4), which is 5 ug of 1.35 per g; 18 readings of 3 dof."""
    text = str(fitted(**MANY["mean, std and n"]))
    shown = (
        "reading noise, run 1: 0.00000675 output unit (declared, 54 degrees of freedom) = 5.00 ug"
    )
    assert shown in text
    calibration = accelcal.fit(accelcal.simulate(seed=15))
    assert "reading noise, run 1: 5.30 nA (replicates, " in str(calibration)


def test_scale_factor_per_si_and_standard_gravity():
    calibration = fitted(**MANY["tiny current"])
    quantity = calibration.tables[0].coefficients["K1"]
    pattern = (
        r"K1 = ([\d.]+) \+- ([\d.]+) A per m/s\^2\n +K1 = ([\d.]+) \+- ([\d.]+) A per standard"
    )
    text = str(calibration)
    assert text.count("g is local g = 9.8106 m/s^2, taken as exact") == text.count("exact") == 1
    found = [float(part) for part in re.search(pattern, text).groups()]
    for value, expanded, gravity in ((*found[:2], 1.0), (*found[2:], 9.80665)):
        factor = gravity / 9.8106
        assert value == pytest.approx(factor * quantity.value, rel=1e-5)
        assert expanded == pytest.approx(factor * quantity.expanded_uncertainty, rel=0.05)


# -- residuals -------------------------------------------------------------------------------------


def numbers_below(text, heading):
    lines = text.split(heading)[1].splitlines()[2:]
    for line in lines:
        if not re.fullmatch(r"[\s\d.-]+", line):
            return
        yield [float(part) for part in line.split()]


def test_residual_grid_shows_every_reading():
    calibration = fitted(strokes=4)
    rows = list(numbers_below(str(calibration), "residuals [ug] by head angle and stroke"))
    residuals = calibration.tables[0].residuals
    assert len(rows) == 9
    for angle, *shown, mean in rows:
        at = [i for i, th in enumerate(residuals.angle_deg) if th == angle]
        expected = [residuals.value[i] * 1e6 for i in at]
        assert shown == pytest.approx(expected, abs=0.051)
        assert mean == pytest.approx(sum(expected) / 4, abs=0.051)


def test_missing_reading_leaves_a_gap():
    lines = table(strokes=2).splitlines()
    text = "\n".join(line for line in lines if not line.startswith("1,20,3,2,"))
    strokes, rows = residual_grid(fitted(text + "\n").tables[0])
    assert strokes == [1, 2]
    assert dict(rows)[90.0][1] is None
    assert dict(rows)[90.0][0] is not None


def test_wide_grid_is_summarised():
    calibration = fitted(**MANY["36 x 20"])
    text = str(calibration)
    rows = list(numbers_below(text, "residuals [ug] by head angle, over 20 strokes"))
    assert len(rows) == 37
    residuals = calibration.tables[0].residuals
    found = [
        (value * 1e6, stroke % 2)
        for angle, stroke, value in zip(
            residuals.angle_deg, residuals.stroke, residuals.value, strict=True
        )
        if angle == 70.0
    ]
    forward = [value for value, odd in found if odd]
    back = [value for value, odd in found if not odd]
    both = forward + back
    expected = [sum(both) / 20, sum(forward) / 10, sum(back) / 10, min(both), max(both)]
    assert next(row[1:] for row in rows if row[0] == 70.0) == pytest.approx(expected, abs=0.051)


def test_large_residuals_are_told_in_mg():
    text = str(fitted(**MANY["garbage"]))
    assert re.search(r"residuals \[m?g\] by head angle and stroke", text)


# -- names from outside ----------------------------------------------------------------------------


ODD = "Mü-Ω\x1b[2J\u202e"
SHOWN = "Mü-Ω\\x1b[2J\\u202e"


@pytest.fixture(scope="module")
def odd_results():
    """Results of all kinds with letters and escape sequences in the names."""
    plan = accelcal.TumblePlan(strokes=4)
    records = [
        replace(
            accelcal.simulate(plan=plan, seed=seed),
            **{"serial": ODD, "source": f"{ODD}.csv", "date": f"202{seed}-06-01"},
            notes=(f"note {ODD}",),
        )
        for seed in range(4)
    ]
    units = [replace(record, serial=f"{ODD}{n}") for n, record in enumerate(records)]
    calibrations = [accelcal.fit(record) for record in records]
    up = np.random.default_rng(1).normal(size=(30, 3))
    up /= np.linalg.norm(up, axis=1)[:, None]
    noise = 1e-3 * np.random.default_rng(2).normal(size=up.shape)
    return {
        "calibration": calibrations[0],
        "comparison": accelcal.compare(calibrations[0], records[1]),
        "discovery": accelcal.discover(records[0]),
        "head": accelcal.calibrate_head(units),
        "history": accelcal.history(calibrations),
        "stand": accelcal.discover_stand(units),
        "triad": accelcal.calibrate_triad(accelcal.TriadRecord(up + noise, serial=ODD)),
    }


@pytest.mark.parametrize(
    "name", ["calibration", "comparison", "discovery", "head", "history", "stand", "triad"]
)
def test_names_stand_as_they_were_typed(odd_results, name):
    text = str(odd_results[name])
    assert SHOWN in text
    assert all(line.isprintable() for line in text.split("\n"))


def test_serial_cannot_move_the_cursor_or_run():
    calibration = fitted(**MANY["odd names"])
    assert "\x1b" not in str(calibration) + repr(calibration)
    assert "<script>" not in calibration._repr_html_()
    assert "&lt;script&gt;" in calibration._repr_html_()
    assert r"serial \x1b[2J\x07µ日本<script>" in str(calibration)


def test_repr():
    calibration = fitted(header="# serial: AL-15")
    assert repr(calibration) == "<Calibration serial AL-15: least-squares, 1 table>"


def by_mounting(*mountings):
    plan = accelcal.TumblePlan(temperatures=(0.0, 60.0, -40.0), mountings=mountings, strokes=2)
    return accelcal.fit(accelcal.simulate(seed=1, plan=plan))


def test_laws_say_of_which_mounting_they_are_and_those_of_the_second_axis_are_told():
    found = by_mounting("o+", "p+")
    told = [
        matching_digits(q.value, q.expanded_uncertainty, 1e6)
        for q in misalignments_at_reference(found)
    ]
    for shown in (str(found), found._repr_html_()):
        for mounting, (value, half_width) in zip(("o+", "p+"), told, strict=True):
            laws = shown.split(f"emperature laws of mounting {mounting}", 1)[1]
            assert laws.index(value) < laws.index(half_width)
    assert "mounting" not in str(by_mounting("o+")).split("Temperature laws")[1]


def misalignments_at_reference(found):
    return found.temperature_model.delta.at_T0, found.second_axis_model.delta.at_T0


def test_rows_hold_the_laws_of_both_axes_by_mounting():
    found = by_mounting("o+", "p+")
    rows = [row for row in found.rows() if row["coefficient"] == "delta at_T0"]
    expected = list(
        zip(("o+", "p+"), [q.value for q in misalignments_at_reference(found)], strict=True)
    )
    assert [(row["mounting"], row["value"]) for row in rows] == expected


def test_what_both_sides_tell_is_told_with_its_temperature_in_text_and_notebook():
    found = by_mounting("o+", "o-")
    for shown in (str(found), found._repr_html_()):
        for name in ("misalignment", "cross-coupling"):
            assert all(f"{name} at {level} degC" in shown for level in (0, 60, -40))
