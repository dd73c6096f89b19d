"""From the output of a calibrated accelerometer back to acceleration: equation (1) inverted.

`apply` gives accelerations as `measured`, those of a block by `triad`, and `at_temperature` gives
coefficients. Both take what a calibration gives from `choice`, which also tells the `assumptions`:
laws, the table of one run (`of_table`), the mean of several (`runs`) or levels (`by_levels`), with
the `ranges` for which they are good. `coefficients` and `levels` are what comes out of it, at any
temperature; `inversion` solves for the acceleration, and `propagation` carries the uncertainty.
"""
