"""Budget of a stand: Monte Carlo, the inverse question, the data sheet, files and the command."""

import csv
import io
import json
import math
import re
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from accelcal.accelerometer import AL15
from accelcal.cli.main import main
from accelcal.errors import DocumentError, InputError, TableError
from accelcal.io.toml.specification import read_specification
from accelcal.io.toml.stand import read_stand
from accelcal.results.stand_budget import StandBudget
from accelcal.simulation import NOISE_FREE, TumblePlan, simulate
from accelcal.stand_uncertainty.budget import stand_budget
from accelcal.stand_uncertainty.kinds import KINDS
from accelcal.stand_uncertainty.monte_carlo import numerical_tolerance
from accelcal.stand_uncertainty.stand import Distribution, Stand, StandComponent

EXAMPLES = Path(__file__).parents[1] / "examples"
PAPER = EXAMPLES / "paper-stand.toml"
DATA_SHEET = EXAMPLES / "al15.toml"


def made(**plan):
    return simulate(AL15, TumblePlan(**plan, timed=True), NOISE_FREE, seed=0)


def component(kind, u, shape="normal", name=None, **rest):
    return StandComponent(name or kind, kind, Distribution(shape, u), KINDS[kind].varies, **rest)


# -- Monte Carlo -----------------------------------------------------------------------------------


def test_monte_carlo_agrees_with_the_linear_budget_within_sampling_error():
    parts = tuple(
        component(kind, u)
        for kind, u in (
            ("head-position", 1e-5),
            ("voltmeter-gain", 2e-5),
            ("chamber-temperature", 0.05),
            ("reading-noise", 5e-6),
            ("launch-bias", 8e-6),
            ("foundation-daily", 5e-6),
            ("fixture-angle", 2e-5),
        )
    )
    trials = 20_000
    found = stand_budget(Stand("normal", parts), made(), trials=trials, seed=1)
    tried = found.monte_carlo
    assert tried.trials == trials
    ratio = tried.standard_uncertainty / found.standard_uncertainty
    assert np.abs(ratio - 1.0).max() < 4.5 / math.sqrt(2.0 * trials)
    off = np.abs(tried.value - found.nominal) / found.standard_uncertainty
    assert off.max() < 5.0 / math.sqrt(trials)
    ends = (tried.upper - tried.lower) / (2.0 * found.expanded_uncertainty)
    assert ends == pytest.approx(1.0, abs=0.04)


def test_a_rectangular_error_alone_has_the_interval_of_its_limits():
    face = component("fixture-angle", 1e-4 / math.sqrt(3.0), "rectangular")
    found = stand_budget(Stand("face", (face,)), made(), trials=20_000, seed=2)
    place, tried = found.index("delta"), found.monte_carlo
    width = 0.5 * (tried.upper - tried.lower)[place]
    assert width == pytest.approx(0.95e-4, rel=0.01)
    assert found.expanded_uncertainty[place] == pytest.approx(1.96e-4 / math.sqrt(3.0), rel=1e-3)
    assert not tried.agrees[place]
    assert "NO" in str(found)


def test_monte_carlo_finds_the_second_order_that_the_linear_budget_lacks():
    limit = 0.02
    level = component("shaft-tilt", limit / math.sqrt(3.0), "rectangular")
    found = stand_budget(Stand("level", (level,)), made(), trials=20_000, seed=3)
    place = found.index("K1")
    shift = found.monte_carlo.value[place] / found.nominal[place] - 1.0
    assert shift == pytest.approx(-(limit**2) / 6.0, rel=0.05)  # -e^2/2 of the mean e^2
    assert found.standard_uncertainty[place] < 1e-6
    assert not found.monte_carlo.agrees[place]


def test_few_degrees_of_freedom_widen_both_intervals():
    part = StandComponent("gain", "voltmeter-gain", Distribution("normal", 1e-5, 5.0))
    found = stand_budget(Stand("few", (part,)), made(), trials=50_000, seed=4)
    place = found.index("K1")
    tried = found.monte_carlo
    width = 0.5 * (tried.upper - tried.lower)[place]
    assert found.expanded_uncertainty[place] == pytest.approx(2.5706 * 1.35e-5, rel=1e-4)
    assert width == pytest.approx(found.expanded_uncertainty[place], rel=0.05)


