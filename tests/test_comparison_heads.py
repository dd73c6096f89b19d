"""A comparison on one head and on two: what its errors do to the difference of two tests."""

import json
from dataclasses import replace

import numpy as np
import pytest

import accelcal
from accelcal.cli.main import main
from accelcal.compensate.choice import compensation
from accelcal.discovery.new_record.calibration_errors import calibration_errors
from accelcal.discovery.new_record.simulated import ERRORS
from accelcal.results.quantity import Residuals
from accelcal.simulation import NoiseComponents, TumblePlan, simulate

U, S = 2e-5, 5e-6  # rad, of a head position; g, of a reading
NOISE = NoiseComponents(reading=S, head=U, launch=0.0, launch_sf=0.0)
TURNS = np.deg2rad(np.append(np.arange(8) * 45.0, 360.0))


def measured(seed, noise=NOISE, **plan):
    return simulate(plan=TumblePlan(temperatures=(20.0,), **plan), noise=noise, seed=seed)


def standard_uncertainties(record, **options):
    (run,) = accelcal.compare(accelcal.fit(measured(1)), record, **options).runs
    return [change.standard_uncertainty for change in run.changes]


# -- an oracle: all of it by matrices, from (1) and the angles alone -------------------------------


def columns(side=1.0):
    """Columns of the model at the nine positions of a stroke, and what the eight errors do."""
    c, s = np.cos(TURNS), side * np.sin(TURNS)
    head = np.zeros((9, 8))
    head[np.arange(9), np.arange(9) % 8] = -np.sin(TURNS)
    return np.stack([c**0, c, c**2, c**3, s, c * s], axis=1), head


def oracle(side, one_head, strokes=6):
    """Standard uncertainties of the changes of all coefficients, as `RunChange.changes`."""
    X, Z = columns()
    V = U**2 * Z @ Z.T + S**2 / strokes * np.eye(9)
    estimator = np.linalg.inv(X.T @ np.linalg.inv(V) @ X) @ X.T @ np.linalg.inv(V)
    X2, Z2 = columns(side)
    through = X2 @ estimator
    errors = [Z2 - through @ Z] if one_head else [Z2, through @ Z]
    whole = S**2 / strokes * (np.eye(9) + through @ through.T)
    whole += U**2 * sum(error @ error.T for error in errors)
    changes = X2[:, [0, 1, 4, 2, 3, 5]]
    inverse = np.linalg.inv(whole)
    return np.sqrt(np.diagonal(np.linalg.inv(changes.T @ inverse @ changes)))


@pytest.mark.parametrize("one_head", [True, False])
@pytest.mark.parametrize(("mounting", "side"), [("o+", 1.0), ("o-", -1.0)])
def test_uncertainty_of_a_change_is_that_of_the_matrices(mounting, side, one_head):
    record = measured(2, mountings=(mounting,))
    found = standard_uncertainties(record, same_head=one_head)
    # the noise that replicates tell is that of 46 degrees of freedom, 10 % off and less
    np.testing.assert_allclose(found, oracle(side, one_head), rtol=0.12)


def test_on_one_head_the_misalignment_has_no_error_but_noise():
    # M of one stroke has 0.50 of the noise of a reading (least squares on 8 positions)
    noise_alone = np.sqrt(2.0) * 0.5 * S / np.sqrt(6.0)
    of_one = standard_uncertainties(measured(2), same_head=True)[2]
    assert of_one == pytest.approx(noise_alone, rel=0.12)
    # each reading of the six positions that show it tells M with an error of the head of its own
    of_two = standard_uncertainties(measured(2), same_head=False)[2]
    assert of_two == pytest.approx(np.hypot(noise_alone, np.sqrt(2.0 / 6.0) * U), rel=0.06)
    # on the other side the errors add up in place of cancelling
    turned = standard_uncertainties(measured(2, mountings=("o-",)), same_head=True)[2]
    assert turned == pytest.approx(np.hypot(noise_alone, 2.0 * U / np.sqrt(6.0)), rel=0.06)


