"""The paper's results, reproduced from simulated records: its table, its Figures 3 and 4.

    python examples/al15/paper.py            prints the table, writes figure3.png and figure4.png
    python examples/al15/paper.py FOLDER     writes them there

The AL-15 is simulated with the paper's coefficients, on the paper's stand: through its temperatures
up and down, then six launches of twelve hours at rest. accelcal is told none of them; the table
holds what it finds beside what the paper gives. Needs matplotlib and allantools:
pip install "accelcal[plot,stability]".
"""

import sys
from pathlib import Path

import numpy as np
from scipy.stats import chi2

import accelcal

LEVELS = (20.0, 50.0, 80.0, 50.0, 20.0, -10.0, -40.0, -10.0, 20.0)
HYSTERESIS = 1e-4  # g; the paper's 3e-4 g is a bound of 3 sigma
SIGMA = 2e-5 / 3.0  # g; the paper's bounds of 2e-5 g are 3 sigma
DRIFT = 2e-5 / 12.0  # g/h; 2e-5 g in 12 h
HOURS, STEP = 12, 60  # length of a launch, seconds from sample to sample


def tumble_test() -> accelcal.TumbleRecord:
    """Nine runs, with thermal hysteresis; what repeats itself is left for the fit to estimate."""
    record = accelcal.simulate(
        accelcal.AL15,
        accelcal.TumblePlan(temperatures=LEVELS, local_gravity=9.8106),
        effects=[accelcal.effect("temperature-hysteresis").of(HYSTERESIS)],
        seed=2009,
    )
    return record.with_apparatus(launch_sf_uncertainty=None)


def launches() -> accelcal.StabilityRecord:
    """Six launches at rest, bias in g: a shift of each, drift, fluctuation."""
    random = np.random.default_rng(2009)
    time = np.arange(0.0, HOURS * 3600.0, STEP)
    return accelcal.StabilityRecord(
        tuple(
            accelcal.Launch(
                label=str(number),
                time=time,
                output=3.324e-3
                + random.normal(0.0, SIGMA)
                + DRIFT * time / 3600.0
                + random.normal(0.0, SIGMA, time.size),
                temperature=20.0 + 0.1 * np.sin(time / 9000.0) + random.normal(0, 0.02, time.size),
            )
            for number in range(1, 7)
        ),
        unit="g",
    )


def comparison(calibration, stability) -> list[tuple[str, float, float, float, float, str]]:
    """Name, the paper's figure, ours, lower and upper limit of 95 %, unit."""
    table = calibration.tables[0].error_model
    laws = calibration.temperature_model
    rows = [
        _instability(calibration),
        _row("k0", 3.324, laws.k0.at_T0, 1e3, "mg"),
        _row("k2", 105.0, table["k2"], 1e6, "ug/g^2"),
        _row("k3", 87.0, table["k3"], 1e6, "ug/g^3"),
        _row("delta", 1.15, laws.delta.at_T0, 1e3, "mrad"),
        _row("lambda1", -39.0, laws.k0.above, 1e6, "ug/degC"),
        _row("lambda2", -45.0, laws.k0.below, 1e6, "ug/degC"),
        _row("beta1", 520.0, laws.K1.above, 1e6, "ppm/degC"),
        _row("beta2", 480.0, laws.K1.below, 1e6, "ppm/degC"),
        _row("h_T (3 sigma)", 300.0, laws.hysteresis, 3e6, "ug"),
    ]
    for name, symbol, factor in (
        ("k0L (3 sigma)", "k0L", 1e6),
        ("k0D in 12 h", "gamma_D", 1e6 * HOURS * 3600.0),  # gamma_D is in g/s
        ("k0F (3 sigma)", "k0F", 1e6),
    ):
        found = stability.components[symbol].times(factor)
        rows.append((name, 20.0, found.value, found.lower, found.upper, "ug"))
    return rows