def test_trials_stop_where_the_result_is_stable():
    stand = Stand("noise", (component("launch-bias", 2e-6), component("voltmeter-gain", 2e-6)))
    test = made(temperatures=(20.0,), strokes=1)
    found = stand_budget(stand, test, trials=None, seed=5).monte_carlo
    assert found.stable
    assert 20_000 <= found.trials < 1_000_000
    assert (found.numerical <= found.tolerance / 5.0 + 1e-30).all()
    short = stand_budget(stand, test, trials=1000, seed=5)
    assert not short.monte_carlo.stable
    assert "make more trials" in " ".join(short.warnings)


def test_a_seed_repeats_the_trials():
    stand = Stand("noise", (component("launch-bias", 2e-6),))
    one, two, other = (stand_budget(stand, made(), trials=1000, seed=s) for s in (1, 1, 2))
    assert one.monte_carlo.lower.tolist() == two.monte_carlo.lower.tolist()
    assert one.monte_carlo.lower.tolist() != other.monte_carlo.lower.tolist()


def test_numerical_tolerance_is_half_of_the_first_digit():
    found = numerical_tolerance(np.array([0.0, 9.9e-6, 1.0e-5]))
    assert found == pytest.approx([0.0, 0.5e-6, 0.5e-5])


@pytest.mark.parametrize("trials", [10, 10_000_000])
def test_too_few_and_too_many_trials_are_refused(trials):
    with pytest.raises(InputError, match="from 1000 to 1000000"):
        stand_budget(read_stand(PAPER), made(), trials=trials)


# -- the inverse question --------------------------------------------------------------------------


def pair(**rest):
    """Voltmeter 3 ppm and load 4 ppm: 5 ppm of K1 together; the launch is fixed."""
    parts = (
        component("voltmeter-gain", 3e-6, name="voltmeter"),
        component("resistor-tolerance", 4e-6, name="load"),
        component("launch-scale-factor", rest.pop("launch", 0.0), name="launch", fixed=True),
        component("shaft-tilt", 1e-9, name="level"),
    )
    return stand_budget(Stand("pair", parts), made(), **rest)


def instruments(budget):
    return {item.name: item for item in budget.requirements.instruments}


def test_each_instrument_alone_may_take_what_the_others_leave():
    found = pair(targets={"K1": f"{1.959964 * 4.5} ppm"})
    target = found.requirements.targets[0]
    assert not target.reached
    assert target.reachable
    assert target.present == pytest.approx(1.959964 * 5e-6 * 1.35, rel=1e-6)
    assert target.floor == 0.0
    need = instruments(found)
    assert set(need) == {"voltmeter", "load", "level"}  # the launch is fixed
    assert need["voltmeter"].alone == pytest.approx(math.sqrt(4.5**2 - 4.0**2) * 1e-6, rel=1e-5)
    assert need["load"].alone == pytest.approx(math.sqrt(4.5**2 - 3.0**2) * 1e-6, rel=1e-5)
    assert need["load"].limited_by == "K1"


def test_allocations_share_equally_or_in_proportion():
    need = instruments(pair(targets={"K1": f"{1.959964 * 10.0} ppm"}))
    for name in ("voltmeter", "load"):
        assert need[name].equal_shares == pytest.approx(10e-6 / math.sqrt(2.0), rel=1e-5)
    assert need["voltmeter"].proportional == pytest.approx(6e-6, rel=1e-5)
    assert need["load"].proportional == pytest.approx(8e-6, rel=1e-5)
    assert need["level"].equal_shares is None
    assert need["level"].alone is None  # it does not matter within a hundred times


def test_what_fixed_components_leave_is_the_floor():
    found = pair(launch=6e-6, targets={"K1": "10 ppm"})
    target = found.requirements.targets[0]
    assert target.floor == pytest.approx(1.959964 * 6e-6 * 1.35, rel=1e-6)
    assert not target.reachable
    assert target.held_up_by == ("launch",)
    assert instruments(found)["load"].alone == 0.0
    assert instruments(found)["load"].equal_shares is None
    assert "out of reach: held up by launch" in str(found)


