"""Simulation against a plain oracle, its noise against sampling distributions, its command."""

import itertools
import math
import re
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from accelcal.cli.main import main
from accelcal.effects.catalogue import catalogue, effect
from accelcal.errors import InputError
from accelcal.io.tables import read_table
from accelcal.io.writer import write_table
from accelcal.simulation import (
    AL15,
    NOISE_FREE,
    Accelerometer,
    BilinearLaw,
    NoiseComponents,
    TumblePlan,
    simulate,
)

EXAMPLES = Path(__file__).parents[1] / "examples"
IDEAL = Accelerometer(BilinearLaw(1.0), BilinearLaw(0.0), BilinearLaw(0.0), 0.0, 0.0, 0.0)


def only(**noise):
    """Noise of the named components and no other."""
    return NoiseComponents(**(dict.fromkeys(NoiseComponents.__slots__, 0.0) | noise))


def assert_variance(values, sigma):
    """Sum of squares within the central 1 - 2e-6 of its chi-square distribution."""
    total = float(np.sum((np.asarray(values) / sigma) ** 2))
    assert chi2.ppf(1e-6, len(values)) < total < chi2.ppf(1 - 1e-6, len(values))


# -- the product model -----------------------------------------------------------------------------


def oracle(unit, level, degrees, side, delta0):
    """One reading by the product model of the theory, in plain arithmetic."""
    dT = level - unit.reference_temperature

    def law(value, relative=False):
        slope = value.above if dT > 0 else value.below
        return value.at_T0 * (1 + slope * dT) if relative else value.at_T0 + slope * dT

    th = math.radians(degrees) + delta0
    a_i = math.cos(th)
    a_p = math.sin(th) * (-1 if side.endswith("-") else 1)
    bracket = law(unit.bias) + a_i + unit.k2 * a_i**2 + unit.k3 * a_i**3
    bracket += law(unit.misalignment) * a_p + unit.cross_coupling * a_i * a_p
    return law(unit.scale_factor, relative=True) * bracket


@pytest.mark.parametrize("delta0", [0.0, 2e-3])
@pytest.mark.parametrize("positions", [4, 8, 12])
def test_noise_free_readings_are_those_of_the_product_model(positions, delta0):
    plan = TumblePlan(positions=positions, strokes=3, mountings=("o+", "p-"), delta0=delta0)
    record = simulate(AL15, plan, NOISE_FREE)
    there = [360 * j / positions for j in range(positions + 1)]
    expected = [
        (side, level, stroke, degrees, oracle(AL15, level, degrees, side, delta0))
        for side in ("o+", "p-")
        for level in (20.0, 80.0, -40.0)
        for stroke in (1, 2, 3)
        for degrees in (there if stroke % 2 else there[::-1])
    ]
    sides, levels, strokes, angles, outputs = zip(*expected, strict=True)
    assert record.mounting.tolist() == list(sides)
    assert record.temperature.tolist() == list(levels)
    assert record.stroke.tolist() == list(strokes)
    assert record.angle.tolist() == pytest.approx(angles, abs=1e-12)
    np.testing.assert_allclose(record.output, outputs, rtol=0, atol=5e-15)


def test_figures_of_the_paper():
    """The paper's results, page 4; the scale factor within the data sheet's limits."""
    assert AL15.bias == BilinearLaw(3.324e-3, -3.9e-5, -4.5e-5)
    assert (AL15.scale_factor.above, AL15.scale_factor.below) == (520e-6, 480e-6)
    assert 1.2 <= AL15.scale_factor.at_T0 <= 1.5
    assert (AL15.k2, AL15.k3) == (105e-6, 87e-6)
    assert AL15.misalignment.at_T0 == 1.15e-3
    noise = NoiseComponents()
    assert [3 * noise.head, 3 * noise.launch] == pytest.approx([2e-5, 2e-5], rel=0.01)
    assert 3 * noise.launch_sf == pytest.approx(15e-6)


