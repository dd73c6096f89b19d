"""The stand or the unit: over several units of one stand, each effect is given to whose it is."""

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from dense_covariance import whitening_matrix
from hidden.design import DESIGNS
from hidden.units import units_of_one_stand

import accelcal
from accelcal.cli.main import main
from accelcal.discovery.base import base_model, solve
from accelcal.discovery.comparison import compared
from accelcal.discovery.instance import Instance, column_of
from accelcal.discovery.stand.discover import discover_stand
from accelcal.discovery.stand.ownership import one_value
from accelcal.discovery.stand.units import Unit, coefficients, known, mean_unit, shared_columns
from accelcal.effects.catalogue import effect
from accelcal.errors import DocumentError, InputError
from accelcal.results.stand_discovery import StandDiscovery

T0 = 20.0
HEAD = 2e-5


@cache
def measured(regime="iid", stand=None, unit=None, units=3, seed=1):
    """Truth and records of some units of one stand; `stand` and `unit` are (id, s)."""
    drawn = units_of_one_stand(
        np.random.default_rng(seed),
        DESIGNS["three"],
        regime,
        hidden_stand=dict([stand] if stand else []),
        hidden_unit={1: dict([unit] if unit else [])},
        n=units,
    )
    with TemporaryDirectory() as folder:
        paths = [Path(folder) / f"unit{number}.csv" for number in range(units)]
        for path, (_, table) in zip(paths, drawn, strict=True):
            table.write(path)
        records = [
            replace(accelcal.read_table(path), serial=f"S{number}", source=path.name)
            for number, path in enumerate(paths)
        ]
    return drawn, records


@cache
def found(*arguments, **options):
    return discover_stand(measured(*arguments, **options)[1])


def verdicts(result):
    return {item.id: (item.verdict, item.found_in) for item in result.effects}


# -- the generator ---------------------------------------------------------------------------------


def test_units_of_one_stand_share_the_head_and_nothing_else():
    drawn, _ = measured("head", ("backlash", 4.0), ("warm-up", 8.0))
    assert len({table.regime.graduation for _, table in drawn}) == 1
    assert len({case.truth["backlash"]["backlash"] for case, _ in drawn}) == 1
    assert len({table.scale for _, table in drawn}) == len({t.time[-1] for _, t in drawn}) == 3
    assert [case.hidden for case, _ in drawn] == [
        ("backlash",),
        ("backlash", "warm-up"),
        ("backlash",),
    ]


# -- whose -----------------------------------------------------------------------------------------


def test_an_effect_of_all_units_is_the_stands():
    drawn, _ = measured("iid", ("backlash", 2.0))
    result = found("iid", ("backlash", 2.0))
    assert verdicts(result) == {"backlash": ("stand", ())}
    lag = result.effects[0].parameters["lag"]
    true = drawn[0][0].truth["backlash"]["backlash"] / 2.0
    assert abs(lag.value - true) < 4.0 * lag.standard_uncertainty


def test_an_effect_of_one_unit_is_its_own():
    result = found("iid", None, ("warm-up", 8.0))
    assert verdicts(result) == {"warm-up": ("unit", ("S1",))}
    sizes = {name: q.value / q.standard_uncertainty for name, q in result.effects[0].sizes.items()}
    assert max(sizes, key=lambda name: abs(sizes[name])) == "S1"
    assert all(abs(size) < 4.5 for name, size in sizes.items() if name != "S1")


def test_what_one_effect_of_a_unit_may_be_is_no_doubt_about_another():
    """|a_i| may be a_i^4; the warm-up beside it could not, and was said to."""
    both = [effect("warm-up").of(1e-4), effect("scale-factor-asymmetry").of(3e-4)]
    quiet = accelcal.NoiseComponents(head=0.0)
    drawn = [
        accelcal.simulate(noise=quiet, effects=own, seed=n) for n, own in enumerate(([], both, []))
    ]
    units = [replace(record, serial=name) for record, name in zip(drawn, "ABC", strict=True)]
    told = {item.id: item.indistinguishable for item in discover_stand(units).effects}
    assert told == {"warm-up": (), "scale-factor-asymmetry": ("fourth-order",)}


