"""One calibration beside another one: which coefficients differ by more than both do not know.

`notes` says whether and at which temperature they can be compared, and what is left open; `errors`
has the errors of both together, on which `coefficients` and what is indicated depend; `compare`
tests all differences at once, and makes the result.
"""
