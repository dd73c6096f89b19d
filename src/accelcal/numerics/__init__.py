"""Numerical methods that know nothing of accelerometers: probability, exact sums, groups."""
