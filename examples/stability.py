"""Make examples/stability.csv: six launches of an AL-15 at rest, simulated.

    python examples/stability.py > examples/stability.csv

True values: launch to launch 6.7e-6 g, drift 5e-6 g/h with 1e-6 g/h from launch to launch, white
noise 5e-6 g a sample (1.1e-5 g/sqrt(Hz)), scale factor 1.3 mA/g; the input axis is horizontal.
"""

import numpy as np

random = np.random.default_rng(15)
print("# serial: AL-15\n# unit: mA\n# comment: simulated, no measurement")
print("launch,time,output,temperature")
for launch in range(1, 7):
    time = np.arange(0, 3600, 5)
    bias = 3.324e-3 + random.normal(0.0, 6.7e-6)
    drift = random.normal(5e-6, 1e-6) * time / 3600.0
    output = 1.3 * (bias + drift + random.normal(0.0, 5e-6, time.size))
    temperature = 20.0 + random.normal(0.0, 0.05) + random.normal(0.0, 0.01, time.size)
    for row in zip(time, output, temperature, strict=True):
        print(f"{launch},{row[0]},{row[1]:.7f},{row[2]:.2f}")
