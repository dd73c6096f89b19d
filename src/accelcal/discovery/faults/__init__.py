"""Faults of the readings: outliers, exchanges, wrong orders, steps and uneven noise."""
