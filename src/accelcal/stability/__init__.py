"""Random part of the error: repeatability, drift, fluctuation, equation (3), Allan deviation.

`analysis` wires it: launches (`record`) are made even in time (`sampling`); `trend` and `spread`
find drift, fluctuation and repeatability, `bound` the sum (3), `allan` and `noise_terms` the kinds
of noise, `threshold` what small steps of the input tell.
"""
