"""Budget of the stand: what head, level, chamber and voltmeter do to each coefficient (GUM).

The components of a `stand` are of certain `kinds` and act on the `readings` of a test; `estimator`
takes readings to coefficients. `budget` propagates uncertainties (JCGM 100), `monte_carlo`
distributions (JCGM 101). `requirements` asks the other way round, and whether the stand suffices
for a data sheet.
"""
