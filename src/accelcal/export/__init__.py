"""Calibrations for those who run navigation code: C header, YAML and CSV."""