def test_errors_of_one_head_are_no_disagreement_and_a_new_misalignment_is():
    # a head as bad as 1e-4 rad: its errors in both tests, one table the copy of the other's head
    rng = np.random.default_rng(7)
    bad = 1e-4 * rng.standard_normal(8)

    def test(seed, turn=0.0):
        quiet = replace(NOISE, head=0.0)
        record = measured(seed, quiet)
        error = bad[(record.position - 1) % 8]
        there = np.deg2rad(record.angle) + error
        change = np.cos(there) - np.cos(np.deg2rad(record.angle)) + turn * np.sin(there)
        return replace(record, output=record.output + 1.35 * change).with_apparatus(
            head_uncertainty=1e-4
        )

    calibration = accelcal.fit(test(1))
    assert accelcal.compare(calibration, test(2), same_head=True).p_value > 0.01
    (seen,) = accelcal.compare(calibration, test(2, 1e-5), same_head=True).runs
    assert seen.misalignment.value == pytest.approx(1e-5, abs=3e-6)
    assert seen.misalignment.expanded_uncertainty < 5e-6
    (lost,) = accelcal.compare(calibration, test(2, 1e-5), same_head=False).runs
    assert lost.misalignment.expanded_uncertainty > 9e-5


def test_intervals_on_one_head_hold():
    # before, of the misalignment all held, in intervals eight times as wide
    held = []
    for seed in range(100):
        rng = np.random.default_rng(seed)
        errors = U * rng.standard_normal(8)

        def test(own, errors=errors):
            record = measured(own, replace(NOISE, head=0.0))
            acting = -np.sin(np.deg2rad(record.angle)) * errors[(record.position - 1) % 8]
            return replace(record, output=record.output + 1.35 * acting).with_apparatus(
                head_uncertainty=U
            )

        calibration = accelcal.fit(test(2 * seed))
        (run,) = accelcal.compare(calibration, test(2 * seed + 1), same_head=True).runs
        held.append([abs(q.value) <= q.expanded_uncertainty for q in run.changes])
    share = np.mean(held, axis=0)
    assert share.min() > 0.89  # 95 % less 2.6 standard errors of 100
    assert share[2] < 0.99


def test_a_change_of_the_shape_is_none_of_the_bias():
    """A bias 100 ug larger was told as 144 +- 14 ug beside a k2 larger by 80 ug/g^2."""
    later = measured(2)
    a_i = np.cos(np.deg2rad(later.angle))
    more = {"bias": 1e-4, "k2": 8e-5, "k3": 1e-4}
    moved = more["bias"] + more["k2"] * a_i**2 + more["k3"] * a_i**3
    record = replace(later, output=later.output + 1.35 * moved)
    (run,) = accelcal.compare(accelcal.fit(measured(1)), record, same_head=False).runs
    for name in ("bias", "scale_factor", "k2", "k3"):
        change = getattr(run, name)
        assert change.value == pytest.approx(more.get(name, 0.0), abs=change.expanded_uncertainty)


def test_a_bias_is_seen_better_than_the_shape_beside_it_leaves_of_it():
    later = measured(2)
    record = replace(later, output=later.output + 1.35 * 3e-5)
    found = accelcal.compare(accelcal.fit(measured(1)), record, same_head=False)
    assert found.verdict == "disagree"
    assert found.runs[0].bias.expanded_uncertainty > 2.5e-5


# -- which head it was -----------------------------------------


def lines(record, **metadata):
    return replace(record, metadata={**record.metadata, **metadata})


