"""Many units through their recalibrations: who needs attention, and what noise makes of so many."""

import io
import json
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest

import accelcal
from accelcal.cli.main import main
from accelcal.errors import InputError
from accelcal.results.fleet_history import FleetHistory

UG = 1e-6


def unit(serial, rng, count=8, *, drift=0.0, jump=0.0, wander=0.0):
    """Calibrations of a unit at random dates of ten years; sizes in ug and ppm."""
    days = np.sort(rng.choice(3653, count, replace=False))
    stated = 10.0 * np.exp(rng.normal(0.0, 0.3, count))
    noise = np.hypot(stated, 10.0) * rng.standard_normal((2, count))
    walk = wander * np.cumsum(rng.standard_normal(count))
    late = np.arange(count) >= count // 2
    bias = 3000.0 + drift * days / 365.25 + jump * late + walk + noise[0]
    return pd.DataFrame({
        "serial": serial,
        "source": [f"{serial}-{day}.csv" for day in days],
        "mounting": "o+",
        "date": [str(day) for day in np.datetime64("2014-01-01") + days.astype("timedelta64[D]")],
        "temperature_degC": 20.0,
        "k0": UG * bias,
        "k0_standard_uncertainty": UG * stated,
        "K1": 1.35 * (1.0 + 1e-6 * noise[1]),
        "K1_standard_uncertainty": 1.35e-6 * stated,
        "output_unit": "mA",
    })  # fmt: skip


def calm_fleet(seed, units=60, count=None):
    rng = np.random.default_rng(seed)
    frames = [unit(f"U{i:03d}", rng, count or int(rng.integers(5, 10))) for i in range(units)]
    return pd.concat(frames, ignore_index=True)


@pytest.fixture(scope="module")
def frame():
    """Eight calm units, one that drifts, one that jumped, one with two calibrations."""
    rng = np.random.default_rng(5)
    odd = [
        unit("DRIFTS", rng, drift=80.0),
        unit("JUMPED", rng, 10, jump=400.0),
        unit("NEW", rng, 2),
    ]
    return pd.concat([calm_fleet(2, 8), *odd], ignore_index=True)


@pytest.fixture(scope="module")
def fleet(frame):
    return accelcal.fleet_history(frame)


@pytest.fixture(scope="module")
def many():
    """Of 200 units that do nothing, what noise makes of them."""
    return accelcal.fleet_history(calm_fleet(3, 200, 6), alpha=0.05, due_before="2024-01-01")


def test_units_that_need_attention_are_first(fleet):
    first = {own.serial: own.attention for own in fleet.units[:2]}
    assert "drift" in first["DRIFTS"]
    assert "jump" in first["JUMPED"]
    assert fleet.units[-1].serial == "NEW"
    assert (fleet.judged, len(fleet.units)) == (10, 11)
    assert not any({"jump", "drift"} & {*own.attention} for own in fleet.units[2:])


def test_each_unit_is_judged_as_its_history_does(frame, fleet):
    for own in fleet.units[:-1]:
        alone = accelcal.history(frame, own.serial)
        for told, trend in zip(own.trends, alone.trends, strict=True):
            assert told.drift == trend.drift
            assert told.drift_of_a_walk == trend.drift_of_a_walk
            assert told.jumps == trend.jumps
        assert {*own.remarks, *own.notes} == {*alone.notes}
        chances = [jump.p_value for trend in alone.trends for jump in trend.jumps]
        chances += [trend.no_other_jump for trend in alone.trends]
        assert own.jump_p_value == min(chances)
        assert own.jumps_by_chance == pytest.approx(10 * own.jump_p_value)


def test_a_unit_that_cannot_be_judged_says_why(fleet):
    last = fleet.units[-1]
    assert last.notes[0].startswith("serial NEW has calibrations of 2 dates to compare")
    assert (last.calibrations, last.trends, last.jumps_by_chance) == (2, (), None)


