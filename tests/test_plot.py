"""Pictures: what is drawn, that it is legible, in both themes, whatever is missing."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from io import BytesIO

import numpy as np
import pandas as pd
import pytest

import accelcal
from accelcal.errors import InputError

pytest.importorskip("matplotlib")

from accelcal.error_budget.budget import budget as budget_of
from accelcal.io.stability_record import read_stability
from accelcal.plot.stability import both
from accelcal.plot.style import DARK, LIGHT, SMALL, canvas, picture, theme
from accelcal.report.discovery import change_row
from accelcal.report.typeset import typeset
from accelcal.results.findings import Change, Share
from accelcal.results.quantity import Quantity
from accelcal.results.stand_discovery import HeadPosition, StandDiscovery, StandEffect
from accelcal.shown_units import readable
from accelcal.stability.analysis import analyse

BACKLASH = accelcal.effect("backlash").of(5e-5)
METHODS = ("residuals", "residual_map", "tumble", "temperature", "budget", "coefficients")


def axes_of(drawn):
    return list(np.ravel(np.asarray(drawn, dtype=object)))


def bare(calibration):
    """The same without any uncertainty and without three coefficients."""

    def table(old):
        nothing = Quantity(None, None, "g/g^2")
        unknown = {
            name: replace(q, standard_uncertainty=None, expanded_uncertainty=None)
            for name, q in old.error_model.items()
        }
        model = unknown | dict.fromkeys(("k2", "k3", "delta_ip"), nothing)
        return replace(old, error_model=model, budget={})

    tables = tuple(map(table, calibration.tables))
    return replace(calibration, tables=tables, temperature_model=None)


@pytest.fixture(scope="module")
def several():
    return accelcal.fit(accelcal.simulate(seed=1))


@pytest.fixture(scope="module")
def loop():
    plan = accelcal.TumblePlan(temperatures=(20.0, 60.0, 80.0, 60.0, 20.0, -40.0, 20.0))
    return accelcal.fit(accelcal.simulate(plan=plan, seed=3))


@pytest.fixture(scope="module")
def sixty():
    plan = accelcal.TumblePlan(
        temperatures=tuple(np.resize([20.0, 50.0, 80.0, 50.0], 60)), strokes=2
    )
    return accelcal.fit(accelcal.simulate(plan=plan, seed=4))


@pytest.fixture(scope="module")
def single():
    return accelcal.fit(accelcal.simulate(plan=accelcal.TumblePlan(temperatures=(20.0,)), seed=5))


@pytest.fixture(scope="module")
def found():
    record = accelcal.simulate(effects=[BACKLASH], seed=1)
    return accelcal.discover(record), record


@pytest.fixture(scope="module")
def stability():
    record = read_stability("examples/stability.csv")
    return analyse(record), record


@pytest.fixture(scope="module")
def stand(found):
    def size(value):
        return Quantity(value, 2e-6, "rad", 4e-6)

    units = tuple(f"AL-{number}" for number in range(30))
    effect = StandEffect(
        id="backlash",
        name="backlash of the head",
        verdict="stand",
        parameters={"half_width": size(5e-5)},
        p_value=1e-9,
        p_one_value=0.5,
        spread=0.1,
        sizes={unit: size(5e-5 + 1e-6 * number) for number, unit in enumerate(units)},
        found_in=(),
        indistinguishable=(),
    )
    head = tuple(HeadPosition(45.0 * k, size(1e-5 * np.sin(k))) for k in range(9))
    return StandDiscovery(units, (effect,), head, {}, found[0])


# -- legibility ------------------------------------------------------------------------------------


def shown_texts(figure):
    """Visible texts of a drawn figure with their boxes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.text import Annotation, Text

    agg = FigureCanvasAgg(figure)
    agg.draw()
    renderer = agg.get_renderer()
    drawn = {
        text
        for ax in figure.axes
        for axis in (ax.xaxis, ax.yaxis)
        for tick in axis._update_ticks()  # ticks outside of the view stay behind as texts
        for text in (tick.label1, tick.label2)
    }
    every = [t for ax in figure.axes for a in (ax.xaxis, ax.yaxis) for t in a.majorTicks]
    ticks = {text for tick in every for text in (tick.label1, tick.label2)}
    for text in figure.findobj(Text):
        told = text.get_text().strip() and text.get_visible() and not isinstance(text, Annotation)
        if told and (text in drawn or text not in ticks):
            yield text, text.get_window_extent(renderer)