# -- the plan --------------------------------------------------------------------------------------


def test_default_plan_is_the_test_of_the_paper():
    record = simulate(seed=1)
    assert len(record) == 3 * 6 * 9
    assert [table.temperature[0] for table in record.tables()] == [20.0, 80.0, -40.0]
    first, second = record.position[:9], record.position[9:18]
    assert first.tolist() == [1, 2, 3, 4, 5, 6, 7, 8, 9]
    assert second.tolist() == [9, 8, 7, 6, 5, 4, 3, 2, 1]


def test_times_follow_the_order_of_measuring():
    plan = TumblePlan(strokes=1, seconds_per_reading=30, seconds_between_runs=600, timed=True)
    time = simulate(AL15, plan, NOISE_FREE).time
    assert time[:3].tolist() == [0.0, 30.0, 60.0]
    assert time[9] - time[8] == 630.0
    assert simulate(AL15, TumblePlan(), NOISE_FREE).time is None


def test_angles_instead_of_positions():
    plan = TumblePlan(angles=(0.0, 22.5, 100.0), strokes=2, temperatures=(20.0,))
    record = simulate(AL15, plan, NOISE_FREE)
    assert record.angle.tolist() == [0.0, 22.5, 100.0, 100.0, 22.5, 0.0]
    assert not record.position.any()
    assert record.output[1] == pytest.approx(oracle(AL15, 20.0, 22.5, "o+", 0.0), abs=1e-15)


@pytest.mark.parametrize("step", [1e-7, 1e-4, 2.5e-3])
def test_resolution_rounds_to_the_nearest_step(step):
    fine = simulate(seed=3)
    coarse = simulate(plan=TumblePlan(resolution=step), seed=3)
    steps = coarse.output / step
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    assert np.abs(coarse.output - fine.output).max() <= step * 0.500001
    assert max(len(repr(value)) for value in coarse.output.tolist()) <= 10
    assert coarse.apparatus.resolution == step


def test_declarations_are_those_of_the_noise():
    plan = TumblePlan(delta0=1e-3, local_gravity=9.8106)
    noise = NoiseComponents(head=1e-5, launch=2e-5, launch_sf=3e-6, temperature=0.1)
    declared = simulate(AL15, plan, noise, seed=1)
    stand = declared.apparatus
    assert (stand.head_uncertainty, stand.launch_uncertainty) == (1e-5, 2e-5)
    assert (stand.launch_sf_uncertainty, stand.temperature_uncertainty) == (3e-6, 0.1)
    assert declared.metadata["delta0"] == "0.001"
    silent = simulate(AL15, plan, noise, seed=1, declare=False)
    assert silent.apparatus.head_uncertainty is None
    assert silent.apparatus.local_gravity == stand.local_gravity == 9.8106
    assert np.array_equal(silent.output, declared.output)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: TumblePlan(positions=0), "positions is 0; it is a whole number, 2 or more"),
        (lambda: TumblePlan(strokes=0), "strokes is 0"),
        (lambda: TumblePlan(temperatures=()), "temperatures is empty"),
        (lambda: TumblePlan(temperatures=(20.0, -300.0)), "temperature 2 is -300.0"),
        (lambda: TumblePlan(angles=(0.0, math.inf)), "angle 2 is inf"),
        (lambda: TumblePlan(mountings=("o",)), "mounting 'o' is unknown"),
        (lambda: TumblePlan(seconds_per_reading=0.0), "seconds_per_reading is 0.0"),
        (lambda: TumblePlan(resolution=-1.0), "resolution is -1.0"),
        (lambda: TumblePlan(delta0=math.nan), "delta0 is nan"),
        (lambda: NoiseComponents(head=-1e-5), "head is -1e-05; it is 0 or more"),
        (lambda: Accelerometer(scale_factor=BilinearLaw(0.0)), "scale factor is 0"),
        (lambda: Accelerometer(k2=math.inf), "k2 is inf"),
        (lambda: BilinearLaw(math.nan), "at_T0 is nan"),
        (lambda: simulate(seed=-1), "seed is -1"),
    ],
)
def test_inputs_are_checked_at_birth(build, message):
    with pytest.raises(InputError, match=message):
        build()