def test_stand_and_unit_are_told_apart_in_one_archive():
    result = found("all", ("backlash", 4.0), ("fourth-order", 8.0))
    told = verdicts(result)
    assert told.pop("backlash") == ("stand", ())
    assert list(told.values()) == [("unit", ("S1",))]
    own = result.effects[1]
    assert "fourth-order" in {own.id, *own.indistinguishable}


def test_the_others_show_what_the_head_hides_in_one_unit():
    _, records = measured("head", None, ("scale-factor-asymmetry", 5.0))
    assert accelcal.discover(records[1]).effects == ()
    told = verdicts(found("head", None, ("scale-factor-asymmetry", 5.0)))
    assert list(told.values()) == [("unit", ("S1",))]


@pytest.mark.parametrize("regime", ["iid", "head"])
def test_nothing_where_there_is_nothing(regime):
    result = found(regime, seed=5)
    assert result.effects == ()
    assert "Nothing that the units share is missing" in str(result)


def test_effects_that_another_head_would_make_are_not_sure():
    noise = accelcal.NoiseComponents(head=HEAD)  # each record draws a head of its own
    records = [
        replace(accelcal.simulate(noise=noise, seed=seed), serial=f"U{seed}") for seed in range(3)
    ]
    result = discover_stand(records)
    assert result.effects
    assert {item.verdict for item in result.effects} == {"unit"}
    assert set(result.doubtful) == {item.id for item in result.effects}
    assert any("errors of another head" in note for note in result.notes)
    assert "scale factor asymmetry (not sure)" in " ".join(str(result).split())
    assert "(not sure)" in result._repr_html_()
    assert StandDiscovery.from_json(result.to_json()) == result


def test_an_effect_that_no_head_makes_is_sure():
    result = found("head", None, ("warm-up", 8.0))
    assert verdicts(result) == {"warm-up": ("unit", ("S1",))}
    assert result.doubtful == ()
    assert not any("another head" in note for note in result.notes)


def test_a_head_that_is_not_declared_makes_effects_of_the_stand_not_sure():
    noise = accelcal.NoiseComponents(head=0.0)
    hidden = [effect("cross-axis-cubic").of(1e-4)]
    records = [
        accelcal.simulate(noise=noise, effects=hidden, seed=seed, declare=False)
        for seed in (1, 2, 3)
    ]
    result = discover_stand(records)
    assert verdicts(result) == {"cross-axis-cubic": ("stand", ())}
    assert result.doubtful == ("cross-axis-cubic",)
    assert any("would look like cross-axis-cubic" in note for note in result.notes)


def test_two_units_do_not_tell():
    result = found("iid", ("backlash", 2.0), units=2)
    assert {item.verdict for item in result.effects} == {"undecided"}
    assert result.coefficients == {}
    assert any("measure a third" in note for note in result.notes)


def backlash_in(records):
    units = [Unit.of(compared(record, T0)) for record in records]
    return one_value(units, Instance(effect("backlash"), (1.0,), {}), (), 0.01)


def test_one_value_is_one_value():
    _, with_it = measured("iid", ("backlash", 4.0))
    _, without = measured("iid")
    assert backlash_in(with_it).verdict == "stand"
    assert backlash_in([*with_it[:2], *without[2:]]).verdict == "unit"


# -- the mean --------------------------------------------------------------------------------------