def assert_legible(drawn):
    figure = axes_of(drawn)[0].figure
    texts = list(shown_texts(figure))
    assert min(text.get_fontsize() for text, _ in texts) >= SMALL
    width, height = figure.bbox.width, figure.bbox.height
    for text, box in texts:
        inside = min(box.x0, box.y0, width - box.x1, height - box.y1) > -1.0
        assert inside, f"{text.get_text()!r} is cut off"
    for i, (one, box) in enumerate(texts):
        for other, its in texts[i + 1 :]:
            across = min(box.x1, its.x1) - max(box.x0, its.x0)
            down = min(box.y1, its.y1) - max(box.y0, its.y0)
            assert min(across, down) < 1.0, f"{one.get_text()!r} over {other.get_text()!r}"


def assert_labelled(drawn):
    """Every axis of numbers has a label with its unit, or names what stands along it."""
    for ax in axes_of(drawn):
        if ax.name == "polar":
            continue
        for axis in (ax.xaxis, ax.yaxis):
            label = axis.get_label_text()
            told = [text.get_text() for text in axis.get_ticklabels()]
            named = not any(told) or any(text and not text[-1].isdigit() for text in told)
            words = ("run", "unit", "stroke", "point", "reading", "calibration", "date")
            assert (
                "[" in label or label.startswith(words) or named or not len(axis.get_ticklocs())
            ), label


@pytest.mark.parametrize(
    ("which", "name"),
    [("several", name) for name in METHODS]
    + [("sixty", name) for name in ("residuals", "residual_map", "temperature", "coefficients")]
    + [("single", name) for name in ("residual_map", "temperature", "coefficients")]
    + [("loop", "temperature")],
)
def test_calibrations_are_legible(request, which, name):
    calibration = request.getfixturevalue(which)
    drawn = getattr(calibration.plot, name)()
    assert_legible(drawn)
    assert_labelled(drawn)


NO_MATHEMATICS = r"$\frac$ 序列 A_1^2 " + 30 * "long "
"""Between dollar signs matplotlib reads mathematics, and refuses what is none; its font lacks a
letter, of which it warns."""


@pytest.mark.parametrize("name", METHODS)
def test_labels_of_runs_are_drawn_as_they_are_written(single, name):
    tables = tuple(replace(table, run=NO_MATHEMATICS) for table in single.tables)
    assert_legible(getattr(replace(single, tables=tables).plot, name)())


def test_serial_numbers_are_drawn_as_they_are_written(several, stability, stand):
    named = replace(several, serial=NO_MATHEMATICS)
    assert_legible(budget_of(named, 1.0).plot.stack())
    found, record = stability
    assert_legible(both(replace(found, serial=NO_MATHEMATICS), record))
    (effect,) = stand.effects
    effect = replace(effect, sizes={NO_MATHEMATICS: effect.sizes["AL-1"]})
    assert_legible(replace(stand, effects=(effect,)).plot.sizes())
    calibrations = [replace(named, date=f"202{year}-05-06") for year in range(3)]
    assert_legible(accelcal.history(calibrations).plot.trends())


@pytest.mark.parametrize("name", METHODS)
def test_calibrations_without_uncertainty_draw(several, name):
    assert_legible(getattr(bare(several).plot, name)())


@pytest.mark.parametrize("name", ["gap", "where", "changes"])
def test_discoveries_are_legible(found, name):
    drawn = getattr(found[0].plot, name)()
    assert_legible(drawn)
    assert_labelled(drawn)