def test_units_are_due_by_their_last_date(frame):
    last = frame.groupby("serial")["date"].max()
    day = str(np.sort(last.to_numpy())[3])
    fleet = accelcal.fleet_history(frame, due_before=day)
    due = {own.serial for own in fleet.units if "due" in own.attention}
    assert due == set(last.index[last < day])
    assert len(due) == 3
    calm = [own.attention for own in fleet.units if "DRIFTS" != own.serial != "JUMPED"]
    assert calm == sorted(calm, key=lambda found: (not {*found} - {"due"}, "due" not in found))


def test_the_text_tells_what_a_remark_is(fleet):
    told = " ".join(str(fleet).split())
    assert "remark: a calibration stands apart, the unit wanders, its drift slows or grows," in told


def test_a_fault_of_the_readings_is_a_remark_and_a_gate_that_noise_trips_is_none():
    """A record with swapped readings stood among the calm units, with a U of 14 mg a year."""
    rng = np.random.default_rng(4)
    calm = [unit(name, rng, 4) for name in ("GOOD", "NOISY", "SWAPPED")]
    for own, gate in zip(calm[1:], ("drift", "order_of_positions"), strict=True):
        own[f"gate_{gate}"] = ["pass", "warn", "pass", "pass"]
    fleet = accelcal.fleet_history(pd.concat(calm))
    assert [own.serial for own in fleet.units if "remark" in own.attention] == ["SWAPPED"]
    (note,) = fleet.units[0].remarks
    assert note.endswith("(order of positions)")
    assert fleet.to_frame()["notes"].str.contains("warn").sum() == 2


def test_an_offset_that_all_calibrations_have_is_no_remark():
    """The unit stood above sound ones for good, though nothing was wrong with its readings."""
    rng = np.random.default_rng(4)
    both = [unit(name, rng, 4) for name in ("OFFSET", "WRONG")]
    both[0]["gate_proportions"] = "warn"
    both[1]["gate_proportions"] = ["pass", "warn", "warn", "warn"]
    fleet = accelcal.fleet_history(pd.concat(both))
    found = {own.serial: (own.attention, own.notes) for own in fleet.units}
    assert "remark" in found["WRONG"][0]
    assert "remark" not in found["OFFSET"][0]
    assert any("(proportions)" in note for note in found["OFFSET"][1])


def test_units_that_are_due_alone_are_sorted_by_their_last_dates(frame):
    fleet = accelcal.fleet_history(frame, due_before="2024-01-01")
    due = [own.last for own in fleet.units if own.attention == ("due",)]
    assert len(due) > 5
    assert due == sorted(due)


@pytest.mark.parametrize("date", [None, "soon"])
def test_a_unit_whose_date_nobody_can_read_is_due(frame, date):
    frame = pd.concat([frame, frame[frame["serial"] == "NEW"].assign(serial="LOST", date=date)])
    (lost,) = (own for own in accelcal.fleet_history(frame).units if own.serial == "LOST")
    assert lost.attention == ()
    due = [own for own in accelcal.fleet_history(frame, due_before="1999").units if own.attention]
    assert (due[-1].serial, due[-1].attention) == ("LOST", ("due",))


def test_a_unit_of_the_future_is_due(frame):
    odd = frame["serial"].isin(["NEW", "DRIFTS"])
    frame = frame.assign(date=frame["date"].where(~odd, "209" + frame["date"].str[3:]))
    fleet = accelcal.fleet_history(frame, due_before="2000-01-01")
    assert {own.serial for own in fleet.units if "due" in own.attention} == {"NEW", "DRIFTS"}
    assert [note.count("(209") for note in fleet.notes if "in the future" in note] == [2]


def test_a_test_at_another_temperature_counts_where_a_unit_is_due(frame):
    later = (
        frame[frame["serial"] == "DRIFTS"].tail(1).assign(date="2026-01-01", temperature_degC=60.0)
    )
    found = accelcal.fleet_history(pd.concat([frame, later]), due_before="2025-01-01")
    kept = [own for own in found.units if "due" not in own.attention]
    assert [(own.serial, own.last, own.calibrations) for own in kept] == [
        ("DRIFTS", "2026-01-01", 8)
    ]