def _instability(calibration):
    """Scale factor from run to run, from the levels that were met more than once."""
    source = next(s for s in calibration.error_sources if s.name == "launch_sf")
    low, high = chi2.ppf((0.975, 0.025), source.dof)
    limits = (3e6 * source.value * (source.dof / quantile) ** 0.5 for quantile in (low, high))
    return "k1 (3 sigma)", 15.0, 3e6 * source.value, *limits, "ppm"


def _row(name, paper, quantity, factor, unit):
    value, half = factor * quantity.value, factor * quantity.expanded_uncertainty
    return name, paper, value, value - half, value + half, unit


def print_table(rows) -> bool:
    """Print the paper beside accelcal; tell whether every interval holds the paper's figure."""
    print(f"{'':16}{'paper':>10}{'accelcal':>12}{'95 % interval':>24}  unit")
    held = True
    for name, paper, value, lower, upper, unit in rows:
        inside = lower <= paper <= upper
        held = held and inside
        mark = "" if inside else "   <- outside"
        print(f"{name:16}{paper:10.4g}{value:12.5g}{lower:12.5g} .. {upper:<8.5g}  {unit}{mark}")
    return held


def figure3(calibration, path) -> None:
    """Bias against temperature, heating and cooling, and scale factor against temperature."""
    import matplotlib.pyplot as plt

    rise = np.array([table.temperature_degC for table in calibration.tables]) - 20.0
    k0 = [table.error_model["k0"] for table in calibration.tables]
    K1 = [table.coefficients["K1"] for table in calibration.tables]
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    left.plot(rise, [1e3 * q.value for q in k0], color="0.7", zorder=0)
    heated = np.concatenate([[False], np.diff(rise) > 0])
    cooled = np.concatenate([[False], np.diff(rise) < 0])
    for chosen, label, marker in (
        (heated, "reached by heating", "^"),
        (cooled, "reached by cooling", "v"),
        (~heated & ~cooled, "start", "o"),
    ):
        left.errorbar(
            rise[chosen],
            [1e3 * q.value for q, c in zip(k0, chosen, strict=True) if c],
            [1e3 * q.expanded_uncertainty for q, c in zip(k0, chosen, strict=True) if c],
            fmt=marker,
            label=label,
        )
    left.set(title="(a) bias", xlabel="T - T0 [degC]", ylabel="k0 [mg]")
    left.legend()
    right.plot(rise[np.argsort(rise)], np.array([q.value for q in K1])[np.argsort(rise)], "o-")
    right.set(title="(b) scale factor", xlabel="T - T0 [degC]", ylabel="K1 [mA/g]")
    figure.savefig(path, dpi=120)


def figure4(record, path) -> None:
    """Bias and temperature of two launches against time."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(10, 6), sharex=True, layout="constrained")
    for column, launch in zip(axes.T, record.launches[:2], strict=True):
        hours = launch.time / 3600.0
        trend = np.polynomial.Polynomial.fit(hours, 1e6 * launch.output, 1)
        column[0].plot(hours, 1e6 * launch.output - 3324.0, color="0.6", linewidth=0.6)
        column[0].plot(hours, trend(hours) - 3324.0, label="trend")
        column[0].set(title=f"launch {launch.label}", ylabel="k0 - 3.324 mg [ug]")
        column[0].legend()
        column[1].plot(hours, launch.temperature, linewidth=0.6)
        column[1].set(xlabel="time [h]", ylabel="temperature [degC]")
    figure.savefig(path, dpi=120)


def main(folder: Path) -> int:
    """Reproduce; exit 1 where an interval leaves a figure of the paper out."""
    calibration = accelcal.fit(tumble_test())
    record = launches()
    held = print_table(comparison(calibration, accelcal.analyse(record, times=(600.0, 43200.0))))
    figure3(calibration, folder / "figure3.png")
    figure4(record, folder / "figure4.png")
    print(f"wrote {folder / 'figure3.png'} and {folder / 'figure4.png'}")
    return 0 if held else 1


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path.cwd()))