# -- the noise -------------------------------------------------------------------------------------


def test_reading_noise_is_new_in_each_reading_and_constant_in_output_units():
    plan = TumblePlan(strokes=40)
    noisy, clean = (
        simulate(AL15, plan, noise, seed=2) for noise in (only(reading=5e-6), NOISE_FREE)
    )
    error = noisy.output - clean.output
    for index in range(3):
        assert_variance(error[noisy.run == index], 5e-6 * AL15.scale_factor.at_T0)
    assert np.unique(error).size > 0.99 * error.size


def test_head_error_belongs_to_the_head_position():
    plan = TumblePlan(positions=360, strokes=2, mountings=("o+", "o-"), temperatures=(20.0, 80.0))
    record = simulate(IDEAL, plan, only(head=1e-5), seed=4)
    turned = np.mod(record.angle, 360.0)
    error = []
    for degrees in np.unique(turned):
        here = record.output[turned == degrees]
        assert np.ptp(here) == 0.0  # strokes, runs, mountings, and the return to J = 1
        th = math.radians(degrees)
        if abs(math.sin(th)) > 0.5:
            error.append(-(here[0] - math.cos(th)) / math.sin(th))
    assert_variance(error, 1e-5)


def test_a_turn_that_starts_off_zero_returns_to_the_same_head_error():
    angles = tuple((np.arange(9) * 45.0 + 0.1).tolist())
    record = simulate(IDEAL, TumblePlan(angles=angles, strokes=1, resolution=0.0), only(head=1e-3))
    assert record.output[8] == pytest.approx(record.output[0], abs=1e-12)
    assert "8 positions" in repr(record)


@pytest.mark.parametrize(
    ("component", "degrees", "sensitivity"),
    [("launch", 90.0, 1.0), ("launch_sf", 180.0, -1.0), ("temperature", 90.0, 3e-3)],
)
def test_errors_of_a_run_are_common_to_its_readings(component, degrees, sensitivity):
    unit = Accelerometer(
        BilinearLaw(1.0), BilinearLaw(0.0, 3e-3, 3e-3), BilinearLaw(0.0), 0.0, 0.0, 0.0
    )
    plan = TumblePlan(angles=(degrees,), strokes=3, temperatures=(20.0,) * 300)
    noise = only(**{component: 1e-3})
    output = simulate(unit, plan, noise, seed=5).output.reshape(300, 3)
    assert np.ptp(output, axis=1).max() == 0.0
    shift = (output[:, 0] - math.cos(math.radians(degrees))) / sensitivity
    assert_variance(shift, 1e-3)


def test_each_component_draws_from_its_own_stream():
    sigma = {"reading": 1e-6, "head": 1e-6, "launch": 1e-6, "launch_sf": 1e-6, "temperature": 1e-3}

    def errors(names):
        noise = only(**{name: sigma[name] for name in names})
        return simulate(noise=noise, seed=6).output - simulate(noise=NOISE_FREE).output

    alone = {name: errors([name]) for name in sigma}
    assert all(np.abs(error).max() > 1e-7 for error in alone.values())
    for first, second in itertools.combinations(sigma, 2):
        together = errors([first, second])
        np.testing.assert_allclose(together, alone[first] + alone[second], rtol=0, atol=2e-10)
        correlation = np.corrcoef(alone[first], alone[second])[0, 1]
        assert abs(correlation) < 0.999


