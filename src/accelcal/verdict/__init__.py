"""Verdict against a data sheet.

`conformity` is the rule by which each limit is judged, for many calibrations of one plan at once;
`judge` gives its outcomes for one calibration numbers and words.
"""
