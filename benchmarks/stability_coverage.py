"""Coverage of the 95 % intervals of gamma_D and sigma_F in one launch, and of noise terms.

python benchmarks/stability_coverage.py [launches]

Each launch has 600 samples, 1 s apart, of one kind of noise and no drift. Prints the share of
launches whose interval holds the truth, beside that of the textbook interval of a slope; and the
width of the interval of gamma_D over that of one which would hold the truth in 95 % with the noise
known. The truth of sigma_F is its root mean square over all launches. Then the same for the
coefficients of the Allan deviation, in records of 4000 samples: of one noise each, and of a ramp in
white noise. A sample is the mean over its interval, as an integrating voltmeter gives it; B and K
once more where it is the value at an instant.
"""

import argparse

import numpy as np

from accelcal.stability.allan import overlapping_allan
from accelcal.stability.components import deviation
from accelcal.stability.noise_terms import noise_terms
from accelcal.stability.record import Launch
from accelcal.stability.trend import fit_trend

SAMPLES = 600
RECORD = 4000


def autoregressive(random, time_constant):
    """First-order noise of variance 1."""
    keep = np.exp(-1.0 / time_constant)
    noise = random.normal(size=SAMPLES)
    noise[1:] *= np.sqrt(1.0 - keep**2)
    for i in range(1, SAMPLES):
        noise[i] += keep * noise[i - 1]
    return noise


def flicker(random):
    """Flicker noise by fractional integration (Kasdin 1995)."""
    k = np.arange(1, SAMPLES)
    response = np.concatenate([[1.0], np.cumprod((k - 0.5) / k)])
    return np.convolve(random.normal(size=SAMPLES), response)[:SAMPLES]


NOISES = {
    "white": lambda random: random.normal(size=SAMPLES),
    "AR(1), 5 s": lambda random: autoregressive(random, 5.0),
    "AR(1), 20 s": lambda random: autoregressive(random, 20.0),
    "AR(1), 60 s": lambda random: autoregressive(random, 60.0),
    "AR(1), 200 s": lambda random: autoregressive(random, 200.0),
    "AR(1), 600 s": lambda random: autoregressive(random, 600.0),
    "flicker": flicker,
    "random walk": lambda random: np.cumsum(random.normal(size=SAMPLES)),
    "white and flicker": lambda random: 2.0 * random.normal(size=SAMPLES) + flicker(random),
    "white and random walk": lambda random: (
        7.3 * random.normal(size=SAMPLES) + np.cumsum(random.normal(size=SAMPLES))
    ),
}


def covered(make, launches, seed=1):
    """Shares of launches whose textbook, gamma_D and sigma_F intervals hold the truth; width."""
    random = np.random.default_rng(seed)
    time = np.arange(float(SAMPLES))
    textbook = drift = 0
    fluctuations, trends = [], []
    for _ in range(launches):
        output = make(random)
        (slope, _), covariance = np.polyfit(time, output, 1, cov=True)
        textbook += abs(slope) < 1.96 * covariance[0, 0] ** 0.5
        trend = fit_trend(Launch("1", time, output))
        drift += trend.lower <= 0.0 <= trend.upper
        trends.append((trend.slope, trend.upper - trend.lower))
        fluctuations.append(deviation(trend.sum_of_squares, trend.dof, "g", trend.effective_dof))
    truth = np.mean([f.value**2 for f in fluctuations]) ** 0.5
    fluctuation = sum(f.lower <= truth <= f.upper for f in fluctuations)
    slopes, widths = np.array(trends).T
    width = np.median(widths) / (2.0 * np.quantile(np.abs(slopes), 0.95))
    return textbook / launches, drift / launches, fluctuation / launches, width


def walk(random):
    """Random walk, eight steps a sample; shape (`RECORD`, 8)."""
    return np.cumsum(random.normal(size=8 * RECORD)).reshape(-1, 8) / 8**0.5


def flicker_by_spectrum(random):
    """Flicker noise by its spectrum, sixteen values a sample; shape (`RECORD`, 16)."""
    size = 4 * 16 * RECORD
    frequency = np.fft.rfftfreq(size)[1:]
    parts = random.normal(size=(2, frequency.size)) * np.sqrt(size / (4.0 * np.pi * frequency))
    noise = np.fft.irfft(np.concatenate([[0.0], parts[0] + 1j * parts[1]]), size)
    return noise[: 16 * RECORD].reshape(-1, 16)


TERMS = {
    "N": lambda random: random.normal(size=RECORD),
    "N, with flicker of 0.14": lambda random: (
        random.normal(size=RECORD) + 0.14 * flicker_by_spectrum(random).mean(axis=1)
    ),
    "B": lambda random: flicker_by_spectrum(random).mean(axis=1),
    "R": lambda random: 100.0 * random.normal(size=RECORD) + np.arange(float(RECORD)),
    "K": lambda random: walk(random).mean(axis=1),
    "Q": lambda random: np.diff(random.normal(size=RECORD + 1)),
    "B, instants": lambda random: flicker_by_spectrum(random)[:, 0],
    "K, instants": lambda random: walk(random)[:, 0],
}
"""Records in which the coefficient that a name begins with is 1."""


def covered_term(name, records, seed=1):
    """Share of records whose interval of a coefficient holds the truth; not identified: missed."""
    random = np.random.default_rng(seed)
    found = (
        noise_terms(overlapping_allan([TERMS[name](random)]), "g")[name[0]] for _ in range(records)
    )
    return (
        sum(term.value is not None and term.lower <= 1.0 <= term.upper for term in found) / records
    )


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("launches", nargs="?", type=int, default=400, help="launches a noise")
    parser.add_argument("--smoke", action="store_true", help="five launches a noise")
    options = parser.parse_args()
    launches = 5 if options.smoke else options.launches
    print(f"{'noise':24s}{'textbook':>10s}{'gamma_D':>10s}{'sigma_F':>10s}{'width':>10s}")
    for name, make in NOISES.items():
        print(f"{name:24s}" + "".join(f"{share:10.3f}" for share in covered(make, launches)))
    for name in TERMS:
        print(f"coefficient {name:24s}{covered_term(name, launches):10.3f}")


if __name__ == "__main__":
    main()