@pytest.mark.parametrize(
    ("first", "second", "same"),
    [
        ({"head": "H7"}, {"head": "h7 "}, True),
        ({"Head": "H7"}, {"head": "H8"}, False),
        ({"stand": "A"}, {"stand": "A"}, True),
        ({"stand": "A"}, {"stand": "B"}, False),
        ({"stand": "A", "head": "1"}, {"stand": "A", "head": "2"}, False),
        ({"head": "H7"}, {}, None),
        ({"head": "H7"}, {"stand": "H7"}, None),
        ({"Stand": "12.03.2024"}, {"Stand": "14.03.2024"}, None),
    ],
)
def test_lines_of_both_tables_tell_the_head(first, second, same):
    calibration = accelcal.fit(lines(measured(1), **first))
    found = accelcal.compare(calibration, lines(measured(2), **second))
    assert found.same_head is same
    assert any("measured on one head" in note for note in found.notes) is (same is None)
    assert accelcal.compare(calibration, lines(measured(2), **second), same_head=True).same_head


def test_a_file_is_on_the_head_of_its_own_calibration(tmp_path):
    accelcal.write_table(measured(1), tmp_path / "own.csv")
    record = accelcal.read_table(tmp_path / "own.csv")
    assert accelcal.compare(accelcal.fit(record), record).same_head is True


def test_where_nothing_tells_the_head_the_wider_interval_counts():
    for mountings in (("o+",), ("o-",)):
        record = measured(2, mountings=mountings)
        one, two, unknown = (
            standard_uncertainties(record, same_head=told) for told in (True, False, None)
        )
        np.testing.assert_allclose(unknown, np.maximum(one, two))


def test_another_clamping_is_not_the_same_positions_of_a_head():
    record = measured(2)
    turned = replace(record, clamping=np.full(len(record), 90.0))
    found = accelcal.compare(accelcal.fit(measured(1)), turned, same_head=True)
    assert found.same_head is None


def test_a_calibration_without_its_readings_does_not_know_its_head():
    calibration = accelcal.fit(measured(1))
    table = calibration.tables[0]
    bare = replace(calibration, tables=(replace(table, residuals=Residuals()),))
    found = accelcal.compare(bare, measured(2), same_head=True)
    assert found.same_head is None
    assert found.notes[0].startswith("the calibration tells no positions of its head, or too many")
    (one,), (two,) = found.runs, accelcal.compare(calibration, measured(2), same_head=False).runs
    u = two.misalignment.standard_uncertainty
    assert one.misalignment.standard_uncertainty == pytest.approx(u, rel=0.01)


def test_a_calibration_with_a_step_taken_out_knows_its_head():
    """It was said to tell no positions, and both heads counted as two, whatever was declared."""
    step = accelcal.effect("bias-step").of(4e-5)
    plan = accelcal.TumblePlan(timed=True)
    first, second = (accelcal.simulate(plan=plan, effects=[step], seed=n) for n in (2, 3))
    model = accelcal.discover(first)
    assert [item.id for item in model.effects] == ["bias-step"]
    calibration = accelcal.fit(first, model=model)
    assert accelcal.compare(calibration, second, same_head=True).same_head is True
    assert "tells no positions" not in " ".join(accelcal.compare(calibration, second).notes)


def test_a_head_of_very_many_positions_counts_as_two():
    plan = TumblePlan(temperatures=(20.0,), positions=1440, strokes=1)
    calibration = accelcal.fit(simulate(plan=plan, noise=NOISE, seed=1))
    assert accelcal.compare(calibration, measured(2), same_head=True).same_head is None


def test_no_question_of_the_head_where_it_has_no_error():
    quiet = replace(NOISE, head=0.0)
    assert accelcal.compare(accelcal.fit(measured(1, quiet)), measured(2, quiet)).notes == ()


