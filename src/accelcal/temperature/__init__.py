"""Temperature laws: bilinear about T0, from the tables' coefficients or from all readings.

`laws` wires them. The coefficients of the tables (`levels`) are fitted by generalised least
squares (`from_tables`), or all readings at once by the product model (`from_readings`). Where
temperatures move within the runs, `felt_deviations` brings the readings to the mean of their run
before that.
"""