def test_mean_of_units_with_other_laws_is_a_unit():
    """The mean of their readings is not: the mean of products is no product of means."""
    _, records = measured("iid")
    units = [Unit.of(compared(record, T0)) for record in records]
    exact = []
    for unit in units:
        model = unit.comparison.model
        base = model.reading - model.residual(unit.comparison.parameters)
        exact.append(
            (
                base,
                unit._replace(
                    comparison=unit.comparison._replace(model=replace(model, reading=base))
                ),
            )
        )
    mean = mean_unit([unit for _, unit in exact], (), None)
    model = base_model(mean, T0)
    assert np.abs(model.residual(solve(model))).max() < 1e-11
    plain = replace(mean, output=np.mean([base for base, _ in exact], axis=0))
    model = base_model(plain, T0)
    assert np.abs(model.residual(solve(model))).max() > 1e-8


# -- the joint estimate ----------------------------------------------------------------------------


def stacked(units, instance):
    """All parameters of all units and the head in one least squares fit, as a textbook has it."""
    blocks, rows, p = [], [], units[0].comparison.parameters.size
    shared = 1 + units[0].head.shape[1]
    for number, unit in enumerate(units):
        comparison = unit.comparison
        white = whitening_matrix(comparison.spread)
        block = np.zeros((white.shape[0], len(units) * p + shared))
        block[:, number * p : (number + 1) * p] = white @ comparison.model.jacobian(
            comparison.parameters
        )
        column = column_of(instance, comparison.model.conditions)
        block[:, len(units) * p :] = white @ np.column_stack([column, unit.head])
        blocks.append(block)
        rows.append(white @ comparison.model.residual(comparison.parameters))
    prior = np.zeros((shared - 1, len(units) * p + shared))
    prior[:, len(units) * p + 1 :] = np.eye(shared - 1) / HEAD
    matrix = np.vstack([*blocks, prior])
    right = np.concatenate([*rows, np.zeros(shared - 1)])
    norms = np.linalg.norm(matrix, axis=0)
    inverse = np.linalg.pinv(matrix / norms, rcond=1e-13) / norms[:, None]
    return inverse @ right, inverse @ inverse.T, p


def joint_case():
    _, records = measured("head", ("backlash", 4.0))
    units = [Unit.of(compared(r.with_apparatus(head_uncertainty=None), T0)) for r in records]
    return units, Instance(effect("backlash"), (1.0,), {})


def test_joint_fit_is_that_of_one_large_fit():
    units, instance = joint_case()
    value, covariance, p = stacked(units, instance)
    told = known(units, (instance,), HEAD, shared_columns(units[0], (instance,), HEAD).shape[1])
    np.testing.assert_allclose(told.value, value[len(units) * p :], rtol=1e-5, atol=1e-10)
    np.testing.assert_allclose(
        np.diagonal(told.covariance), np.diagonal(covariance)[len(units) * p :], rtol=1e-6
    )


def test_coefficients_are_those_of_one_large_fit():
    units, instance = joint_case()
    value, covariance, p = stacked(units, instance)
    told = coefficients(units, (instance,), HEAD)
    for number, (unit, changes) in enumerate(zip(units, told, strict=True)):
        for place, name in enumerate(unit.comparison.model.names):
            after = next(c.after for c in changes if c.coefficient == name)
            here = number * p + place
            expected = float(np.sqrt(covariance[here, here]))
            assert after.standard_uncertainty == pytest.approx(expected, rel=1e-4)
            joint = unit.comparison.parameters[place] + value[here]
            assert after.value == pytest.approx(joint, abs=1e-3 * expected)


def test_joint_estimate_makes_coefficients_better():
    result = found("iid", ("position-error", 4.0))
    ratios = [
        change.after.standard_uncertainty / change.before.standard_uncertainty
        for changes in result.coefficients.values()
        for change in changes
    ]
    assert max(ratios) < 1.001
    assert min(ratios) < 0.95
    assert re.search(r"k\d +[\d.]+ +[\d.]+ +\d+\.\d %", str(result))