@pytest.mark.parametrize("allocation", ["equal_shares", "proportional"])
def test_an_allocation_keeps_its_targets(allocation):
    stand, targets = read_stand(PAPER), {"K1": "40 ppm", "k2": "20 ug", "delta": "30 urad"}
    need = instruments(stand_budget(stand, made(), targets=targets))
    factors = [
        (getattr(need[p.name], allocation) or need[p.name].present) / need[p.name].present
        if p.name in need
        else 1.0
        for p in stand.components
    ]
    better = stand_budget(stand.scaled(factors), made(), targets=targets)
    parts = [t.present / t.target for t in better.requirements.targets]
    assert max(parts) == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize(
    ("targets", "told"),
    [
        ({}, "no targets"),
        ({"K9": "5 ppm"}, "'K9' is not budgeted"),
        ({"K1": "5 kg"}, "K1 is in mA/g; write a number above zero with mA/g, %, ppm, ppb, as in"),
        ({"K1": "1e-5"}, "K1 is in mA/g; write a number above zero with mA/g"),
        ({"K1": "5 ppm/g"}, "K1 is in mA/g; write"),
        ({"K3": "5 ppm"}, r"with mA/g\^3, as in K3=1e-5 mA/g\^3"),
        ({"k0": "5 ppm"}, "k0 is in g; write a number above zero with g, mg, ug, ng or none"),
        ({"k0": "5"}, "has no unit, and k0 is in g: it is too large"),
        ({"k0": "1.2.3 ug"}, "write a number above zero"),
        ({"k0": "-5 ug"}, "write a number above zero"),
        ({"k0": -5e-6}, "finite number above zero"),
        ({"k0": math.nan}, "finite number above zero"),
        ({"lam1": "5 ug/h"}, "lam1 is in g/degC; write .* as in lam1=2ug/degC"),
    ],
)
def test_targets_that_mean_nothing_are_refused(targets, told):
    with pytest.raises(InputError, match=told):
        stand_budget(read_stand(PAPER), made(), targets=targets)


@pytest.mark.parametrize(
    ("symbol", "given", "size"),
    [
        ("k0", "5 \u00b5g", 5e-6),
        ("K1", "10 ppm", 13.5e-6),
        ("K1", "2e-5 mA/g", 2e-5),
        ("K1", 2e-5, 2e-5),
        ("k0", "10ug", 1e-5),
        ("k2", "10 ug/g^2", 1e-5),
        ("delta", "2 arcsec", 2 * math.pi / 648000),
        ("lam1", "0.5 ug/degC", 0.5e-6),
        ("lam1", "0.5 ug/K", 0.5e-6),
        ("lam1", "0.5 ug/\u00b0C", 0.5e-6),
        ("k2", "10 ug/g\u00b2", 1e-5),
        ("k0", "1e-5", 1e-5),
        ("K3", "1e-5 mA/g3", 1e-5),
        ("beta2", "1ppm", 1e-6),
        ("K3", "1e-5 mA/g^3", 1e-5),
    ],
)
def test_targets_have_units(symbol, given, size):
    found = stand_budget(read_stand(PAPER), made(), targets={symbol: given})
    assert found.requirements.targets[0].target == pytest.approx(size)


def test_targets_of_changes_have_units():
    targets = {"k0 change": "20 ug", "K1 change": "5 ppm"}
    found = stand_budget(read_stand(PAPER), made(temperatures=(20.0, 60.0, 20.0)), targets=targets)
    assert [t.target for t in found.requirements.targets] == pytest.approx([20e-6, 5e-6])


# -- data sheet ------------------------------------------------------------------------------------


def test_limits_are_held_against_the_uncertainty():
    spec = read_specification(DATA_SHEET)
    found = stand_budget(read_stand(PAPER), made(), specification=spec)
    limits = {limit.name: limit for limit in found.data_sheet}
    bias, place = limits["bias"], found.index("k0")
    assert bias.expanded_uncertainty == pytest.approx(1e3 * found.expanded_uncertainty[place])
    assert bias.verdict == "suffices"
    assert limits["scale_factor"].limit == pytest.approx(0.15)
    assert limits["scale_factor_stability"].verdict == "not told by this test"
    assert "operating_temperatures" not in limits
    worst = max(found.expanded_uncertainty[found.index(f"lam{side}")] for side in (1, 2))
    sensitivity = limits["bias_temperature_sensitivity"]
    assert sensitivity.expanded_uncertainty == pytest.approx(1e6 * worst)


