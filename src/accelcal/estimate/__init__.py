"""Estimators of the coefficients and their uncertainty.

What passes between these modules are named tuples: frozen like the dataclasses of the results, and
made faster at import, which is most of the time of a small fit.
"""