def test_a_fleet_without_drifts_has_a_list_of_the_due(tmp_path, capsys):
    rng = np.random.default_rng(9)
    frame = pd.concat([unit(f"U{i}", rng, 2) for i in range(9)], ignore_index=True)
    day = str(np.sort(frame.groupby("serial")["date"].max().to_numpy())[4])
    frame.to_csv(tmp_path / "r.csv", index=False)
    command = ["history", str(tmp_path / "r.csv"), "--due-before", day]
    assert main(command) == 0
    told = capsys.readouterr().out
    assert f"due      4, no calibration known since {day}\n9 units cannot be judged" in told
    with pytest.raises(InputError, match="none of 9 units can be judged; first: serial U0 has"):
        accelcal.fleet_history(frame)
    pytest.importorskip("matplotlib")
    assert main([*command, "--plot", str(tmp_path / "r.png")]) == 2
    assert "no unit has enough calibrations for a drift to draw" in capsys.readouterr().err
    assert not (tmp_path / "r.png").exists()


def test_false_jumps_of_a_fleet_are_as_many_as_it_says():
    """Of 8 fleets of 60 units that do nothing, by fixed seeds."""
    fleets = [accelcal.fleet_history(calm_fleet(seed)) for seed in range(10, 18)]
    units = [own for fleet in fleets for own in fleet.units]
    assert fleets[0].jumps_by_chance == pytest.approx(0.6)
    named = sum(any(trend.jumps for trend in own.trends) for own in units)
    expected = sum(fleet.jumps_by_chance for fleet in fleets)
    assert abs(named - expected) < 3.0 * np.sqrt(expected)
    by_chance = np.array([own.jumps_by_chance for own in units])
    for limit in (0.5, 1.0, 3.0, 10.0):
        count = np.count_nonzero(by_chance < limit)
        assert abs(count - 8 * limit) < 3.0 * np.sqrt(8 * limit)
    sure = sum("jump" in own.attention for own in units)
    assert sure < 8 + 3.0 * np.sqrt(8)
    drifts = np.array([own.drifts_by_chance for own in units])
    assert np.count_nonzero(drifts < 1.0) < 8 + 3.0 * np.sqrt(8)
    assert sum("drift" in own.attention or "drift?" in own.attention for own in units) < sum(
        fleet.drifts_by_chance for fleet in fleets
    )


def test_a_finding_that_so_many_units_have_by_noise_is_marked(many):
    marked = [own for own in many.units if "jump?" in own.attention]
    assert len(marked) > 3
    assert all(own.jumps_by_chance >= 1.0 for own in marked)
    sure = [own for own in many.units if "jump" in own.attention]
    assert all(own.jumps_by_chance < 1.0 for own in sure)


def test_units_that_wander_do_not_fill_the_list():
    rng = np.random.default_rng(4)
    frame = pd.concat([unit(f"U{i}", rng, 10, wander=30.0) for i in range(60)], ignore_index=True)
    found = [own.attention for own in accelcal.fleet_history(frame).units]
    assert sum("drift" in own for own in found) <= 3


def test_units_that_wander_have_more_jumps_as_the_page_warns():
    rng = np.random.default_rng(4)
    frame = pd.concat([unit(f"U{i}", rng, 25, wander=20.0) for i in range(30)], ignore_index=True)
    fleet = accelcal.fleet_history(frame)
    assert fleet.jumps_by_chance == pytest.approx(0.3)
    assert sum("jump" in own.attention for own in fleet.units) > 3