def test_changes_from_run_to_run_count_the_stand_alone():
    spec = read_specification(DATA_SHEET)
    test = made(temperatures=(20.0, 20.0))
    found = stand_budget(read_stand(PAPER), test, specification=spec)
    limits = {limit.name: limit for limit in found.data_sheet}
    room = next(p for p in found.components if p.name == "room")
    digit = next(p for p in found.components if p.name == "voltmeter-digit")
    place = found.index("K1 change")
    expected = 1.959964e6 * math.hypot(room.contributions[place], digit.contributions[place])
    stability = limits["scale_factor_stability"]
    assert stability.expanded_uncertainty == pytest.approx(expected, rel=1e-3)
    assert stability.ratio == pytest.approx(100.0 / expected, rel=1e-3)


@pytest.mark.parametrize(
    ("U", "verdict"), [(1.0, "suffices"), (1.3, "suffices"), (2.0, "guard band"), (9.0, "does not")]
)
def test_four_to_one_suffices(U, verdict):
    spec = read_specification(DATA_SHEET)
    found = stand_budget(read_stand(PAPER), made(), specification=spec).data_sheet[0]
    assert replace(found, limit=5.2, expanded_uncertainty=U).verdict.startswith(verdict)


# -- files -----------------------------------------------------------------------------------------

SMALL = """
schema = "accelcal/stand/1"
name = "small"
[conditions]
load_resistor_ohm = 700
voltmeter_ranges_V = [1, 0.1]
[components.head]
kind = "head-position"
distribution = "normal"
half_width = 2
factor = 2
unit = "arcsec"
varies = ["position", "run"]
"""


def test_a_stand_is_read():
    found = read_stand(StringIO(SMALL))
    (head,) = found.components
    assert head.distribution.standard == pytest.approx(math.pi / 648000)
    assert head.varies == ("position", "run")
    assert found.conditions.ranges == (1.0, 0.1)
    common = read_stand(StringIO(SMALL.replace('["position", "run"]', '"never"')))
    assert common.components[0].varies == ()
    for unit in ("Winkelsekunden", "\u2033", "угл. с"):
        assert read_stand(StringIO(SMALL.replace('"arcsec"', f'"{unit}"'))) == found
    usual = read_stand(StringIO(SMALL.replace('varies = ["position", "run"]', "")))
    assert usual.components[0].varies == ("position",)


@pytest.mark.parametrize(
    ("kind", "unit", "size"),
    [
        ("head-position", "\u00b5rad", 1e-6),
        ("head-position", "mm/s", None),
        ("foundation-drift", "Bogensekunden/day", math.pi / 648000),
        ("foundation-drift", "arcsec/d", math.pi / 648000),
        ("foundation-drift", "\u00b5rad / h", 24e-6),
        ("foundation-drift", "arcsec", None),
        ("chamber-temperature", "\u00b0C", 1.0),
        ("launch-bias", "micro-g", 1e-6),
        ("launch-bias", "mm/s^2", None),
        ("launch-bias", "m/s\u00b2", 1.0 / 9.81),
        ("head-position", "mGal", 1e-5 / 9.81),
        ("resistor-tolerance", "percent", 1e-2),
        ("voltmeter-offset", "microvolts", 1e-6),
        ("voltmeter-offset", "MV", None),
    ],
)
def test_units_of_a_stand_are_those_of_header_lines(kind, unit, size):
    """Their names alone were taken."""
    text = SMALL.replace("[conditions]", "[conditions]\ngravity_m_per_s2 = 9.81")
    text = re.sub("varies = .*", "", text.replace('"head-position"', f'"{kind}"'))
    text = text.replace("half_width = 2", "half_width = 2e-6").replace("arcsec", unit)
    if size is None:
        with pytest.raises(TableError, match=r"components.head: unit .* is none of an? .*; use"):
            read_stand(StringIO(text))
        return
    (found,) = read_stand(StringIO(text)).components
    assert found.distribution.standard == pytest.approx(1e-6 * size)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            '"accelcal/stand/1"',
            '"accelcal/stand/2"',
            "schema 'accelcal/stand/2' is unknown; write schema = 'accelcal/stand/1'",
        ),
        ("load_resistor_ohm", "load_ohm", "conditions: key 'load_ohm' is unknown"),
        ("load_resistor_ohm = 700", 'load_resistor_ohm = "700"', "load_resistor_ohm is '700'"),
        ("load_resistor_ohm = 700", "load_resistor_ohm = -700", "load is -700"),
        ("[1, 0.1]", '[1, "0.1"]', "it is a list of numbers"),
        ("factor = 2", "facter = 2", "components.head: key 'facter' is unknown"),
        ("factor = 2", "", "components.head: half_width of a normal distribution needs"),
        ("half_width = 2", "half_width = -2", "components.head: half_width is -"),
        ("half_width = 2", "half_width = nan", "half_width is nan"),
        ("half_width = 2", "half_width = true", "half_width is True; it is a number"),
        ('"arcsec"', '"kg"', "unit 'kg' is none of an angle"),
        ('"arcsec"', '"m/s^2"', "unit 'm/s^2' needs the local gravity; add gravity_m_per_s2 to"),
        ('unit = "arcsec"', "", "components.head: key 'unit' is missing"),
        ('"normal"', '"gaussian"', "distribution 'gaussian' is unknown"),
        ('"head-position"', '"head"', "kind 'head' is unknown"),
        ('["position", "run"]', '"cycle"', "varies by 'cycle'"),
        ('["position", "run"]', "[1]", "varies is [1]"),
        ("factor = 2", "factor = 2\norder = 2", "order goes with kind head-harmonic"),
        ("[components.head]", "[[components.head]]", "make it a table"),
        ("name =", "nome =", "key 'nome' is unknown"),
        ("name =", "name", ":3: not TOML"),
    ],
)
def test_a_faulty_stand_is_one_line(old, new, told):
    assert old in SMALL
    with pytest.raises(TableError) as caught:
        read_stand(StringIO(SMALL.replace(old, new, 1)))
    message = str(caught.value)
    assert told in message
    assert message.count("\n") == 0
    assert "; " in message


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*-stand.toml")), ids=lambda p: p.name)
def test_examples_tell_where_their_figures_come_from(path):
    for part in read_stand(path).components:
        assert part.origin.startswith(("paper", "ASSUMED", "EXAMPLE")), part.name