def test_head_positions_are_told_with_their_uncertainty():
    drawn, _ = measured("head")
    result = found("head", seed=1)
    true = np.array(drawn[0][1].regime.graduation)
    errors = np.array([p.error.value for p in result.head])
    uncertainties = np.array([p.error.standard_uncertainty for p in result.head])
    assert [p.angle_deg for p in result.head] == [45.0 * k for k in range(8)]
    assert (np.abs(errors - true) < 4.0 * uncertainties).all()
    assert uncertainties.max() == pytest.approx(HEAD, rel=0.3)
    assert uncertainties.min() < 0.9 * HEAD


# -- what cannot be compared -----------------------------------------------------------------------


def changed(records, **values):
    return [*records[:-1], replace(records[-1], **values)]


def test_units_need_one_plan():
    _, records = measured("iid")
    last = records[-1]
    cases = {
        "other angles than in unit0.csv": {"angle": last.angle + 1.0},
        "other strokes": {"stroke": last.stroke + 2},
        "other temperatures": {"temperature": last.temperature + 5.0},
        "T0 is 20 and 25 degC": {"reference_temperature": 25.0},
        "head_uncertainty is 0 and 1e-05": {
            "apparatus": replace(last.apparatus, head_uncertainty=1e-5)
        },
    }
    for message, values in cases.items():
        with pytest.raises(InputError, match=re.escape(message)):
            discover_stand(changed(records, **values))
    with pytest.raises(InputError, match="other number of readings"):
        discover_stand([records[0], records[1].select(np.arange(162) < 108)])
    with pytest.raises(InputError, match="two or more units"):
        discover_stand(records[:1])
    with pytest.raises(InputError, match="the same readings as unit0"):
        discover_stand([*records, replace(records[0], source="copy.csv")])


def test_launches_that_one_leaves_open_are_open_for_all():
    _, records = measured("iid", ("backlash", 2.0))
    open_end = replace(records[-1].apparatus, launch_uncertainty=None)
    result = discover_stand(changed(records, apparatus=open_end))
    assert verdicts(result) == {"backlash": ("stand", ())}


# -- the result ------------------------------------------------------------------------------------


def test_document_comes_back():
    for result in (found("head", seed=1), found("all", ("backlash", 4.0), ("fourth-order", 8.0))):
        assert StandDiscovery.from_json(result.to_json()) == result


@pytest.mark.parametrize(
    "damage",
    [
        {"schema": "accelcal/discovery/9"},
        {"units": None},
        {"effects": [{"id": "backlash"}]},
        {"head": [{"angle_deg": "x"}]},
    ],
)
def test_damaged_document_is_refused(damage):
    document = found("head", seed=1).to_document() | damage
    with pytest.raises(DocumentError):
        StandDiscovery.from_document(document)
    with pytest.raises(DocumentError):
        StandDiscovery.from_document([])


