"""Estimators of the coefficients and their uncertainty."""