def test_comparisons_are_legible(several):
    record = accelcal.simulate(effects=[BACKLASH], seed=2)
    compared = accelcal.compare(several, record)
    for drawn in (
        compared.plot.where(),
        compared.plot.runs(),
        compared.plot.residuals(several, record),
    ):
        assert_legible(drawn)
        assert_labelled(drawn)


def test_stability_is_legible(stability):
    result, record = stability
    for drawn in (result.plot.allan(), result.plot.record(record)):
        assert_legible(drawn)
        assert_labelled(drawn)


def test_stands_are_legible(stand):
    for drawn in (stand.plot.head(), stand.plot.sizes()):
        assert_legible(drawn)
        assert_labelled(drawn)


@pytest.mark.parametrize("points", [[0.0], [-1.0, 0.0, 1.0], np.linspace(-1, 1, 41)])
def test_budgets_are_legible(several, points):
    drawn = budget_of(several, points).plot.stack()
    assert_legible(drawn)
    assert_labelled(drawn)


# -- what is drawn ---------------------------------------------------------------------------------


def test_the_band_of_a_size_common_to_all_units_is_its_interval(stand):
    ax = stand.plot.sizes()
    low, high = ax.patches[0].get_bbox().intervaly
    assert (low, high) == pytest.approx((46.0, 54.0))  # 50 urad, of which 4 either way


def test_the_map_has_every_residual(several):
    ax = several.plot.residual_map()
    cells = ax.collections[0].get_array()
    for number, table in enumerate(several.tables):
        residuals = table.residuals
        place = list(zip(residuals.angle_deg, residuals.stroke, strict=True)).index((90.0, 2))
        assert cells[2, 6 * number + 1] == pytest.approx(1e6 * residuals.value[place])


def test_a_missing_reading_is_a_hole_in_the_map(several):
    table = several.tables[0]
    kept = {name: getattr(table.residuals, name)[1:] for name in ("angle_deg", "stroke", "value")}
    holed = replace(several, tables=(replace(table, residuals=replace(table.residuals, **kept)),))
    cells = np.ma.filled(holed.plot.residual_map().collections[0].get_array(), np.nan)
    assert np.isnan(cells).sum() == 1


def test_residual_means_are_means(several):
    ax = several.plot.residuals(run="2")
    residuals = next(table.residuals for table in several.tables if table.run == "2")
    values = [
        1e6 * value
        for angle, stroke, value in zip(
            residuals.angle_deg, residuals.stroke, residuals.value, strict=True
        )
        if angle == 180.0 and stroke % 2 == 1
    ]
    drawn = ax.containers[0][0]
    mean = drawn.get_ydata()[np.argmin(np.abs(drawn.get_xdata() - 180.0))]
    assert mean == pytest.approx(np.mean(values))


def test_readings_stand_beside_the_interval_of_their_mean(several):
    ax = several.plot.residuals()
    for side, points, bars in zip((-1, 1), ax.collections[::2], ax.containers, strict=True):
        apart = np.unique(points.get_offsets()[:, 0]) - np.unique(bars[0].get_xdata())
        assert (side * apart > 1.0).all()
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [
        "forward: readings, mean, 95 % interval",
        "back: readings, mean, 95 % interval",
    ]


@pytest.mark.parametrize("positions", [48, 72])
def test_readings_stay_clear_of_the_next_angle(positions):
    """Those of 48 positions stood at the same place as those of the next one."""
    record = accelcal.simulate(plan=accelcal.TumblePlan(positions=positions), seed=2)
    ax = accelcal.fit(record).plot.residuals(run="1")
    forward, back = (np.unique(points.get_offsets()[:, 0]) for points in ax.collections[::2])
    assert (forward[1:] - back[:-1] > 0.2 * 360.0 / positions).all()