def test_the_command_is_told_the_head(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for seed in (1, 2):
        accelcal.write_table(measured(seed), tmp_path / f"{seed}.csv")
    assert main(["fit", "1.csv", "-o", "cal.json", "--format", "json"]) == 0
    told = {"--same-head": True, "--other-head": False}
    for option, same in told.items():
        capsys.readouterr()
        assert main(["compare", "cal.json", "2.csv", option, "--format", "json"]) == 0
        assert json.loads(capsys.readouterr().out)["same_head"] is same
    assert main(["compare", "cal.json", "2.csv", "--same-head"]) == 0
    assert "heads: one, whose errors are common to calibration" in capsys.readouterr().out


def test_what_a_correction_left_of_the_head_is_not_the_error_of_a_record(tmp_path):
    # a certificate of 0.5 arcsec for a head of 20 urad: the record still has the 20 urad
    head = tmp_path / "head.csv"
    rows = "".join(f"{45 * j},0.0,0.5\n" for j in range(8))
    head.write_text("angle,error [arcsec],uncertainty [arcsec]\n" + rows)
    calibration = accelcal.fit(measured(1), head=accelcal.read_head(str(head)))
    undeclared = measured(2).with_apparatus(head_uncertainty=None)
    for record, size, verdict in ((undeclared, None, "no verdict"), (measured(2), U, "agree")):
        found = accelcal.compare(calibration, record, same_head=True)
        assert [source.value for source in found.noise if source.name == "head"] == [size]
        assert found.same_head is None
        assert found.verdict == verdict
        assert any("is not corrected, which has them as well" in note for note in found.notes)


# -- the other side and the other axis -----------------------------------------


def test_the_other_side_of_what_was_calibrated_is_said():
    record = measured(2, mountings=("o-",))
    said = accelcal.compare(accelcal.fit(measured(1)), record, same_head=False).notes
    assert said[0].startswith("mounting o- is the other side of what was calibrated: twice the")
    both = accelcal.fit(measured(1, mountings=("o+", "o-")))
    assert accelcal.compare(both, record, same_head=False).notes == ()


def test_the_other_axis_has_the_uncertainty_of_its_own_misalignment():
    # six strokes in o+ and one in p+: M_P of one stroke has 0.50 of the noise of a reading
    quiet = replace(NOISE, head=0.0)
    both = measured(1, quiet, mountings=("o+", "p+"))
    uneven = both.select((both.mounting == "o+") | (both.stroke == 1))
    record = measured(2, quiet, mountings=("p+",), strokes=40)
    (run,) = accelcal.compare(accelcal.fit(uneven), record).runs
    assert run.misalignment.standard_uncertainty == pytest.approx(0.5 * S, rel=0.35)
    # by six strokes, which were taken before, it were 0.20 of it
    (of_main,) = accelcal.compare(accelcal.fit(both), record).runs
    assert of_main.misalignment.standard_uncertainty < 0.25 * S


def test_a_run_in_both_axes_has_two_misalignments():
    def test(seed, turn=0.0):
        record = measured(seed, mountings=("o+", "p+"))
        askew = np.where(record.mounting == "p+", np.sin(np.deg2rad(record.angle)), 0.0)
        output = record.output + 1.35 * turn * askew
        return replace(record, output=output, run=0 * record.run, run_labels=("only",))

    found = accelcal.compare(accelcal.fit(test(1)), test(2, 2e-4))
    assert [change.mounting for change in found.runs] == ["o+", "p+"]
    first, other = (change.misalignment for change in found.runs)
    assert abs(first.value) < first.expanded_uncertainty
    assert other.value == pytest.approx(2e-4, abs=other.expanded_uncertainty)
    assert found.run_names == ["only, o+", "only, p+"]
    assert "  only, p+" in str(found)


def test_fixture_angles_of_both_axes_are_their_own():
    four = ("o+", "o-", "p+", "p-")

    def test(seed):
        record = measured(seed, mountings=four)
        there = np.deg2rad(record.angle)
        askew = np.where(np.char.startswith(record.mounting, "o"), 1e-3, -5e-4)
        return replace(
            record, output=record.output + 1.35 * (np.cos(there + askew) - np.cos(there))
        )

    calibration = accelcal.fit(test(1))
    assert accelcal.compare(calibration, test(2), same_head=False).p_value > 0.01


# -- what an error of each position of the head does to a calibration ------------------------------


@pytest.mark.parametrize(
    ("mountings", "delta0"),
    [(("o+",), 0.05), (("o-",), 0.0), (("o+", "o-"), 0.0), (("o-", "o+", "p+", "p-"), 0.0)],
)
def test_errors_by_the_head_are_those_of_a_calibration_with_them(mountings, delta0):
    nothing = NoiseComponents(reading=0.0, head=0.0, launch=0.0, launch_sf=0.0)
    plan = TumblePlan(temperatures=(20.0,), mountings=mountings)
    record = simulate(plan=plan, noise=nothing, seed=1).with_apparatus(head_uncertainty=0.0)

    def fitted(error):
        """Calibration of readings with an error of each position [rad]."""
        there = record.angle + np.degrees(error[(record.position - 1) % 8])
        output = record.output.copy()
        for mounting in mountings:
            own = record.mounting == mounting
            at = accelcal.accelerations(there[own], delta0, mounting)
            output[own] = accelcal.design_matrix(at, mounting) @ [2.0, 1.3, 1e-5, 1e-5, 0.0, 0.0]
        return accelcal.fit(replace(record, output=output), delta0=delta0)

    def parameters(calibration):
        """What the calibration tells, by the names of `ERRORS`; K1 is relative."""
        found = compensation(calibration)
        main, *others = found.axes
        told = {"k0": found.k0.at_T0, "K1": found.K1.at_T0 / 1.3, "k2": found.k2, "k3": found.k3}
        for name, axis in zip(("", "other "), (main, *others), strict=False):
            told |= {f"{name}delta": axis.delta.at_T0, f"{name}delta_ip": axis.delta_ip}
        for name, freed in zip(("", "other "), calibration.fixture_angle, strict=False):
            told[f"{name}delta0"] = freed.angle.value
        return told

    true = fitted(np.zeros(8))
    by_head = calibration_errors(true, compensation(true)).by_head
    for place, error in enumerate(1e-6 * np.eye(8)):
        above, below = parameters(fitted(error)), parameters(fitted(-error))
        expected = [(above[n] - below[n]) / 2e-6 if n in above else 0.0 for n in ERRORS]
        np.testing.assert_allclose(by_head[:, place], expected, atol=1e-4)


@pytest.mark.parametrize(
    ("calibrated", "measured", "same", "share"),
    [
        (("o+",), "o+", False, 2.0),  # two clampings
        (("o+",), "o+", True, 0.0),  # one, which cancels
        (("o+",), "o-", False, 2.0),
        (("o+",), "o-", True, 4.0),  # one, which has the other sign on the other side
        (("o+", "o-"), "o-", True, 0.0),  # it is known apart
        (("p+", "o+"), "o+", False, 2.0),
    ],
)
def test_the_uncertainty_of_the_fixture_angle_counts_in_the_misalignment(
    calibrated, measured, same, share
):
    """The option was refused beside readings."""
    u = 5e-5
    known, new = (
        accelcal.simulate(plan=accelcal.TumblePlan(temperatures=(20.0,), mountings=own), seed=seed)
        for own, seed in ((calibrated, 1), ((measured,), 2))
    )
    calibration = accelcal.fit(known)
    less, more = (
        accelcal.compare(calibration, new, same_head=same, fixture_uncertainty=size)
        for size in (0.0, u)
    )
    changes = [found.runs[0].misalignment.standard_uncertainty ** 2 for found in (less, more)]
    assert changes[1] - changes[0] == pytest.approx(share * u**2, rel=0.02, abs=1e-13)
    assert less.runs[0].bias.standard_uncertainty == pytest.approx(
        more.runs[0].bias.standard_uncertainty, rel=1e-3
    )
    assert any("counts with a standard uncertainty of 50 urad" in note for note in more.notes)
