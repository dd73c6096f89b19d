"""How often the uncertainties of ``accelcal apply`` hold the accelerations that a triad measures.

Attitudes, noise and outputs are drawn here, by numpy alone. Each block is calibrated, and the
calibration is applied to noiseless outputs in directions that it has not seen. The true S is lower
triangular, as in the frame of unknown attitudes. Run::

    python benchmarks/apply_triad_coverage.py --blocks 400
"""

from __future__ import annotations

import argparse
import warnings

import numpy as np

import accelcal

BIAS = np.array([0.01, -0.02, 0.03])
SENSITIVITY = np.array([[2.0, 0.0, 0.0], [0.01, 1.9, 0.0], [-0.02, 0.015, 2.1]])
NOISE = 5e-5  # [g], of channel x
ATTITUDES = ((8, True), (24, True), (10, False), (12, False), (18, False), (30, False))
RATIOS = ((1.0, 1.0, 1.0), (1.0, 3.0, 10.0))
POINTS = 40


def directions(rng, count):
    """Directions of the acceleration, evenly over the sphere."""
    drawn = rng.normal(size=(count, 3))
    return drawn / np.linalg.norm(drawn, axis=1)[:, None]


def outputs(acceleration):
    """Outputs of the channels."""
    return BIAS + acceleration @ SENSITIVITY.T


def held(attitudes, known, ratio, seed):
    """Whether each interval holds the acceleration, shape (points, 3); None where it is refused."""
    rng = np.random.default_rng([seed, attitudes])
    up, points = directions(rng, attitudes), directions(np.random.default_rng(1), POINTS)
    noise = NOISE * np.diag(SENSITIVITY) * ratio
    measured = outputs(up) + noise * rng.normal(size=up.shape)
    try:
        triad = accelcal.calibrate_triad(measured, up if known else None)
    except accelcal.DesignError:
        return None
    found = accelcal.apply(triad, outputs(points), same_launch=True)
    return np.abs(found.value - points) <= found.expanded_uncertainty


def main() -> None:
    """Simulate and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--blocks", type=int, default=400)
    parser.add_argument("--smoke", action="store_true", help="few blocks, to see that it works")
    options = parser.parse_args()
    warnings.simplefilter("ignore", accelcal.AccelcalWarning)
    print("| attitudes | noise of x : y : z | refused | % within U | worst direction and axis |")
    print("| --- " * 5 + "|")
    for attitudes, known in ATTITUDES[:1] if options.smoke else ATTITUDES:
        for ratio in RATIOS:
            seeds = range(3 if options.smoke else options.blocks)
            tried = [held(attitudes, known, ratio, seed) for seed in seeds]
            shares = 100.0 * np.mean([each for each in tried if each is not None], axis=0)
            about = f"{attitudes} {'known' if known else 'unknown'}"
            noise = " : ".join(f"{part:g}" for part in ratio)
            refused = sum(each is None for each in tried)
            told = f"{about} | {noise} | {refused} | {shares.mean():.1f} | {shares.min():.1f}"
            print(f"| {told} |", flush=True)


if __name__ == "__main__":
    main()