def test_rings_round_the_turn_are_residuals_of_either_sign(several):
    ax = several.plot.tumble(run="2")
    residuals = next(table.residuals for table in several.tables if table.run == "2")
    largest = 1e6 * max(map(abs, residuals.value))
    assert ax.get_ylim() == pytest.approx((-2.2 * largest, 1.1 * largest))
    rings = np.array(ax.get_yticks())
    step = rings[rings > 0.0].min()
    assert np.abs(rings).max() <= 1.1 * largest < np.abs(rings).max() + step
    assert 0.0 not in rings
    assert rings.tolist() == (-rings[::-1]).tolist()  # the circle of zero is drawn by itself
    names = [text.get_text() for text in ax.get_yticklabels()]
    assert names == [f"{'+' if ring > 0.0 else '−'}{abs(ring):g} µg" for ring in rings]


def test_law_and_band_are_those_of_the_calibration(loop):
    panels = loop.plot.temperature()
    line = panels[0].lines[0]
    law = loop.temperature_model.k0
    at_T0 = np.interp(loop.T0_degC, line.get_xdata(), line.get_ydata())
    assert at_T0 == pytest.approx(1e3 * law.at_T0.value, rel=1e-9)
    at_80 = np.interp(80.0, line.get_xdata(), line.get_ydata())
    assert at_80 == pytest.approx(1e3 * (law.at_T0.value + 60.0 * law.above.value), rel=1e-9)
    band = panels[3].collections[0].get_paths()[0].vertices
    near = band[np.abs(band[:, 0] - loop.T0_degC) < 1e-9]
    assert np.abs(near[:, 1]).max() == pytest.approx(1e6 * law.at_T0.expanded_uncertainty, rel=1e-3)


@pytest.mark.parametrize("name", ["k0", "K1", "delta"])
def test_bands_are_the_intervals_of_the_coefficients_between_the_levels(loop, name):
    panel = loop.plot.temperature()[3 + ("k0", "K1", "delta").index(name)]
    scale = loop.temperature_model.K1.at_T0.value if name == "K1" else 1.0
    band = panel.collections[0].get_paths()[0].vertices
    for temperature in np.unique(band[:, 0])[[5, 20, 40, 55]]:
        half = np.abs(band[band[:, 0] == temperature, 1]).max()
        told = accelcal.coefficients_at(loop, temperature)[name].expanded_uncertainty
        assert half == pytest.approx(1e6 * told / scale, rel=1e-9)


def test_of_several_mountings_the_one_drawn_is_named(single):
    plan = accelcal.TumblePlan(temperatures=(20.0, 60.0), mountings=("o+", "p+"))
    both = accelcal.fit(accelcal.simulate(plan=plan, seed=5))
    for calibration, label in (
        (both, "run in o+, 95 %"),
        (both.of_mounting("p+"), "run, 95 %"),
        (single, "run, 95 %"),
    ):
        for panel in calibration.plot.temperature()[:3]:
            assert label in panel.get_legend_handles_labels()[1]


def test_arrows_show_a_loop_where_a_level_is_met_again(loop, several):
    for found, number in ((loop, 6), (several, 0)):
        arrows = [text for text in found.plot.temperature()[3].texts if text.get_text() == ""]
        assert len(arrows) == number


def test_laws_that_pass_through_all_runs_say_so(loop, several):
    for found, is_due in ((several, True), (loop, False)):
        for panel in found.plot.temperature()[3:]:
            said = [text.get_text() for text in panel.texts]  # a page takes titles away
            assert ("as many unknowns as levels: always 0" in said) is is_due


def test_the_budget_adds_up(several):
    ax = several.plot.budget()
    ends = {}
    for bar in ax.patches:
        row = round(bar.get_y(), 6)
        ends[row] = ends.get(row, 0.0) + bar.get_width()
    assert list(ends.values()) == pytest.approx([100.0] * 6, abs=0.5)


def test_coefficients_have_the_names_of_the_page(found):
    """Ticks said beta1 where the table of the page below says β₁."""
    names = [text.get_text() for text in found[0].plot.changes().get_yticklabels()]
    assert names == [typeset(change_row(change)[0]) for change in found[0].coefficients]
    assert {"K₁", "β₁", "k₀", "λ₁", "δ"} <= set(names)


