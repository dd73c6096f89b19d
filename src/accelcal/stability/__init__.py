"""Random part of the error: repeatability, drift, fluctuation, equation (3), Allan deviation.

`analysis` wires it: of launches (`record`) `trend` and `components` find drift, fluctuation,
repeatability, the sum (3) and what small steps of the input tell, `allan` and `noise_terms` the
kinds of noise.
"""