def test_an_effect_leaves_the_draws_of_others_alone():
    shaken, wrong = effect("vibration-noise").of(1e-5), effect("outlier").of(1e-3)
    base = simulate(seed=7).output
    alone = [simulate(effects=[item], seed=7).output - base for item in (shaken, wrong)]
    both = simulate(effects=[shaken, wrong], seed=7).output - base
    np.testing.assert_allclose(both, sum(alone), rtol=0, atol=1e-15)
    twice = simulate(effects=[wrong, wrong], seed=7).output - base
    assert np.count_nonzero(twice) == 2  # the second outlier is drawn afresh


def test_seeds():
    first = simulate(seed=8)
    assert first == simulate(seed=8)
    assert not np.array_equal(first.output, simulate(seed=9).output)
    made_up = simulate()
    seed = int(made_up.metadata["simulated"].removeprefix("seed "))
    assert np.array_equal(made_up.output, simulate(seed=seed).output)


def test_metadata_tell_the_effects():
    effects = [effect("warm-up").of(1e-4, tau=900), effect("backlash").of(2e-5)]
    story = simulate(effects=effects, seed=1).metadata["simulated"]
    assert story == "seed 1, warm-up=0.0001,tau=900.0, backlash=2e-05"


# -- the command -----------------------------------------------------------------------------------


def test_example_is_made_by_its_command(tmp_path):
    made = tmp_path / "al15.csv"
    assert main(["simulate", "--seed", "15", "-o", str(made)]) == 0
    assert made.read_bytes() == (EXAMPLES / "al15.csv").read_bytes()


def test_table_reads_back_as_simulated(tmp_path):
    made = tmp_path / "table.csv"
    command = "simulate --seed 3 --positions 12 --strokes 2 --temperatures 20,80,20 --times"
    options = "--mounting o+ --mounting o- --delta0 1e-3 --resolution 0 --serial X1 --g 9.81"
    effects = "--effect backlash=2e-5 --effect warm-up=1e-4,tau=900"
    assert main(f"{command} {options} {effects} -o {made}".split()) == 0
    plan = TumblePlan(
        positions=12,
        strokes=2,
        temperatures=(20.0, 80.0, 20.0),
        mountings=("o+", "o-"),
        delta0=1e-3,
        timed=True,
        local_gravity=9.81,
    )
    disturbances = [effect("backlash").of(2e-5), effect("warm-up").of(1e-4, tau=900)]
    expected = simulate(Accelerometer(serial="X1"), plan, effects=disturbances, seed=3)
    assert read_table(made) == expected


def test_noise_options_reach_their_components(capsys):
    options = "--reading-noise 1e-9 --head-error 2e-9 --launch-shift 3e-9 --launch-sf-shift 4e-9"
    assert main(f"simulate --seed 1 {options} --temperature-error 5e-9 --resolution 0".split()) == 0
    table = capsys.readouterr().out
    noise = NoiseComponents(1e-9, 2e-9, 3e-9, 4e-9, 5e-9)
    expected = simulate(noise=noise, seed=1)
    outputs = [float(row.split(",")[3]) for row in table.splitlines() if row[0] not in "#t"]
    assert outputs == expected.output.tolist()
    for name in ("head", "launch", "launch_sf", "temperature"):
        assert f"# {name}_uncertainty: {getattr(noise, name)}\n" in table


def test_help_tells_the_defaults_of_the_library():
    command = import_module("accelcal.cli.simulate")
    told = {
        option.name: float(found[1])
        for option in command.simulate.params
        if (found := re.search(r"\[default: ([0-9.e-]+)", option.help or ""))
    }
    noise, plan = NoiseComponents(), TumblePlan()
    for option, component in command._NOISE.items():
        assert told.pop(option) == getattr(noise, component)
    assert told.pop("temperatures") == plan.temperatures[0]
    assert told.pop("resolution") == 1e-7
    assert told == {name: getattr(plan, name) for name in ("positions", "strokes", "delta0")}


def test_undeclared_leaves_the_uncertainties_out(capsys):
    assert main(["simulate", "--undeclared", "--strokes", "1"]) == 0
    assert "uncertainty" not in capsys.readouterr().out


