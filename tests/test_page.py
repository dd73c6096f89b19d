"""Pages of results: what they say, that they are whole in themselves, and the same each time."""

import builtins
import itertools
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

import accelcal
from accelcal.cli.main import main
from accelcal.io.documents import read_results
from accelcal.io.toml.specification import read_specification
from accelcal.page.evidence import provenance
from accelcal.page.render import html, markdown
from accelcal.page.write import form_of, report_page
from accelcal.report.numbers import matching_digits
from accelcal.results.quantity import Gate, Residuals
from accelcal.results.stand_discovery import HeadPosition, StandDiscovery, StandEffect
from accelcal.verdict.judge import judge

EXAMPLES = Path(__file__).parents[1] / "examples"
VOID = {"meta", "link", "br", "img", "hr"}


class Outline(HTMLParser):
    """Tags in order, ids, and the text of a page; fails where tags do not match."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.ids, self.text = [], [], [], []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.ids += [value for name, value in attrs if name == "id"]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.ids += [value for name, value in attrs if name == "id"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


@pytest.fixture(scope="module")
def calibration():
    found = accelcal.fit(accelcal.read_table(EXAMPLES / "al15.csv"))
    return replace(found, verdict=judge(found, read_specification(str(EXAMPLES / "al15.toml"))))


@pytest.fixture(scope="module")
def page(calibration):
    return html(report_page([calibration]))


@pytest.fixture(scope="module")
def record():
    return accelcal.simulate(effects=[accelcal.effect("backlash").of(5e-5)], seed=1)


@pytest.fixture(scope="module")
def discovery(record):
    return accelcal.discover(record)


# -- a calibration ---------------------------------------------------------------------------------


def test_the_page_tells_all_there_is(page):
    told = " ".join(Outline(page).text)
    for part in (
        *("AL-15", "1.349975", "0.000023", "mA/g", "fails its data sheet", "519.89", "FAIL"),
        *("Temperature", "Residuals", "Uncertainty budget", "Checks", "Provenance"),
        *("What these readings cannot tell", "fixture angle", "seed 15", "accelcal 0"),
        "Each check warns by chance in at most 1 % of good records.",
        "d751ece30e94e5dd5a425f4a7b12021ea5877cd4e0bc08e24ce6e6e5a1092a51",
    ):
        assert part in told, part


def test_value_and_uncertainty_share_their_digits(page):
    number = r'<td class="number[^"]*">([−\d.]+)</td>\s*'
    cells = re.findall(rf'</th>\s*<td class="short">\S+</td>\s*{number}{number}', page)
    assert len(cells) == 3 * 6 + 9  # the tables and the laws
    for value, uncertainty in cells:
        decimals = [len(number.partition(".")[2]) for number in (value, uncertainty)]
        assert decimals[0] == decimals[1], (value, uncertainty)


def test_the_page_is_whole_in_itself(page):
    outline = Outline(page)
    tags = [tag for tag, _ in outline.tags]
    assert "script" not in tags
    assert "img" not in tags
    links = [
        a[name] for _, a in outline.tags for name in ("href", "src", "xlink:href") if name in a
    ]
    assert links
    assert all(link.startswith(("#", "data:")) for link in links)
    assert not re.search(r"url\((?!#)|@import", page)
    told = dict(outline.tags)
    assert told["html"]["lang"] == "en"


def test_ids_do_not_clash_and_are_found(page):
    ids = Outline(page).ids
    assert len(ids) == len(set(ids))
    asked = set(re.findall(r'(?:xlink:href="|url\()#([^")]+)', page))
    assert asked <= set(ids)


def test_headings_and_pictures_are_for_everybody(page):
    outline = Outline(page)
    levels = [int(tag[1]) for tag, _ in outline.tags if re.fullmatch(r"h\d", tag)]
    assert levels.count(1) == 1
    assert all(b - a <= 1 for a, b in itertools.pairwise(levels))
    pictures = [a for _, a in outline.tags if a.get("role") == "img"]
    assert len(pictures) == 2 * 7  # light and dark: three laws, three of residuals, the budget
    assert all(a["aria-label"] for a in pictures)
    tags = [tag for tag, _ in outline.tags]
    assert tags.count("figcaption") >= tags.count("figure") - tags.count("details")


def test_the_same_result_gives_the_same_bytes(calibration, page):
    again = accelcal.Calibration.from_json(calibration.to_json())
    assert html(report_page([again])) == page


def test_markdown_has_the_same_numbers(calibration, page):
    text = markdown(report_page([calibration]))
    assert text.startswith("# Calibration: AL-15\n")
    assert "<svg" not in text
    numbers = set(re.findall(r'<td class="number[^"]*">([^<]+)</td>', page))
    assert [number for number in numbers if number not in text] == []
    for line in re.findall(r"^\|.*$", text, re.MULTILINE):
        assert line.endswith("|")


def test_a_hostile_name_does_no_harm(calibration):
    serial = "<script>alert(1)</script>|*x*\x1b[2J"
    bare = replace(calibration.tables[0], residuals=Residuals(), budget={})
    bad = replace(calibration, serial=serial, temperature_model=None, tables=(bare,))
    page = report_page([bad])
    text = html(page)
    assert "<script" not in text
    assert "\x1b" not in text
    assert "&lt;script&gt;" in text
    Outline(text)
    assert "<script" not in markdown(page).replace("\\<", "")


def test_no_name_is_mathematics_or_a_letter_of_html_in_markdown(calibration):
    """GitHub makes a formula of what stands between dollar signs, and <b> of &lt;b>."""
    named = replace(calibration, serial="$a$ &lt; ~~b~~")
    text = markdown(report_page([named]))
    assert text.startswith("# Calibration: \\$a\\$ \\&lt; \\~\\~b\\~\\~\n")


def test_the_residuals_are_told_over_the_scale_factor(calibration, page):
    rms = [1e6 * t.residual_rms / t.coefficients["K1"].value for t in calibration.tables]
    told = re.search(r"degrees of freedom is ([\d.]+) to ([\d.]+) µg", page)
    assert [float(size) for size in told.groups()] == pytest.approx([min(rms), max(rms)], rel=0.02)


@pytest.mark.parametrize("robust", [False, True])
def test_a_robust_estimate_is_told(calibration, robust):
    (facts,) = provenance(replace(calibration, robust=robust, provenance={})).blocks
    assert dict(facts.items)["method"] == calibration.method + ", robust" * robust


def test_what_is_not_known_is_said(calibration):
    document = calibration.to_document() | {"date": None}
    del document["provenance"]
    text = markdown(report_page([accelcal.Calibration.from_document(document)]))
    assert "- SHA-256 of the input: not recorded\n" in text


def test_one_table_and_no_uncertainty():
    columns = {"position": [1, 3, 5, 7], "output": [1.3, 0.01, -1.29, -0.01]}
    columns |= {"stroke": [1] * 4, "temperature": [20.0] * 4}
    found = accelcal.fit(accelcal.read_arrays(columns), coefficients=("K0", "K1", "K2", "M"))
    told = markdown(report_page([found]))
    assert "No uncertainty" in told
    assert "not determined" in told


def test_what_the_scale_factor_stands_for_is_told_first():
    plan = accelcal.TumblePlan(temperatures=(20.0,), positions=4)
    top = markdown(report_page([accelcal.fit(accelcal.simulate(plan=plan, seed=1))]))
    assert "- scale factor K₁ + K₃: **" in top.split("## Coefficients")[0]
    assert "mA/g (which is K₁ + K₃) and bias" in top


@pytest.mark.parametrize("temperatures", [(20.0, 80.0, -40.0), (20.0, 80.0, 20.0, -40.0, 20.0)])
def test_arrows_are_spoken_of_where_the_picture_has_some(temperatures):
    plan = accelcal.TumblePlan(temperatures=temperatures, strokes=2)
    text = markdown(report_page([accelcal.fit(accelcal.simulate(plan=plan, seed=1))]))
    assert ("Arrows lead from run to run" in text) is (len(temperatures) == 5)


def test_a_declared_error_of_temperatures_is_among_the_sources():
    record = accelcal.simulate(seed=1).with_apparatus(temperature_uncertainty=0.1)
    found = accelcal.fit(record)
    assert "temperature of a run: 0.100 degC (declared)" in str(found)
    assert "| temperature of a run | 0.100 °C (declared) |" in markdown(report_page([found]))


def test_checks_that_were_not_made_are_counted():
    found = accelcal.fit(
        accelcal.read_table(EXAMPLES / "mems_x_plane_y.csv"), coefficients=("K0", "K1", "K2", "M")
    )
    text = markdown(report_page([found]))
    assert text.startswith("# Calibration: mems\\_x\\_plane\\_y.csv\n")
    assert "**No check warns.** Scale factor" in text
    assert "readings in" not in text.split("\n")[4]
    assert text.split("\n")[4].endswith(" 6 checks could not be made.")
    assert "as many coefficients were fitted as there are readings" in text


def test_the_first_numbers_are_of_the_whole_record():
    """They were those of one run, said to be from the readings of all."""
    temperatures = (20.0, 80.0, 20.0, -40.0, 20.0)
    found = accelcal.fit(
        accelcal.simulate(plan=accelcal.TumblePlan(temperatures=temperatures), seed=1)
    )
    text = markdown(report_page([found]))
    law = found.temperature_model.k0.at_T0
    value, expanded = matching_digits(1e3 * law.value, 1e3 * law.expanded_uncertainty)
    told = f"bias {value} ± {expanded} mg at 20 °C by the temperature laws, from 270 readings in 5"
    assert told in text
    assert f"- bias at T0 k₀N: **{value} mg** ± {expanded} (95 %)" in text
    loop = found.temperature_model.hysteresis
    value, expanded = matching_digits(1e6 * loop.value, 1e6 * loop.expanded_uncertainty)
    assert f"- bias (heated - cooled)/2 hₜ: **{value} µg** ± {expanded} (95 %)" in text


def test_the_first_sentence_names_what_was_taken_out_of_the_readings():
    """Coefficients of a fit with a model are not those of the readings as they are."""
    hysteresis = accelcal.effect("hysteresis").of(5e-5)
    record = accelcal.simulate(effects=[hysteresis], seed=1)
    found = accelcal.fit(record, model=accelcal.discover(record))
    told = "readings in 3 tables, with hysteresis of the sensor taken out."
    assert told in markdown(report_page([found]))


def test_the_first_numbers_of_several_tables_without_laws_name_their_run():
    record = accelcal.simulate(plan=accelcal.TumblePlan(temperatures=(20.0, 24.0)), seed=1)
    text = markdown(report_page([accelcal.fit(record)]))
    assert "mg at 20 °C, from the 54 readings of run 1, one of 2 tables." in text


@pytest.mark.filterwarnings("ignore::accelcal.AccelcalWarning")
@pytest.mark.parametrize("mountings", [("o+",), ("o+", "p+")])
def test_several_runs_at_one_level_begin_with_their_mean(mountings):
    plan = accelcal.TumblePlan(temperatures=(20.0, 20.0), mountings=mountings)
    calibration = accelcal.fit(accelcal.simulate(plan=plan, seed=1))
    mean = accelcal.coefficients_at(calibration, 20.0)
    text = markdown(report_page([calibration]))
    assert "mg at 20 °C by the mean of runs 1 and 2, from 108 readings." in text
    K1 = str(mean["K1"]).split(" +- ")[0]
    for shown, times in ((text, 2), (str(calibration), 1), (calibration._repr_html_(), 1)):
        assert K1 in shown
        assert shown.lower().count("mean of runs 1 and 2") == times


def test_a_report_of_the_printed_equations_begins_with_what_they_are():
    with pytest.warns(accelcal.AccelcalWarning):
        found = accelcal.fit(accelcal.simulate(seed=1), method="printed")
    text = markdown(report_page([found]))
    assert "**Not a calibration.** The printed equations (6) are misprinted;" in text
    assert "Scale factor" not in text.split("## ")[0]


def test_a_misalignment_free_of_the_fixture_angle_is_told_first():
    plan = accelcal.TumblePlan(mountings=("o+", "o-"), temperatures=(20.0,))
    found = accelcal.fit(accelcal.simulate(plan=plan, seed=4))
    text = markdown(report_page([found]))
    free = found.fixture_angle[0].misalignments[0]
    value, expanded = matching_digits(1e6 * free.value, 1e6 * free.expanded_uncertainty)
    assert f"- misalignment without fixture angle δ: **{value} µrad** ± {expanded} (95 %)" in text
    assert "## Fixture angle" in text


def test_a_run_that_is_called_by_its_mounting_is_not_told_it_twice(calibration):
    """The checks were those of "run 20 o- o-", the pictures too."""
    tables = [
        replace(calibration.tables[0], run=f"20 {side}", mounting=side) for side in ("o+", "o-")
    ]
    page = html(report_page([replace(calibration, tables=tuple(tables))]))
    assert "run 20 o-" in page
    assert not re.search(r"20 o[+−-] o[+−-]", page)


def test_what_is_declared_has_its_unit_and_few_digits(calibration):
    """It was "head_uncertainty = 9.69627362219072e-06"."""
    known = dict(calibration.provenance) | {
        "declared": {"head_uncertainty": 9.69627362219072e-06, "resolution": 1e-7}
    }
    (facts, *_) = provenance(replace(calibration, provenance=known)).blocks
    told = dict(facts.items)["declared"]
    assert told == "head_uncertainty = 9.69627·10⁻⁶ rad; resolution = 1·10⁻⁷ mA"


def test_what_is_left_open_stands_behind_the_coefficients_and_before_the_pictures(page):
    """It stood at the end, behind pictures and checks; the text has it first."""
    parts = "Coefficients", "What these readings cannot tell", "Temperature", "Checks"
    places = [page.index(f">{part}</h2>") for part in parts]
    assert places == sorted(places)


def test_correlations_stand_side_by_side_behind_all_coefficients(calibration):
    """The table of the last run had no room beside two matrices, and left a page empty."""
    sections = {section.title: section for section in report_page(calibration).chapters[0].sections}
    *before, last = sections["Coefficients"].blocks
    assert [part.caption.partition(",")[0] for part in last.parts] == [
        "Correlation of the coefficients"
    ] * len(calibration.tables)
    assert not [part for part in before if getattr(part, "folded", False)]


def test_the_cause_of_other_warnings_is_told_first(calibration):
    """The outlier that two swapped positions make stood before them, another unit behind all."""
    names = "drift", "proportions", "outlier", "order of positions", "units"
    gates = tuple(Gate(name, "warn", "so it is") for name in names)
    of_record = Gate("lack of fit", "warn", "so"), Gate("agreement of tables", "warn", "so")
    first, *others = calibration.tables
    found = replace(calibration, tables=(replace(first, gates=gates), *others), gates=of_record)
    causes = [f"run 1, {name}: so it is" for name in reversed(names[1:])]
    for told in (str(found), markdown(report_page([found]))):
        at = list(map(told.index, (*causes, "agreement of tables: so", "run 1, drift: so it is")))
        assert at == sorted(at)
        assert at[-1] < told.index("lack of fit: so")


def test_the_run_of_the_shares_in_the_picture_is_named(page):
    assert "each coefficient by source of error, run 1." in page


SHOWN_OF_TABLE = {  # symbol: its place in the JSON document, and what one of its unit is there
    "K₁": ("coefficients", "K1", 1.0),
    "k₀": ("error_model", "k0", 1e-3),
    "k₂": ("error_model", "k2", 1e-6),
    "k₃": ("error_model", "k3", 1e-6),
    "δ": ("error_model", "delta", 1e-6),
    "δᵢₚ": ("error_model", "delta_ip", 1e-6),
}
SHOWN_OF_LAWS = [  # in their order
    *(("k0", "at_T0", 1e-3), ("k0", "above", 1e-6), ("k0", "below", 1e-6)),
    *(("K1", "at_T0", 1.0), ("K1", "above", 1e-6), ("K1", "below", 1e-6)),
    *(("delta", "at_T0", 1e-6), ("delta", "above", 1e-6), ("delta", "below", 1e-6)),
]


def cells(text):
    lines = (line for line in text.split("\n") if line.startswith("|"))
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def holds(shown, number):
    """Whether what is shown is the number, rounded in its last digit."""
    shown = shown.replace("−", "-")
    digits = len(shown.partition(".")[2]) or len(shown.rstrip("0")) - len(shown)
    return abs(float(shown) - number) <= 0.5001 * 10.0**-digits


def assert_shown(value, expanded, quantity, size):
    assert holds(value, quantity["value"] / size), (value, quantity)
    assert holds(expanded, quantity["expanded_uncertainty"] / size), (expanded, quantity)


@pytest.mark.parametrize("declare", [True, False])
@pytest.mark.parametrize("mountings", [("o+",), ("o+", "o-")])
def test_the_numbers_of_the_page_are_those_of_the_document(declare, mountings):
    plan = accelcal.TumblePlan(mountings=mountings)
    found = accelcal.fit(accelcal.simulate(plan=plan, seed=6, declare=declare))
    document, rows = found.to_document(), cells(markdown(report_page([found])))
    of_tables = [row for row in rows if len(row) == 8 and row[1] in SHOWN_OF_TABLE]
    expected = [(t, symbol) for t in document["tables"] for symbol in SHOWN_OF_TABLE]
    assert len(of_tables) == len(expected)
    for (table, symbol), row in zip(expected, of_tables, strict=True):
        group, name, size = SHOWN_OF_TABLE[symbol]
        quantity = table[group][name]
        assert row[1] == symbol
        assert_shown(row[2], row[3], quantity, size)
        assert holds(row[5], quantity["standard_uncertainty"] / size)
        assert holds(row[6], quantity["expanded_uncertainty"] / quantity["standard_uncertainty"])
    first = next(i for i, row in enumerate(rows) if row[0].startswith("bias at T"))
    for (law, part, size), row in zip(SHOWN_OF_LAWS, rows[first : first + 9], strict=True):
        assert_shown(row[2], row[3], document["temperature_model"][law][part], size)
    for angle in document["fixture_angle"]:
        of_angle = [row for row in rows if row[0].startswith(("fixture angle", "cross-coupling"))]
        quantities = [angle, *angle["cross_coupling"]]
        for quantity, row in zip(quantities, [r for r in of_angle if len(r) == 5], strict=True):
            assert_shown(row[2], row[3], quantity, 1e-6)


def test_several_calibrations_have_a_chapter_each(calibration):
    small = replace(calibration, tables=calibration.tables[:1], temperature_model=None)
    other = replace(small, serial="B", verdict=None)
    outline = Outline(html(report_page([small, other])))
    assert [tag for tag, _ in outline.tags].count("article") == 2
    assert [tag for tag, _ in outline.tags].count("h1") == 1
    assert len(outline.ids) == len(set(outline.ids))


# -- a discovery -----------------------------------------------------------------------------------


def test_a_discovery_tells_its_story_in_order(discovery, record):
    told = " ".join(Outline(html(report_page([discovery], [record]))).text)
    parts = (
        "Where simulation and measurement disagree",
        "Backlash",
        "Signature of",
        "The gap, before and after",
        "What it changes in the coefficients",
        "What these readings cannot tell",
        "Notes and provenance",
    )
    places = [told.index(part) for part in parts]
    assert places == sorted(places)
    assert f"software: {discovery.software}" in markdown(report_page([discovery]))


def test_residuals_of_many_strokes_are_in_tables_of_ten():
    plan = accelcal.TumblePlan(temperatures=20.0, strokes=12)
    told = markdown(report_page([accelcal.fit(accelcal.simulate(plan=plan, seed=1))]))
    assert [f"stroke {a} to stroke {b}" in told for a, b in ((1, 10), (11, 12))] == [True, True]


def test_what_a_discovery_would_show_has_the_units_of_its_text(discovery):
    told = markdown(report_page([discovery]))
    (drift,) = re.findall(r"bias-drift ([\d.]+) ug/h", " ".join(str(discovery).split()))
    assert f"(bias-drift) | {drift} | µg/h |" in told


def test_a_discovery_without_its_readings_says_so(discovery):
    told = markdown(report_page([discovery]))
    assert "Signature of" not in told
    assert "where the readings are given" in told


def test_nothing_found_is_told():
    found = accelcal.discover(accelcal.simulate(seed=2))
    assert not found.effects
    told = " ".join(Outline(html(report_page([found]))).text)
    assert "nothing is missing that shows" in told
    assert "before and after" not in told


def test_terms_of_one_name_have_one_picture(discovery, record):
    twice = replace(discovery, effects=discovery.effects * 2)
    outline = Outline(html(report_page([twice], [record])))
    assert len(outline.ids) == len(set(outline.ids))
    assert " ".join(outline.text).count("Signature of") == 1


def test_a_stand_is_a_chapter_beside_its_units(discovery):
    change, change_of_effect = discovery.coefficients[0], discovery.effects[0]
    size = next(iter(change_of_effect.parameters.values()))
    effect = StandEffect(
        *("backlash", "backlash of the head", "stand", {"lag": size}, 1e-9, 0.5, 0.1),
        *({"A": size, "B": size}, (), ("hysteresis",)),
    )
    head = (HeadPosition(0.0, size), HeadPosition(45.0, size))
    gains = {"A": (change,), "B": (change,)}
    stand = StandDiscovery(("A", "B"), (effect,), head, gains, discovery, ("a note",))
    page = report_page([discovery, stand])
    assert page.title == "Discovery of 1 record and the stand"
    outline = Outline(html(page))
    assert len(outline.ids) == len(set(outline.ids))
    told = " ".join(outline.text)
    for part in ("The stand of 2 units", "size in B", "The head", "joint estimate", "a note"):
        assert part in told
    assert "It could as well be: hysteresis." in told


def test_faults_come_first(discovery, record):
    from accelcal.results.findings import Fault

    faulty = replace(
        discovery, faults=(Fault("outlier", "outlier", "reading 3 is 90 ug off", {}, 1e-9, (3,)),)
    )
    told = markdown(report_page([faulty], [record]))
    assert told.index("reading 3 is 90 µg off") < told.index("Where simulation")


# -- files and commands ----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def folder(calibration, discovery, tmp_path_factory):
    folder = tmp_path_factory.mktemp("reports")
    calibration.to_json(folder / "cal.json")
    discovery.to_json(folder / "model.json")
    return folder


def test_report_of_a_calibration_that_fails(folder, capsys):
    out = folder / "cal.md"
    assert main(["report", str(folder / "cal.json"), "-o", str(out)]) == 1
    assert "**Fails its data sheet.**" in out.read_text("utf-8")
    assert capsys.readouterr() == ("", "")


def test_report_of_a_discovery(folder, record):
    table, out = folder / "table.csv", folder / "model.md"
    accelcal.write_table(record, table)
    arguments = ["report", str(folder / "model.json"), "-o", str(out), "--data", str(table)]
    assert main(arguments) == 0
    assert "Signature of backlash" in out.read_text("utf-8")


def test_signatures_are_drawn_over_the_readings_that_were_searched(folder, record, capsys):
    """Those of any other table were taken, and its residuals shown as what was explained."""
    searched, other = folder / "searched.csv", folder / "other.csv"
    accelcal.write_table(record, searched)
    accelcal.write_table(accelcal.simulate(seed=5), other)
    found = accelcal.discover(accelcal.read_table(searched))
    found.to_json(folder / "of_file.json")
    arguments = ["report", str(folder / "of_file.json"), "-o", str(folder / "x.html"), "--data"]
    assert main([*arguments, str(other)]) == 2
    told = f"error: {other} is not the file in which the effects were found; give {searched}, unch"
    assert capsys.readouterr().err.startswith(told)
    assert main([*arguments, str(searched)]) == 0


def test_fit_and_discover_report_at_once(folder, record, monkeypatch):
    monkeypatch.chdir(folder)
    accelcal.write_table(record, "table.csv")
    assert main(["fit", "table.csv", "--report", "fit.md"]) == 0
    assert main(["discover", "table.csv", "--report", "discover.md"]) == 0
    assert "# Calibration" in Path("fit.md").read_text("utf-8")
    assert "Signature of backlash" in Path("discover.md").read_text("utf-8")


def test_results_report_themselves(calibration, discovery, record, tmp_path):
    calibration.report(tmp_path / "a.md")
    discovery.report(tmp_path / "b.md", record)
    assert "AL-15" in (tmp_path / "a.md").read_text("utf-8")
    assert "Signature of" in (tmp_path / "b.md").read_text("utf-8")


def test_a_result_without_a_serial_is_that_of_any_unit(calibration, tmp_path):
    """As everywhere else a unit is chosen."""
    path = tmp_path / "unnamed.json"
    path.write_text(replace(calibration, serial=None).to_json(), "utf-8")
    assert len(read_results(str(path), accelcal.Calibration).of_serial("Z").results) == 1


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["report", "cal.json"], "nothing to write"),
        (["report", "cal.json", "-o", "x.doc"], "ends in none of .html, .md, .pdf"),
        (["report", "cal.json", "-o", "cal.json"], "is a file to be read"),
        (["report", "nosuch.json", "-o", "x.html"], "no such file"),
        (["report", "cal.json", "-o", "x.html", "--serial", "Z"], "no serial 'Z'"),
        (["report", "cal.json", "-o", "x.html", "--data", "cal.json"], "leave --data out"),
        (["report", "model.json", "-o", "x.html", "--spec", "x"], "leave --spec out"),
        (["report", "cal.json", "--dcc-data", "x", "-o", "x.html"], "name its file with --dcc"),
        (["fit", "table.csv", "--report", "x.doc"], "ends in none of .html, .md, .pdf"),
    ],
)
def test_what_cannot_be_done_is_one_line(folder, arguments, said, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert said in err
    assert err.count("\n") == 1


def test_a_document_of_another_sort_is_refused(tmp_path, capsys):
    (tmp_path / "x.json").write_text('{"schema": "other/1"}')
    assert main(["report", str(tmp_path / "x.json"), "-o", str(tmp_path / "x.html")]) == 2
    assert (
        "key schema: 'other/1' in place of one of accelcal/calibration/1, accel"
        in capsys.readouterr().err
    )


@pytest.mark.parametrize("package", ["jinja2", "matplotlib"])
def test_a_missing_package_is_one_line(folder, package, monkeypatch, capsys):
    real = builtins.__import__

    def without(name, *arguments, **named):
        if name.split(".")[0] == package:
            raise ImportError(name)
        return real(name, *arguments, **named)

    monkeypatch.setattr(builtins, "__import__", without)
    assert main(["report", str(folder / "cal.json"), "-o", str(folder / "no.html")]) == 2
    assert 'pip install "accelcal[report]"' in capsys.readouterr().err
    assert not (folder / "no.html").exists()


def test_a_missing_browser_is_one_line(folder, monkeypatch, capsys):
    monkeypatch.setattr("accelcal.page.render.browser", lambda: None)
    assert main(["report", str(folder / "model.json"), "-o", str(folder / "no.pdf")]) == 2
    assert "none was found" in capsys.readouterr().err


def test_forms():
    assert [form_of(name) for name in ("a.HTML", "b.md", "c.x.pdf")] == ["html", "md", "pdf"]


def test_a_check_that_warns_of_many_tables_is_told_once_at_the_top():
    plan = accelcal.TumblePlan(temperatures=(20.0, 50.0) * 6, strokes=2)
    backlash = accelcal.effect("backlash").of(1e-4)
    found = accelcal.fit(accelcal.simulate(plan=plan, effects=[backlash], seed=1))
    text = markdown(report_page(found))
    top = text[text.index("Clear these up first") : text.index("## Coefficients")]
    assert top.count("forward against back: mean") == 1
    assert "forward against back: warns of 11 other tables too: run 2, run 3, run 4" in top
    assert text[text.index("## Checks") :].count("forward against back: mean") == 12
