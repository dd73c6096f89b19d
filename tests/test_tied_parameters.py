"""The bias breaks once: where it does follows from its slopes, if no level lies close to it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import accelcal
from accelcal.simulation import NoiseComponents, TumblePlan

SHIFT = accelcal.effect("break-shift")
LEVELS = TumblePlan(
    temperatures=(20.0, 50.0, 80.0, 50.0, 20.0, -10.0, -40.0, -10.0, 20.0), strokes=4
)
SLOPE_CHANGE = 6e-6  # of the AL-15


def record_of(shift, seed, slope_change=SLOPE_CHANGE):
    return accelcal.simulate(
        plan=LEVELS, effects=[SHIFT.of(shift, slope_change=slope_change)], seed=seed
    )


@cache
def discovered(*args):
    found = accelcal.discover(record_of(*args))
    (effect,) = found.effects
    assert effect.id == "break-shift"
    (note,) = [note for note in found.notes if "do not tell shift from slope_change" in note]
    return found, effect.parameters, note


def is_covered(quantity, truth):
    return abs(quantity.value - truth) < quantity.expanded_uncertainty


@pytest.mark.parametrize(("shift", "seed"), [(15.0, 2), (-15.0, 4)])
def test_the_break_is_where_the_two_lines_meet(shift, seed):
    """It was anywhere between two levels, with a change of the slope to match and a U too small."""
    _, parameters, note = discovered(shift, seed)
    assert is_covered(parameters["shift"], shift)
    assert is_covered(parameters["slope_change"], SLOPE_CHANGE)
    assert parameters["shift"].expanded_uncertainty < 5.0
    assert "both follow from the slopes" in note


def test_the_document_is_the_same_when_it_is_read_back():
    """Degrees of freedom of the break were a whole number, which came back as 158.0."""
    found = discovered(15.0, 2)[0]
    document = found.to_json()
    assert accelcal.Discovery.from_json(document).to_json() == document


def test_a_fit_finds_the_break_in_its_own_readings():
    model = discovered(15.0, 2)[0]
    for shift in (15.0, 22.0):
        (effect,) = accelcal.fit(record_of(shift, 4), model=model).effects
        assert is_covered(effect.parameters["shift"], shift)
        assert is_covered(effect.parameters["slope_change"], SLOPE_CHANGE)


def test_where_the_slopes_have_two_breaks_neither_has_an_uncertainty():
    _, parameters, note = discovered(15.0, 2, 6e-5)
    assert parameters["shift"].expanded_uncertainty is None
    assert parameters["slope_change"].expanded_uncertainty is None
    assert "no law with one break" in note


@pytest.mark.parametrize(("shift", "seed"), [(-45.0, 4), (45.0, 2)])
def test_a_break_with_one_level_beyond_it_has_no_uncertainty(shift, seed):
    """A line leads there from any break before that level; it had a U of 4 degC, or of 1e10."""
    _, parameters, note = discovered(shift, seed)
    assert parameters["shift"].expanded_uncertainty is None
    assert parameters["slope_change"].expanded_uncertainty is None
    assert "a break anywhere between two levels" in note


def test_a_tie_is_made_of_names():
    with pytest.raises(accelcal.InputError, match="tie"):
        accelcal.Effect(
            **{name: getattr(SHIFT, name) for name in ("name", "physics", "formula", "parameters")},
            id="other-shift",
            term=SHIFT.term,
            tie=5,
        )


def test_a_break_is_where_the_slopes_tell_beside_a_level_that_moves():
    """It was 50.1 degC with U 9.6 degC, by the noise of readings that move about that level."""
    plan = TumblePlan(temperatures=(20.0, 50.0, 80.0, -10.0, -40.0), strokes=4, timed=True)
    noise = NoiseComponents(launch=0.0, launch_sf=0.0)
    break_ = accelcal.effect("break-shift")
    hidden = [accelcal.effect("chamber-drift").of(-0.8), break_.of(15.0)]
    record = accelcal.simulate(plan=plan, effects=hidden, noise=noise, seed=9)
    begins = [record.time[record.run == run].min() for run in range(5)]
    fallen = 0.8 * (record.time - np.take(begins, record.run)) / 3600.0
    moved = replace(record, temperature=record.temperature - fallen)
    (found,) = accelcal.discover(moved, effects=[break_]).effects
    shift = found.parameters["shift"]
    assert abs(shift.value - 15.0) < 1.5 * shift.expanded_uncertainty < 2.0
