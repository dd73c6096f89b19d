"""Make examples/triad.csv: a block of three accelerometers, tumbled about its three axes."""

import numpy as np

BIAS = np.array([0.0132, -0.0215, 0.0087])  # mA
SCALE_FACTOR = np.array([1.3124, 1.2987, 1.3051])  # mA/g
AXES = np.array([[1.0, 0.0021, -0.0034], [-0.0015, 1.0, 0.0042], [0.0027, -0.0011, 1.0]])
NOISE = 2e-5  # mA

rng = np.random.default_rng(7)
print("# serial: simulated block\n# g: 9.8106\nshaft,angle,x_mA,y_mA,z_mA")
for shaft, (first, second) in {"z": (0, 1), "x": (1, 2), "y": (2, 0)}.items():
    for angle in range(0, 360, 45):
        up = np.zeros(3)
        up[first], up[second] = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        output = BIAS + SCALE_FACTOR * (AXES @ up) + NOISE * rng.standard_normal(3)
        print(f"{shaft},{angle}," + ",".join(f"{value:.6f}" for value in output))
