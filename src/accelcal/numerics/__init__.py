"""Numerical methods that know nothing of accelerometers: probability, sums, groups."""