def test_list_of_effects_names_all_with_their_units(capsys):
    assert main(["simulate", "--list-effects"]) == 0
    listed = capsys.readouterr().out
    for entry in catalogue():
        assert (
            f"{entry.id}={entry.parameters[0].name.upper()} [{entry.parameters[0].unit}]" in listed
        )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--effect warmup=1", "did you mean warm-up?"),
        ("--effect warm-up=1,ta=2", "warm-up has no parameter 'ta'; it has amplitude, tau"),
        ("--effect warm-up=1,tau=0", "warm-up: tau is 0.0; it is 0.001 or more [s]"),
        ("--effect position-error=1e-5,at=10", "no reading at 10 deg"),
        ("--effect outlier=1e-3,reading=163", "a whole number from 1 to 162"),
        ("--mounting q", "mounting 'q' is unknown"),
        ("--temperatures -300", "temperature 1 is -300.0"),
        ("--reading-noise -1", "reading is -1.0; it is 0 or more"),
        ("--g 98", "local gravity 98.0 m/s^2"),
    ],
)
def test_bad_option_is_one_line(options, message, capsys):
    assert main(["simulate", *options.split()]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert len(shown.err.splitlines()) == 1
    assert message in shown.err


@pytest.mark.parametrize(
    "options", ["--effect warm-up", "--effect =1", "--seed x", "--positions 0", "--delta0 nan"]
)
def test_malformed_option_ends_with_2(options, capsys):
    assert main(["simulate", *options.split()]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert options.split()[0] in shown.err


# -- the examples ----------------------------------------------------------------------------------


def test_real_example_gives_the_published_calibration():
    """imucal's snapshot example_cal.json (Ferraris method, g = 9.81): K_a and b_a of the x axis.

    github.com/mad-lab-fau/imucal, commit 8716e4c50bbb7044918b747f38b26cb0a6420910, MIT.
    """
    in_y, in_z = (read_table(EXAMPLES / f"mems_x_plane_{axis}.csv") for axis in "yz")
    assert in_y.unit == "counts"
    up, y_up, down, y_down = in_y.output
    _, z_up, _, z_down = in_z.output
    along = np.array([up - down, y_up - y_down, z_up - z_down]) / (2 * 9.81)
    assert np.linalg.norm(along) == pytest.approx(208.54567263762615, rel=1e-14)
    assert (up + down) / 2 == pytest.approx(-6.018868019671572, rel=1e-13)
    direction = along / np.linalg.norm(along)  # R_a, first row
    published = [0.9999125214309234, 0.007122056140390757, -0.011145662922687352]
    assert direction == pytest.approx(published, rel=1e-12)
    for record in (in_y, in_z):
        assert record.angle.tolist() == [0.0, 90.0, 180.0, 270.0]
        assert (record.std > 5).all()
        assert (record.count > 700).all()


# -- files that are there already ------------------------------------------------------------------


@pytest.mark.parametrize("name", ["table.csv", "table.csv.gz"])
def test_a_simulated_table_replaces_a_simulated_table_only(name, tmp_path, monkeypatch, capsys):
    """Measured readings were overwritten without a word."""
    monkeypatch.chdir(tmp_path)
    command = ["simulate", "--temperatures", "20", "-o", name]
    for seed in ("1", "2"):
        assert main([*command, "--seed", seed]) == 0
    assert read_table(name).metadata["simulated"] == "seed 2"
    measured = replace(simulate(seed=3), metadata={"operator": "N. N."})
    write_table(measured, name)
    before = Path(name).read_bytes()
    assert main([*command, "--seed", "1"]) == 2
    said = f"error: -o {name} would overwrite what is no simulated table; name another file with -o"
    assert capsys.readouterr().err == f"{said}\n"
    assert Path(name).read_bytes() == before
    assert main(["simulate", "--list-effects", "-o", name]) == 2
    Path(name).write_bytes(b"")
    assert main([*command, "--seed", "1"]) == 0
