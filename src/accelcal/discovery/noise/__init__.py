"""Noise, by which a disagreement is judged.

`of_readings` finds it from replicates and declarations, by the scatter of `pure_error`, which also
tells whether it differs from run to run.
"""