def test_the_gap_closes_step_by_step(found):
    fitted = found[0].plot.gap().lines[0].get_ydata()
    assert fitted == pytest.approx([1e6 * found[0].before.rms, 1e6 * found[0].effects[0].gap_after])


def test_mended_faults_are_a_step_of_the_gap():
    hidden = [accelcal.effect("outlier").of(1e-3, reading=17)]
    discovery = accelcal.discover(accelcal.simulate(effects=hidden, seed=3))
    ax = discovery.plot.gap()
    assert [label.get_text() for label in ax.get_xticklabels()][1].startswith("faults")
    sizes = [discovery.before.rms, discovery.after.rms]
    assert ax.lines[0].get_ydata() == pytest.approx(1e6 * np.array(sizes))


def test_the_gap_says_which_names_are_not_sure_and_what_else_they_could_be():
    hidden = [
        accelcal.effect("position-error").of(1.4e-4, at=45.0),
        accelcal.effect("backlash").of(2e-5),
    ]
    discovery = accelcal.discover(accelcal.simulate(effects=hidden, seed=0))
    ax = discovery.plot.gap()
    assert_legible(ax)
    labels = [" ".join(label.get_text().split()) for label in ax.get_xticklabels()]
    assert "+ error of one head position (not sure)" in [each.lower() for each in labels]


def test_the_signature_lies_on_its_residuals(found):
    from accelcal.discovery.in_use.action import action

    discovery, record = found
    seen = action(discovery, record)
    left = seen.residual - seen.change
    assert np.std(left) == pytest.approx(discovery.after.rms, rel=0.05)
    ax = discovery.plot.signature(record)
    assert_legible(ax)
    assert ax.get_xlabel() == "head angle [°]"
    assert ax.get_title("left") == "Backlash of the head"


def test_a_signature_of_angle_and_temperature_has_a_line_for_each_temperature():
    """It was a dense zigzag over all readings in the order of measuring."""
    record = accelcal.simulate(effects=[accelcal.effect("k3-temperature").of(2e-6)], seed=1)
    ax = accelcal.discover(record).plot.signature(record)
    assert ax.get_xlabel() == "head angle [°]"
    legend = [text.get_text() for text in ax.get_legend().get_texts()]
    assert legend == ["−40 °C", "20 °C", "80 °C"]
    cold, middle, hot = (line.get_ydata() for line in ax.get_lines()[1:])
    assert np.abs(middle).max() < 0.1 * np.abs(hot).max()
    assert np.corrcoef(cold, hot)[0, 1] < -0.9


def test_a_signature_in_time_is_drawn_in_time():
    effect = accelcal.effect("warm-up").of(2e-4, tau=1800)
    record = accelcal.simulate(effects=[effect], seed=1)
    discovery = accelcal.discover(record)
    assert discovery.effects
    ax = discovery.plot.signature(record)
    assert ax.get_xlabel() == "time in the run [min]"
    assert_legible(ax)


def test_two_readings_of_an_angle_have_the_scatter_of_all():
    """One degree of freedom has the factor 12.7: its intervals hid everything else."""
    from accelcal.plot.residuals import ReadingValues

    rng = np.random.default_rng(1)
    angle = np.repeat(np.arange(8) * 45.0, 2)
    _, _, half = ReadingValues(angle, np.ones(16, dtype=int), rng.normal(size=16)).means()
    assert np.ptp(half) == pytest.approx(0.0)
    assert half[0] == pytest.approx(2.306 / 2**0.5, rel=0.5)  # Student of 8 degrees of freedom


def test_readings_that_nothing_repeats_have_no_interval():
    from accelcal.plot.residuals import ReadingValues

    angle = np.array([0.0, 0.0, 45.0, 90.0])
    _, means, half = ReadingValues(angle, np.ones(4, dtype=int), np.arange(4.0)).means()
    assert means.tolist() == [0.5, 2.0, 3.0]
    assert np.isnan(half).all()