def test_the_forms(frame, fleet, tmp_path, capsys):
    frame.to_csv(tmp_path / "r.csv", index=False)
    arguments = ["history", str(tmp_path / "r.csv")]
    assert main([*arguments, "-o", str(tmp_path / "f.json")]) == 0
    assert FleetHistory.from_json(tmp_path / "f.json") == fleet
    assert capsys.readouterr().out == f"{fleet}\n"
    assert main([*arguments, "--format", "csv"]) == 0
    table = pd.read_csv(io.StringIO(capsys.readouterr().out), keep_default_na=False)
    assert table["serial"].tolist() == [own.serial for own in fleet.units]
    assert main([*arguments, "--format", "json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "accelcal/fleet-history/1"
    assert document["units"][0]["serial"] == fleet.units[0].serial
    tabulated = fleet.to_frame()
    assert tabulated.columns.tolist() == table.columns.tolist()
    assert tabulated.attrs["units"]["k0_drift_of_a_walk"] == "g/year"
    assert tabulated.attrs["units"]["K1_last_jump"] == "1"
    for name in ("first", "last", "k0_last_jump_before", "K1_last_jump_before"):
        assert tabulated[name].dtype == "datetime64[us]"
        assert tabulated[name].dt.strftime("%Y-%m-%d").fillna("").tolist() == table[name].tolist()


def test_lines_of_the_text_fit_a_terminal(fleet):
    assert max(map(len, str(fleet).splitlines())) <= 100
    assert str(fleet).startswith("History of 11 units; intervals are of 95 %\njumps    ")
    assert "1 unit cannot be judged: CSV and JSON tell why" in str(fleet)
    (without,) = (own.serial for own in fleet.units if not own.trends)
    assert without not in str(fleet)  # its line would be empty
    assert repr(fleet).startswith("<FleetHistory: 11 units, ")


def test_the_first_lines_tell_how_many_findings_are_no_noise(many):
    found = [own.attention for own in many.units]
    sure, doubtful = (sum(name in own for own in found) for name in ("jump", "jump?"))
    lines = str(many).splitlines()
    told = f"{sure + doubtful} of 200 units, {sure} without ?, at alpha = 0.05; noise alone: 10"
    assert lines[1] == f"jumps    {told}"
    due = sum("due" in own for own in found)
    assert lines[3] == f"due      {due}, no calibration known since 2024-01-01"


def test_the_last_line_tells_how_many_of_the_others_need_attention():
    fleet = accelcal.fleet_history(calm_fleet(6, 45, 5), due_before="2040")
    assert "and 5 other units, 5 of them with attention (CSV and JSON have all)" in str(fleet)
    fleet = accelcal.fleet_history(calm_fleet(6, 41, 5))
    assert "and 1 other unit, 0 of them with attention (CSV" in str(fleet)


def test_tables_without_a_serial_are_left_out(frame):
    nameless = frame[frame["serial"] == "NEW"].assign(serial=None)
    found = accelcal.fleet_history(pd.concat([frame, nameless], ignore_index=True))
    assert found.notes == ("2 tables without a serial number: left out",)
    assert len(found.units) == 11


def test_results_without_any_serial_are_refused(frame):
    for none in ([], frame.head(0), frame.assign(serial=None)):
        with pytest.raises(InputError, match="no serial number in the results; give what"):
            accelcal.fleet_history(none)


def test_a_table_of_arrow_is_a_frame(frame, fleet):
    pa = pytest.importorskip("pyarrow")
    assert accelcal.fleet_history(pa.Table.from_pandas(frame)) == fleet


def test_serials_that_are_alike_are_told(frame):
    again = frame[frame["serial"] == "DRIFTS"].assign(serial="drifts")
    (note,) = accelcal.fleet_history(pd.concat([frame, again], ignore_index=True)).notes
    assert "DRIFTS" in note
    assert "drifts" in note


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"due_before": "soon"}, "due_before='soon' is no date; write it as 2024-05-31"),
        ({"alpha": 1e-6}, "alpha is 1e-06"),
        ({"mounting": "p-"}, "none of 11 units can be judged; first: no mounting 'p-' in the res"),
    ],
)
def test_wrong_options(frame, options, told):
    with pytest.raises(InputError, match=told):
        accelcal.fleet_history(frame, **options)


def test_due_before_is_of_all_units(frame, tmp_path, capsys):
    frame.to_csv(tmp_path / "r.csv", index=False)
    command = ["history", str(tmp_path / "r.csv"), "--due-before", "2020"]
    assert main([*command, "--serial", "NEW"]) == 2
    assert capsys.readouterr().err == "error: --due-before looks at all units; leave out --serial\n"
    assert main([*command[:-1], "soon"]) == 2
    told = "error: --due-before soon is no date; write it as 2024-05-31\n"
    assert capsys.readouterr().err == told
    frame[frame["serial"] == "DRIFTS"].to_csv(tmp_path / "r.csv", index=False)
    assert main(command) == 0
    assert capsys.readouterr().out.startswith("History of 1 unit; ")