# -- the command -----------------------------------------------------------------------------------


def run(capsys, *arguments):
    code = main(["budget", "--stand", str(PAPER), *arguments])
    return code, capsys.readouterr()


def test_the_command_tells_components_and_coefficients(capsys):
    code, told = run(capsys)
    assert code == 0
    assert "Budget of the stand: stand of the paper" in told.out
    assert "Systematic and unseen: chamber, load" in told.out
    assert "Below 0.1 % of every u here: level." in told.out
    assert told.out.isascii()


def test_a_budget_comes_back_from_json():
    spec = read_specification(DATA_SHEET)
    asked = [
        {},
        {"trials": 1000, "seed": 1},
        {"targets": {"k0": "10 ug", "K1": "10 ppm"}, "specification": spec},
    ]
    for options in asked:
        found = stand_budget(read_stand(PAPER), made(), **options)
        again = StandBudget.from_json(found.to_json())
        assert again == found
        assert again.to_json() == found.to_json()


def test_a_damaged_budget_is_refused():
    document = stand_budget(read_stand(PAPER), made()).to_document()
    document["components"][0]["contributions"] = [1e-6]
    with pytest.raises(DocumentError, match="key components: no number for each coefficient"):
        StandBudget.from_document(document)


def test_the_command_writes_json_and_csv(capsys, tmp_path):
    code, told = run(capsys, "--format", "json", "--monte-carlo", "1000", "--seed", "1")
    assert code == 0
    document = json.loads(told.out)
    assert document["schema"] == "accelcal/stand-budget/1"
    assert document["monte_carlo"] == {"trials": 1000, "seed": 1, "stable": False}
    assert len(document["covariance"]) == len(document["coefficients"])
    assert str(StandBudget.from_document(document)).startswith("Budget of the stand")
    path = tmp_path / "budget.json"
    assert run(capsys, "-o", str(path), "--format", "csv")[0] == 0
    assert json.loads(path.read_text("utf-8"))["coefficients"][1]["symbol"] == "K1"
    rows = list(csv.DictReader(io.StringIO(run(capsys, "--format", "csv")[1].out)))
    assert {row["component"] for row in rows} >= {"head", "voltmeter", "total"}
    totals = [row for row in rows if row["component"] == "total"]
    assert len(totals) == len(document["coefficients"])
    assert float(totals[1]["expanded_uncertainty"]) == pytest.approx(
        document["coefficients"][1]["expanded_uncertainty"]
    )
    load = next(r for r in rows if r["component"] == "load" and r["coefficient"] == "K1")
    assert float(load["sensitivity"]) == pytest.approx(1.35, rel=1e-6)
    tried = run(capsys, "--format", "csv", "--monte-carlo", "1000", "--seed", "1")[1].out
    total = [r for r in csv.DictReader(io.StringIO(tried)) if r["component"] == "total"][1]
    assert float(total["monte_carlo_low"]) < 1.35 < float(total["monte_carlo_high"])
    assert total["linear_agrees"] in ("True", "False")