def test_a_map_tells_the_mounting_of_each_run_where_there_are_several():
    plan = accelcal.TumblePlan(temperatures=(20.0,), mountings=("o+", "o-"), strokes=2)
    ax = accelcal.fit(accelcal.simulate(plan=plan, seed=1)).plot.residual_map()
    names = [label.get_text() for label in ax.child_axes[0].get_xticklabels()]
    assert names == ["run 1 o+\n20 °C", "run 2 o−\n20 °C"]


def test_a_map_has_the_minus_sign_of_typesetting(several):
    names = several.plot.residual_map().child_axes[0].get_xticklabels()
    assert [name.get_text().split("\n")[1] for name in names] == ["20 °C", "80 °C", "−40 °C"]


def test_long_names_of_runs_stay_apart():
    plan = accelcal.TumblePlan(temperatures=(20.0, 60.0), strokes=2)
    frame = accelcal.simulate(plan=plan, seed=1).to_frame()
    frame["run"] = "visit number " + frame["run"].astype(str)
    plot = accelcal.fit(accelcal.read_arrays(frame)).plot
    names = [label.get_text() for label in plot.residual_map().child_axes[0].get_xticklabels()]
    assert names == ["visi…umber 1\n20 °C", "visi…umber 2\n60 °C"]
    names = [label.get_text() for label in plot.coefficients()[0].get_xticklabels()]
    assert names == ["vi…er 1\n20", "vi…er 2\n60"]


def test_names_of_eight_runs_have_room():
    plan = accelcal.TumblePlan(temperatures=(20.0, 80.0, 0.0, 60.0) * 2, strokes=2)
    record = accelcal.simulate(plan=plan, seed=1)
    for label, told in (("visit {}", "v… 8"), ("{} (2)", "8 (2)")):
        labels = tuple(label.format(own) for own in record.run_labels)
        ax = accelcal.fit(replace(record, run_labels=labels)).plot.coefficients()[0]
        names = [label.get_text() for label in ax.get_xticklabels()]
        assert names[-1] == f"{told}\n60"
    assert ax.get_xlabel() == "run, temperature [°C]"


def test_changes_of_runs_stand_above_their_temperatures():
    plan = accelcal.TumblePlan(temperatures=(20.0, -40.0), strokes=4)
    found = accelcal.fit(accelcal.simulate(plan=plan, seed=1))
    ax = accelcal.compare(found, accelcal.simulate(plan=plan, seed=2)).plot.runs()[0]
    names = [label.get_text() for label in ax.get_xticklabels()]
    assert names == ["1\n20", "2\n−40"]


def test_many_test_plans_are_named_on_the_front_alone():
    found = accelcal.design(
        positions=(8, 12, 16, 24), strokes=(2, 4, 6, 8, 10), temperatures=[(20.0,)], effects=False
    )
    for ax, name in zip(found.plot.hours(), ("K0", "K1", "K2", "K3", "M", "M_ip"), strict=True):
        assert 0 < len(ax.texts) <= len(found.front(name))


def test_targets_are_drawn_in_the_unit_of_their_panel():
    targets = {"K0": 2e-5, "M": 3e-5}
    found = accelcal.design(
        targets=targets, positions=(8,), strokes=(2,), temperatures=[(20.0,)], effects=False
    )
    limits = {}
    for ax, name in zip(found.plot.hours(), ("K0", "K1", "K2", "K3", "M", "M_ip"), strict=True):
        limits[name] = [line.get_ydata()[0] for line in ax.lines if line.get_linestyle() == "--"]
        assert "µ" in ax.get_ylabel() or name not in targets
    assert limits.pop("K0") == pytest.approx([20.0])
    assert limits.pop("M") == pytest.approx([30.0])
    assert not any(limits.values())


