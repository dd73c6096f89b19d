"""Random part of the error: repeatability, drift, fluctuation, equation (3), Allan deviation.

`analysis` wires it: of launches (`record`) `trend` and `spread` find drift, fluctuation,
repeatability and the sum (3), `allan` and `noise_terms` the kinds of noise, `threshold` what small
steps of the input tell.
"""
