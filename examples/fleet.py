"""Make examples/fleet.csv: calibrations of 60 units over ten years, as accelcal batch has them."""

import numpy as np

STATED, SCATTER = 8.0, 8.0  # standard uncertainty, and scatter that none states [ug and ppm]
DRIFTS, JUMPS = {"AL-15-017": 60.0}, {"AL-15-042": 250.0}  # ug a year, ug

rng = np.random.default_rng(15)
print(
    "serial,source,mounting,date,temperature_degC,output_unit,"
    "k0,k0_standard_uncertainty,K1,K1_standard_uncertainty"
)
for number in range(1, 61):
    serial = f"AL-15-{number:03d}"
    since = rng.integers(0, 5)
    years = np.arange(since, 10 - (number % 12 == 0), 1 + number % 2)
    middle = (since + 10.0) / 2.0
    scale_factor = rng.normal(1.35, 0.02)
    bias = rng.normal(3000.0, 500.0)
    for year in years:
        errors = np.hypot(STATED, SCATTER) * rng.standard_normal(2)
        late = JUMPS.get(serial, 0.0) * (year > middle)
        k0 = bias + DRIFTS.get(serial, 0.0) * year + late + errors[0]  # ug
        k1 = scale_factor * (1.0 + 1e-6 * errors[1])  # mA/g
        day = f"{2015 + year}-{rng.integers(1, 13):02d}-{rng.integers(1, 29):02d}"
        source = f"{2015 + year}/{serial}.csv"
        print(
            f"{serial},{source},o+,{day},20,mA,"
            f"{1e-6 * k0:.8f},{1e-6 * STATED:.1e},{k1:.8f},{1e-6 * STATED * scale_factor:.3e}"
        )
