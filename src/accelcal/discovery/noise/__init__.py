"""Noise, by which a disagreement is judged.

`of_readings` finds it from replicates and declarations, by the ratios of `declared` and the scatter
of `pure_error`. `of_runs` tells whether it differs from run to run, `covariance` what comes of all.
"""
