"""One calibration beside another one: which coefficients differ by more than both do not know.

`suited` says whether and at which temperature they can be compared, and `notes` what is left open;
`errors` has the errors of both together, `coefficients` what depends on them, `compare` the result.
"""
