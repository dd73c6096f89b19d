"""A new record beside a calibration: whether they agree, by all that is uncertain in both."""