def test_the_picture_names_the_units_that_drift_or_jumped(fleet, frame, tmp_path):
    pytest.importorskip("matplotlib")
    bias, scale_factor = fleet.plot.drifts()
    labels = bias.get_legend_handles_labels()[1]
    assert labels == ["drift, 95 %", "beyond its U: DRIFTS", "with a jump: JUMPED"]
    assert scale_factor.get_xlabel() == "units by their drift, of 10"
    drawn = np.concatenate([own.lines[0].get_ydata() for own in bias.containers])
    walks = [own.trends[0].drift_of_a_walk.value / UG for own in fleet.units if own.trends]
    assert np.sort(drawn) == pytest.approx(np.sort(walks))
    frame.to_csv(tmp_path / "r.csv", index=False)
    assert main(["history", str(tmp_path / "r.csv"), "--plot", str(tmp_path / "r.png")]) == 0
    assert (tmp_path / "r.png").read_bytes()[:4] == b"\x89PNG"


def test_the_picture_names_units_without_doubt_first():
    pytest.importorskip("matplotlib")
    rng = np.random.default_rng(8)
    few = [unit(f"F{i}", rng, 3, drift=150.0) for i in range(20)]
    frame = pd.concat([*few, unit("SURE", rng, 12, drift=60.0)], ignore_index=True)
    bias, _ = accelcal.fleet_history(frame).plot.drifts()
    (label,) = (own for own in bias.get_legend_handles_labels()[1] if own.startswith("beyond"))
    names = label.removeprefix("beyond its U: ").partition(" and ")[0].split(", ")
    doubtful = [name.endswith("?") for name in names]
    assert "SURE" in names
    assert doubtful == sorted(doubtful)
    assert any(doubtful)


def test_one_bad_unit_does_not_scale_the_picture_of_all():
    """The others lay on one line, as it took the height of the axes."""
    pytest.importorskip("matplotlib")
    rng = np.random.default_rng(8)
    bad = unit("BAD", rng, 3, drift=-1e6)
    sound = pd.concat([unit(f"U{i}", rng, 3, drift=150.0) for i in range(8)])
    alone, beside = (
        accelcal.fleet_history(frame.reset_index(drop=True)).plot.drifts()[0]
        for frame in (sound, pd.concat([sound, bad]))
    )
    assert beside.get_ylim()[1] < 2.0 * alone.get_ylim()[1]
    labels = [axes.get_legend_handles_labels()[1] for axes in (alone, beside)]
    assert "outside the axes: BAD" in labels[1]
    assert not any(label.startswith("outside") for label in labels[0])


def test_a_picture_of_few_units_names_each_along_the_axis():
    pytest.importorskip("matplotlib")
    rng = np.random.default_rng(1)
    rates = {"UP": 300.0, "STILL": 0.0, "DOWN": -300.0}
    frame = pd.concat([unit(name, rng, 6, drift=rate) for name, rate in rates.items()])
    bias, _ = accelcal.fleet_history(frame.reset_index(drop=True)).plot.drifts()
    assert [tick.get_text() for tick in bias.get_xticklabels()] == ["DOWN", "STILL", "UP"]


def test_long_serial_numbers_along_the_axis_do_not_lie_upon_each_other():
    """They stood side by side."""
    pytest.importorskip("matplotlib")
    rng = np.random.default_rng(1)
    frame = pd.concat([unit(f"AL15-LOT7-2019-{n:04d}", rng, 4) for n in range(8)])
    bias, _ = accelcal.fleet_history(frame.reset_index(drop=True)).plot.drifts()
    bias.figure.draw_without_rendering()
    boxes = [tick.get_window_extent() for tick in bias.get_xticklabels()]
    assert all(left.x1 < right.x0 for left, right in pairwise(boxes))
    assert len({tick.get_text() for tick in bias.get_xticklabels()}) == 8


def test_tests_without_a_date_are_counted(frame):
    odd = unit("UNDATED", np.random.default_rng(3), 3).assign(date=[None, None, "2020-01-31"])
    found = accelcal.fleet_history(pd.concat([frame, odd]))
    (undated,) = (own for own in found.units if own.serial == "UNDATED")
    assert (undated.calibrations, undated.last) == (3, "2020-01-31")
    assert not undated.trends