def test_the_line_between_jumps_is_named_once():
    years = np.arange(2010, 2022)
    rng = np.random.default_rng(1)
    frame = pd.DataFrame(
        {
            "serial": "A",
            "mounting": "o+",
            "date": [f"{year}-01-01" for year in years],
            "temperature_degC": 20.0,
            "k0": 3e-3 + 1e-4 * (years > 2015) + 2e-6 * rng.standard_normal(12),
            "k0_standard_uncertainty": 2e-6,
            "K1": 1.35 * (1.0 + 1e-6 * rng.standard_normal(12)),
            "K1_standard_uncertainty": 1.35e-6,
            "output_unit": "mA",
        }
    )
    bias = accelcal.history(frame).plot.trends()[0]
    labels = [line.get_label() for line in bias.lines if not line.get_label().startswith("_")]
    assert labels.count("line") == 1
    assert sum(line.get_label().startswith("_child") for line in bias.lines) >= 1


def test_where_tells_noise_from_factors():
    from accelcal.plot.discovery import draw_where

    found = (Share("position", 0.5, 1e-9), Share("time", 0.01, 0.7), Share("turn", 0.03, 0.4))
    ax = draw_where(found, 0.01, None)
    colours = {bar.get_facecolor()[:3] for bar in ax.patches}
    assert len(colours) == 2
    assert [text.get_text() for text in ax.texts] == ["p < 0.001", "", ""]
    names = [label.get_text().replace("\n", " ") for label in ax.get_yticklabels()]
    assert names == ["position", "other factors, no more than noise", "repeatability"]
    assert sorted(bar.get_width() for bar in ax.patches) == pytest.approx([4.0, 46.0, 50.0])


def test_changes_are_in_half_widths(found):
    discovery = replace(
        found[0],
        coefficients=(
            Change("K2", Quantity(1e-4, 1e-6, "g/g^2", 2e-6), Quantity(1.1e-4, 1e-6, "g", 2e-6)),
        ),
    )
    assert discovery.plot.changes().containers[0][0].get_xdata() == pytest.approx([5.0])


def test_what_stays_is_named_and_not_drawn_as_a_measured_zero(found):
    stays = Quantity(1.0, 1e-6, "1", 2e-6)
    moves = Change("K2", Quantity(1e-4, 1e-6, "g/g^2", 2e-6), Quantity(1.1e-4, 1e-6, "g", 2e-6))
    ax = replace(found[0], coefficients=(Change("K1", stays, stays), moves)).plot.changes()
    assert [(text.get_text(), text.get_position()[1]) for text in ax.texts] == [("unchanged", 0)]
    assert [bar.get_label() for bar in ax.containers] == ["with the effects, 95 % interval"]
    assert ax.containers[0][0].get_ydata() == [1]


@pytest.mark.parametrize("draw", ["residuals", "tumble", "budget"])
def test_a_run_is_a_label_or_its_number(several, draw):
    by_label, by_number = (getattr(several.plot, draw)(run=run) for run in ("2", 2))
    assert by_label.get_title() == by_number.get_title()
    with pytest.raises(InputError, match="no run 7 in the calibration; it has 1, 2, 3"):
        getattr(several.plot, draw)(run=7)


# -- errors ----------------------------------------------------------------------------------------


def test_unknown_runs_effects_axes_and_themes_are_told(several, found):
    discovery, record = found
    with pytest.raises(InputError, match=r"no run 'x' in the calibration; it has 1, 2, 3"):
        several.plot.residuals(run="x")
    with pytest.raises(InputError, match=r"'drift' was not found; the discovery has backlash"):
        discovery.plot.signature(record, "drift")
    with pytest.raises(InputError, match="effect is list; it is a text, in quotes"):
        discovery.plot.signature(record, ["backlash"])
    with pytest.raises(InputError, match="str in place of a record; make one by"):
        discovery.plot.signature("table.csv")
    with pytest.raises(InputError, match="no effect was found"):
        replace(discovery, effects=()).plot.signature(record)
    with pytest.raises(InputError, match="projection='polar'"):
        several.plot.tumble(canvas(None))
    with pytest.raises(InputError, match="1 axes given; this picture fills 6"):
        several.plot.coefficients([canvas(None)])
    with (
        pytest.raises(InputError, match="'blue' is unknown; choose from light, dark"),
        theme("blue"),
    ):
        pass


