"""Temperature laws: bilinear about T0, from the tables' coefficients or from all readings."""