def test_the_command_takes_test_and_calibration(capsys, tmp_path):
    calibration = tmp_path / "cal.json"
    table = str(EXAMPLES / "al15.csv")
    assert main(["fit", table, "-o", str(calibration)]) == 0
    capsys.readouterr()
    code, told = run(capsys, str(calibration), "--test", table)
    assert code == 0
    assert "162 readings" in told.out
    code, told = run(capsys, str(calibration), "--positions", "12", "--temperatures", "20")
    assert "12 positions" in told.out
    assert "lam1" not in told.out


def test_the_command_tells_targets_and_limits(capsys):
    code, told = run(
        capsys, "--target", "K1=20ppm", "--target", "k0=1ug", "--spec", str(DATA_SHEET)
    )
    assert code == 0
    assert "to be reached with better instruments" in told.out
    assert "out of reach: held up by launch" in told.out
    assert "suffices" in told.out


def test_the_command_draws_a_pareto_chart(capsys, tmp_path):
    path = tmp_path / "pareto.svg"
    assert run(capsys, "--plot", str(path))[0] == 0
    assert path.read_bytes().startswith(b"<?xml")


def test_the_chart_has_a_panel_for_each_coefficient():
    found = stand_budget(read_stand(PAPER), made())
    panels = found.plot.pareto()
    assert len(panels) == 12
    heights = [bar.get_height() for bar in panels[0].patches]
    assert heights[:5] == sorted(heights[:5], reverse=True)
    u = 1e6 * found.standard_uncertainty[found.index("K1")] / 1.35
    assert math.sqrt(sum(h**2 for h in heights)) == pytest.approx(u, rel=1e-4)
    with pytest.raises(InputError, match="axes given"):
        found.plot.pareto(panels[:3])


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--launch", "1e-5"], "--launch tells of the error of an acceleration"),
        (["--target", "K1"], "not of the form NAME=SIZE"),
        (["--target", "K1=5kg"], "write a number above zero with mA/g, %, ppm, ppb"),
        (["--monte-carlo", "many"], "is not a finite number"),
        (["--monte-carlo", "10"], "from 1000 to 1000000"),
        (["--mountings", "q"], "mounting 'q' is unknown"),
        (["--test", "a.csv", "--positions", "3"], "leave one of them out"),
        (["--positions", "12", "--angles", "0,90,180"], "--positions and --angles; give one of"),
        (["--angles", "90,270"], "do not determine"),
        (["--spec", "nosuch.toml"], "no such file"),
        (["nosuch.json"], "no such file"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(capsys, arguments, told):
    code, shown = run(capsys, *arguments)
    assert code == 2
    assert told in shown.err
    assert "Traceback" not in shown.err


def test_a_stand_without_a_load_is_named_with_its_file(capsys, tmp_path):
    path = tmp_path / "stand.toml"
    path.write_text(PAPER.read_text("utf-8").replace("load_resistor_ohm = 700.0", ""), "utf-8")
    assert main(["budget", "--stand", str(path)]) == 2
    assert capsys.readouterr().err.startswith(f"{path}: ")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ([], "neither CAL.json nor --stand"),
        (["--stand", str(PAPER), "--mounting", "p-"], "--mounting chooses from CAL.json, and none"),
        (["--stand", str(PAPER), "--serial", "A"], "--serial chooses from CAL.json, and none"),
        (["cal.json", "--seed", "1"], "add --stand STAND.toml"),
        (["--stand", str(PAPER), "--seed", "1"], "add --monte-carlo N"),
        (["--stand", str(PAPER), "--target", "K1=5ppm", "--target", "K1=6ppm"], "two targets"),
    ],
)
def test_options_that_do_not_go_together_are_refused(capsys, arguments, told):
    assert main(["budget", *arguments]) == 2
    assert told in capsys.readouterr().err