def test_command_tells_the_units_and_then_the_stand(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    drawn, _ = measured("iid", ("backlash", 4.0))
    paths = [f"u{number}.csv" for number in range(3)]
    for path, (_, table) in zip(paths, drawn, strict=False):
        table.write(path)
    assert main(["discover", *paths, "-o", "found.json"]) == 0
    printed = capsys.readouterr().out
    assert printed.count("DISCOVERY") == 3
    assert "Of the stand, with one value in all units: backlash of the head." in printed
    assert max(map(len, printed.splitlines())) <= 100
    document = json.loads(Path("found.json").read_text("utf-8"))
    assert len(document["discoveries"]) == 3
    assert document["stand"]["effects"][0]["verdict"] == "stand"
    assert repr(StandDiscovery.from_document(document["stand"])) == (
        "<StandDiscovery of 3 units: backlash (stand)>"
    )


def test_command_says_why_the_stand_is_not_looked_at(tmp_path, capsys):
    (_, table), *_ = measured("iid")[0]
    text = tmp_path / "u0.csv"
    table.write(text)
    other = tmp_path / "u1.csv"
    other.write_text("\n".join(line for line in text.read_text().splitlines()[:-9]) + "\n")
    assert main(["discover", str(text), str(other)]) == 0
    printed = capsys.readouterr().out
    assert "STAND  not looked at:" in printed
    assert "other number of readings" in printed


# -- readings that a dead zone silences ------------------------------------------------------------


def silenced(positions, *, own):
    """Units of one perfect head with a dead zone of 3 mg, or of which the second has it alone."""
    plan = accelcal.TumblePlan(positions=positions, strokes=4, temperatures=(20.0,))
    zone, noise = [effect("dead-zone").of(3e-3)], accelcal.NoiseComponents(head=0.0)
    records = [
        accelcal.simulate(
            plan=plan, noise=noise, effects=[] if own and seed != 2 else zone, seed=seed
        )
        for seed in (1, 2, 3)
    ]
    return discover_stand(records)


@pytest.mark.parametrize("own", [False, True])
def test_a_dead_zone_wider_than_the_misalignment_has_its_width_over_several_units(own):
    """It was told as 1.23 mg beside an odd quadratic and the error of a position, all sure."""
    told = silenced(24, own=own)
    [zone] = told.effects
    assert zone.verdict == ("unit" if own else "stand")
    for unit in ("unit 2",) if own else told.units:
        size = zone.sizes[unit]
        assert abs(size.value - 3e-3) < 1.5 * size.expanded_uncertainty
    assert told.doubtful == ()
    for changes in told.coefficients.values():
        M = next(c.after for c in changes if c.coefficient == "M")
        assert abs(M.value - 1.15e-3) < 1.5 * M.expanded_uncertainty


@pytest.mark.parametrize("own", [False, True])
def test_a_dead_zone_of_any_width_is_not_sure_over_several_units(own):
    """It was told as 1.156 mg with U of 5 ug, and K1 3 parts in a thousand off with U of 13 ppm."""
    told = silenced(8, own=own)
    [zone] = told.effects
    assert told.doubtful == ("dead-zone",)
    assert any("positions across the input axis are silent" in note for note in told.notes)
    for unit in ("unit 2",) if own else told.units:
        assert zone.sizes[unit].standard_uncertainty is None
    for changes in told.coefficients.values():
        open_ones = {c.coefficient for c in changes if c.after.standard_uncertainty is None}
        assert open_ones == {"K1", "K3"}
    assert StandDiscovery.from_json(told.to_json()) == told
    assert "(not sure)" in str(told)
    assert "(not sure)" in told._repr_html_()
    assert told.plot.sizes() is not None


def test_what_no_known_effect_explains_in_a_unit_has_no_sure_name():
    """The nearest effects were told as those of the unit."""
    plan = accelcal.TumblePlan(positions=24, strokes=4, temperatures=(20.0,))
    noise = accelcal.NoiseComponents(head=0.0)
    records = [accelcal.simulate(plan=plan, noise=noise, seed=seed) for seed in (1, 2, 3)]
    odd = np.sign(np.sin(5.0 * np.radians(records[1].angle) + 0.4))
    records[1] = replace(records[1], output=records[1].output + 1e-4 * odd)
    told = discover_stand(records)
    own = {item.id for item in told.effects if "unit 2" in item.found_in}
    assert own == set(told.doubtful)
    assert any("no known effect explains how" in note for note in told.notes)
    assert own


def test_units_of_a_stand_may_differ_in_whether_their_level_moves():
    plan = accelcal.TumblePlan(temperatures=(20.0,), strokes=6)
    own = [effect("stroke-offset").of(3e-5)]
    records = [
        replace(accelcal.simulate(plan=plan, effects=own, seed=seed), serial=f"S{seed}")
        for seed in range(3)
    ]
    ramp = np.linspace(-0.2, 0.2, len(records[0]))
    records[1] = replace(records[1], temperature=20.0 + ramp)
    assert [item.id for item in discover_stand(records).effects] == ["stroke-offset"]