def test_without_matplotlib_a_line_tells_how_to_install_it(several, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(InputError, match=r'install it with: pip install "accelcal\[plot\]"$'):
        several.plot.residuals()


# -- style -----------------------------------------------------------------------------------------


def luminance(colour):
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one, other):
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("colours", [LIGHT, DARK], ids=lambda colours: colours.name)
def test_text_and_first_colours_stand_out(colours):
    assert contrast(colours.ink, colours.paper) > 7.0
    assert contrast(colours.muted, colours.paper) > 4.5
    assert min(contrast(colour, colours.paper) for colour in colours.series[:3]) > 3.0


def test_themes_draw_in_their_colours(several):
    with theme("dark", transparent=True):
        dark = picture(several.plot.residuals(), "svg").decode()
    light = picture(several.plot.residuals(), "svg").decode()
    assert DARK.series[0] in dark
    assert LIGHT.series[0] not in dark
    assert LIGHT.series[0] in light
    assert f"fill: {DARK.paper}" not in dark
    assert DARK.ink in dark


@pytest.mark.parametrize("form", ["svg", "pdf", "png"])
def test_the_same_picture_has_the_same_bytes(several, form):
    assert picture(several.plot.tumble(), form) == picture(several.plot.tumble(), form)


def test_axes_given_are_drawn_into(several):
    ax = canvas(None)
    assert several.plot.residuals(ax) is ax


def test_drawing_loads_no_pyplot():
    code = (
        "import sys, accelcal; c = accelcal.fit(accelcal.simulate(seed=1)); c.plot.residuals();"
        " print('matplotlib.pyplot' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_pyplot_shows_what_is_drawn_where_it_is_in_use():
    code = (
        "import matplotlib; matplotlib.use('Agg'); import matplotlib.pyplot as plt, accelcal;"
        "c = accelcal.fit(accelcal.simulate(seed=1)); ax = c.plot.residuals();"
        "print(plt.gcf() is ax.figure)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "True"


@pytest.mark.parametrize(
    ("unit", "largest", "expected"),
    [
        ("g", 3e-5, (1e6, "µg")),
        ("g", 3e-3, (1e3, "mg")),
        ("g", 3.0, (1.0, "g")),
        ("g/g^2", 1e-4, (1e6, "µg/g²")),
        ("rad", 1e-3, (1e6, "µrad")),
        ("1", 1e-5, (1e6, "ppm")),
        ("1", 0.02, (1e2, "%")),
        ("1/degC", 1e-5, (1e6, "ppm/°C")),
        ("mA", 7.0, (1.0, "mA")),
        ("mA", 2e-5, (1e6, "nA")),
        ("mV/g", 0.002, (1e3, "µV/g")),
        ("counts", 1e-9, (1.0, "counts")),
        ("1", 57.0, (1.0, "1")),
        ("g", float("nan"), (1e6, "µg")),
    ],
)
def test_units_of_engineers(unit, largest, expected):
    factor, name = readable(unit, largest)
    assert (factor, name) == (pytest.approx(expected[0]), expected[1])


def test_a_thread_draws_when_no_other_does():
    from matplotlib import rcParams

    def ground():
        with theme("light"):
            return rcParams["axes.labelcolor"]

    alone = ground()
    with ThreadPoolExecutor(1) as other:
        with theme("dark"):
            later = other.submit(ground)
            with pytest.raises(TimeoutError):
                later.result(timeout=0.2)
        assert later.result() == alone


def test_runs_at_one_level_where_no_law_reaches_are_drawn():
    """An arrow to a run that lies where no slope was measured ended the page in an error."""
    plan = accelcal.TumblePlan(temperatures=(21.5, 20.0, -40.0))
    panels = accelcal.fit(accelcal.simulate(plan=plan, seed=3)).plot.temperature()
    panels.flat[0].figure.savefig(BytesIO())
