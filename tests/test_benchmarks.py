"""Each benchmark runs, and prints the figures that it is there for."""

import re
import runpy
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"


def run(name, *arguments):
    """In a process of its own, as those that have workers or measure processes need it."""
    done = subprocess.run(
        [sys.executable, BENCHMARKS / name, *arguments], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture
def call(monkeypatch, capsys):
    """Run a benchmark here: it does the same, and starts no Python."""
    monkeypatch.setattr(sys, "path", [str(BENCHMARKS), *sys.path])

    def called(name, *arguments):
        monkeypatch.setattr(sys, "argv", [name, *arguments])
        code = None
        with warnings.catch_warnings(action="default"):
            try:
                runpy.run_path(str(BENCHMARKS / name), run_name="__main__")
            except SystemExit as end:
                code = end.code
        assert not code
        return capsys.readouterr().out

    yield called
    for shared in ("tumble", "compare"):
        sys.modules.pop(shared, None)


def test_coverage():
    printed = run("coverage.py", "--smoke", "--only", "head 2e-5 declared", "--jobs", "1")
    coverage = re.search(r"M_ip\n([ .\d]+)\n", printed)[1].split()
    assert len(coverage) == 6
    # of 60 intervals at 95 %, fewer than 47 hold the truth once in a million tries
    assert all(100.0 * 47 / 60 <= float(figure) <= 100.0 for figure in coverage)


def test_startup():
    printed = run("startup.py", "--smoke")
    assert re.search(r"import numpy, click +\d+\.\d\d +\d+\.\d\d", printed)


def test_apply():
    printed = run("apply.py", "--smoke")
    assert re.search(r"1000 samples.*\nwall \d+\.\d+ s, CPU \d+\.\d+ s, peak \d+ MiB", printed)


def test_apply_coverage(call):
    printed = call("apply_coverage.py", "--smoke")
    assert len(re.findall(r"^\| all declared.*(?:\| [\d.]+ \([\d.]+\) ){4}\|$", printed, re.M)) == 1


def test_levels_coverage(call):
    printed = call("levels_coverage.py", "--smoke")
    share = r"[\d.]+ \([\d.]+\)"
    row = rf"^\| laws; 3 levels(?: \| {share} \| {share} \| \d+){{2}} \|$"
    assert len(re.findall(row, printed, re.M)) == 1


def test_apply_triad_coverage(call):
    printed = call("apply_triad_coverage.py", "--smoke")
    shares = re.findall(r"^\| 8 known \| [\d :]+ \| 0 \| ([\d.]+) \| [\d.]+ \|$", printed, re.M)
    assert len(shares) == 2
    assert all(float(share) > 75.0 for share in shares)


def test_triad(call):
    printed = call("triad.py", "--smoke")
    told = re.search(
        r"^\| six faces \| 3 \| 0.001 \| 1e-05 \| 0 \| ([\d.]+) \| ([\d.]+) ", printed, re.M
    )
    assert float(told[1]) >= 75.0
    assert float(told[2]) < 5.0


def test_damaged_files():
    printed = run("damaged_files.py", "--smoke", "--jobs", "1")
    *_, refused, told, harmless, wrong, fault = printed.split("**all**")[1].replace("|", "").split()
    assert int(refused) > 0 < int(told)
    assert int(harmless) > 0
    assert (wrong, fault) == ("0", "0")


def test_static_effects():
    printed = run("static_effects.py", "--smoke", "--jobs", "1")
    row = re.search(
        r"^\| scale-factor-asymmetry .* 2 of 2 \| (\d+) \(\d+\) \| (\d+) \(", printed, re.M
    )
    assert int(row[2]) < int(row[1]) / 4


def test_stability_coverage(call):
    printed = call("stability_coverage.py", "--smoke")
    assert len(re.findall(r"^.{24}(?: +[01]\.\d{3}){3} +[\d.]+$", printed, re.MULTILINE)) == 10
    assert re.search(r"^coefficient K, instants +[01]\.\d{3}$", printed, re.MULTILINE)


def test_stand_budget(call):
    printed = call("stand_budget.py", "--smoke")
    ratios = re.search(r"^closed-form +(.*)$", printed, re.MULTILINE)[1].split()
    assert len(ratios) == 10
    # of 40 tests the spread is known to 11 %, and off by five times that once in a million
    assert all(0.45 < float(ratio) < 1.55 for ratio in ratios)


def test_stand_of_the_paper(call):
    printed = call("stand_budget.py", "--paper")
    found = re.findall(r"^(\w.{30}) ((?: +[\d.]+){10})$", printed, re.MULTILINE)
    sizes = {name.strip(): [float(size) for size in row.split()] for name, row in found}
    assert len(sizes) == 14
    # the face makes 98 % of the variance of delta, of which a hundredth is left: 0.02 + 0.0098
    ratio = sizes["face ten times better"][4] / sizes["as it is"][4]
    assert 0.15 < ratio < 0.2


def test_temperature():
    printed = run("temperature.py", "--smoke", "--jobs", "1")
    lowest = re.findall(r"(?:laws|tables|h_T) [\d.]+ \(([\d.]+) to", printed)
    assert len(lowest) == 6
    # of 40 intervals at 95 %, fewer than 29 hold the truth once in a million tries
    assert all(float(share) >= 100.0 * 29 / 40 for share in lowest)


def test_choices():
    printed = run("coverage.py", "--smoke", "--choices", "--jobs", "1")
    lines = re.findall(r"^ +([01]\.\d\d) +([\d.]+) +([\d.]+) +([\d.]+)$", printed, re.MULTILINE)
    shares = [tuple(map(float, line)) for line in lines]
    assert [share for share, *_ in shares] == 2 * [*np.arange(0.0, 0.95, 0.1).round(1), 0.95, 1.0]
    # where one source is all there is, all intervals are Student's or normal; of 12000 the share
    # is known to 0.2
    assert all(94.0 < held < 96.0 for share, *row in shares if share in (0.0, 1.0) for held in row)
    assert all(counted > 93.0 for *_, counted in shares)


# of 30 intervals at 95 %, fewer than 24 hold the truth six times in ten thousand tries, and of 30
# units more than 3 have a jump at 1 % twice
FEWEST_HELD, MOST_NAMED = 100.0 * 24 / 30, 100.0 * 3.5 / 30


def test_history(call):
    printed = call("history.py", "--smoke")
    lines = re.findall(
        r"^ +\d+ +[\d.]+ +[\d.]+ +(?:no|5x(?: true)?)  normal +([\d.]+) +[\d.]+ +[\d.]+ +([\d.]+)$",
        printed,
        re.M,
    )
    assert len(lines) == 3
    assert all(float(held) >= FEWEST_HELD and float(named) <= MOST_NAMED for held, named in lines)


def test_history_of_units_that_wander(call):
    printed = call("history.py", "--wandering", "--smoke")
    cells = r" +([\d.]+)" * 4
    lines = re.findall(rf"^ +(\d+) +(\d+){cells}$", printed, re.M)
    still, walking = lines
    assert still[1] == "0" != walking[1]
    assert float(still[2]) >= FEWEST_HELD
    assert all(float(of_a_walk) >= FEWEST_HELD for _, _, _, of_a_walk, *_ in lines)
    assert float(still[-1]) <= MOST_NAMED < float(walking[-1])


def test_history_of_campaigns(call):
    printed = call("history.py", "--campaigns", "--smoke")
    ((held, named),) = re.findall(r"^ +8 +40 +([\d.]+) +([\d.]+)$", printed, re.M)
    assert float(held) >= FEWEST_HELD
    assert float(named) <= MOST_NAMED


def test_history_of_jumps_that_return(call):
    printed = call("history.py", "--returns", "--smoke")
    ((named, other),) = re.findall(r"^ +8 +1000 +([\d.]+) +([\d.]+)$", printed, re.M)
    assert float(named) >= 70.0
    assert float(other) <= MOST_NAMED


def test_history_of_units_that_settle(call):
    printed = call("history.py", "--settling", "--smoke")
    (noted,) = re.findall(r"^ +8 +300(?: +[\d.]+){3} +([\d.]+)$", printed, re.M)
    assert float(noted) >= 70.0


def test_gates():
    printed = run("gates.py", "--smoke", "--jobs", "1")
    clean = re.findall(r"^    (\w[\w ]*\w) +([\d.]+)$", printed, re.MULTILINE)
    unlike = re.findall(r"^  std of .* ug ((?: +[\d.]+ \( *[\d.]+\)){4})$", printed, re.MULTILINE)
    found = re.findall(
        r"^  (\w.*\w) +([\d.]+) +([\d.]+)  (drift|closure|outlier)", printed, re.MULTILINE
    )
    assert {"drift", "resolution", "any gate"} <= {name for name, _ in clean}
    # of 60 tables at 1 %, more than 6 alarm once in a million tries
    assert all(float(rate) <= 100.0 * 6 / 20 for name, rate in clean if name != "any gate")
    assert len(unlike) == 3
    with_std = [float(rate) for row in unlike for rate in re.findall(r"([\d.]+) \(", row)]
    # of 10 tables more than 2 once in ten thousand tries
    assert all(rate <= 100.0 * 2 / 10 for rate in with_std)
    rates = {fault: float(rate) for fault, rate, _, _ in found}
    assert rates["warm-up 1e-4 g, 900 s"] == rates["one reading 40 ug off"] == 100.0


def figures(printed, section, method):
    """Cells of the first line of a method in a section."""
    part = printed.split(f"\n## {section}")[1].split("\n## ")[0]
    line = re.search(rf"^\| {re.escape(method)} \|(.*)\|$", part, re.MULTILINE)
    return [cell.strip() for cell in line[1].split("|")]


def test_discovery():
    printed = run("discovery.py", "--smoke", "--jobs", "1")
    for method in ("accelcal discover", "EBIC stepwise", "BIC stepwise", "LassoCV", "STLSQ"):
        for section in ("Clean", "One", "Several", "Outside", "Invisible", "Held-out", "Faults"):
            assert figures(printed, section, method), (section, method)
    assert figures(printed, "Invisible", "accelcal discover")[0].startswith("0/")
    closed = float(figures(printed, "Held-out", "accelcal discover")[0].removesuffix(" %"))
    assert closed > 90.0
    clean = figures(printed, "One run, clean", "accelcal discover")
    assert re.fullmatch(r"[01]/1 .*", clean[1])
    assert int(clean[1][0]) <= int(clean[0][0])
    assert figures(printed, "One run, one hidden effect, noise iid", "accelcal discover")


def test_discovery_knows_which_method_is_not_installed(monkeypatch):
    from rivals import methods

    monkeypatch.setattr(methods, "find_spec", lambda _: None)
    assert not methods.is_installed("LassoCV")
    assert methods.is_installed("EBIC stepwise")


def discovery_case(kind, design):
    from rivals.cases import Case

    return Case("one", kind, design, "iid", 8.0, 0)


def test_right_names_of_a_hidden_effect_are_those_of_its_class():
    from rivals.trial import truth_of

    eight, _, _ = truth_of(discovery_case("fourth-order", "three"), 1)
    assert eight.are_right(("scale-factor-asymmetry",))
    assert not eight.are_right(("scale-factor-asymmetry", "backlash"))
    assert not eight.are_right(())
    twelve, _, _ = truth_of(discovery_case("fourth-order", "twelve"), 1)
    assert not twelve.is_right_of_any("scale-factor-asymmetry")
    assert twelve.are_right(("fourth-order",))


def test_stepwise_takes_the_column_that_is_there():
    from rivals.methods import answer
    from rivals.trial import truth_of

    _, record, _ = truth_of(discovery_case("backlash", "three"), 1)
    for method in ("EBIC stepwise", "BIC stepwise"):
        assert answer(method, record).names[0] == "backlash"


def test_stand():
    printed = run("stand.py", "--smoke", "--only", "both", "--only", "gain", "--jobs", "1")
    line = re.search(
        r"^s = 4 +1 stands: .*stand's +([\d.]+), unit's +([\d.]+),", printed, re.MULTILINE
    )
    assert line.groups() == ("100.0", "100.0")
    ratios = re.findall(r"^  K2 +([\d.]+) +[\d.]+   rms", printed, re.MULTILINE)
    assert ratios
    assert all(float(ratio) <= 1.001 for ratio in ratios)


def test_batch():
    pytest.importorskip("lmfit")
    pytest.importorskip("statsmodels")
    printed = run("batch.py", "--smoke")
    for rival in ("numpy.linalg.lstsq", "statsmodels OLS", "lmfit", "statsmodels RLM, 10 iter"):
        ratio = re.search(rf"^{re.escape(rival)}.* ([\d.e+]+)$", printed, re.MULTILINE)[1]
        assert float(ratio) > 1.0


@pytest.mark.parametrize("path", sorted(BENCHMARKS.glob("*.py")), ids=lambda path: path.name)
def test_each_benchmark_is_known_here(path):
    runnable = "__main__" in path.read_text("utf-8")
    assert not runnable or f'"{path.name}"' in Path(__file__).read_text("utf-8")


def test_design(call):
    printed = run("design.py", "--smoke")
    worst = re.search(r"^declared: 22 figures, worst ([\d.]+) % off", printed, re.MULTILINE)[1]
    # a standard deviation of 60 draws is uncertain by 9.1 %; 40 % off is 4.4 times as much
    assert float(worst) < 40.0
    printed = call("design.py", "--harmonics")
    seen = re.findall(r"^(\d+) +1 +([\d.]+)", printed, re.MULTILINE)
    assert seen == [(n, "14.14") for n in ("6", "8", "12", "24", "36")]


def test_archives():
    printed = run("archives.py", "--smoke")
    assert re.search(
        r"^\| batch to Parquet \| \d+ \| (\d+|not installed)( \| \d+ %){3} \|$",
        printed,
        re.MULTILINE,
    )
    assert "the same bytes: yes" in printed
    assert "## 20 files of which 5 % of the rows are missing" in printed
    assert re.search(
        r"^\| batch of the CSV \| [\d.]+ \| \d+ % \| \d+ MiB \|$", printed, re.MULTILINE
    )


def test_head(call):
    printed = call("head.py", "--smoke")
    told = re.findall(
        r"^delta_ip +rms error +[\d.]+ -> +[\d.]+  factor +([\d.]+) .* ([\d.]+) %  U .*$",
        printed,
        re.M,
    )
    assert len(told) == 14
    # of 12 intervals at 95 %, fewer than 7 hold the truth once in a million tries
    assert all(float(held) >= 100.0 * 7 / 12 for _, held in told)
    assert min(float(factor) for factor, _ in told[-3:]) > 1.5
    harmonics = call("head.py", "--harmonics")
    assert re.search(r"^  mean .* 0 %  cannot be told apart from M$", harmonics, re.MULTILINE)


def test_coverage_of_comparisons_runs(call):
    printed = call("compare.py", "--smoke", "--only", "one head, the other side")
    assert [line.split("  ")[0] for line in printed.splitlines()[2:]] == [
        "one head, the other side",
        "* one head, the other side, not told",
    ]


def test_false_alarms_of_two_calibrations_run(call):
    printed = call("two_calibrations.py", "--smoke", "--only", "one head, the other side")
    rows = [line.split() for line in printed.splitlines()[2:]]
    assert len(rows) == 2
    # the misalignment of the other side is not compared
    assert all(row[-7] == "-" and float(row[-1]) >= 40.0 for row in rows)
    printed = call("two_calibrations.py", "--smoke", "--only", "size of backlash")
    assert "with |E_n| > 1" in printed.splitlines()[2]
