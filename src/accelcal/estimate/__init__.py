"""Estimators of the coefficients and their uncertainty.

`joint.estimate_stack` wires them: `tables` makes each table ready, by the equations (6) too,
`solver` solves it, `noise` finds the noise of the readings, `head` and `launch` find what the head
and the runs add, and `uncertainty` makes standard and expanded uncertainties of these components.
`stacked_tables` takes plain arrays of tables, and `self_calibration` estimates a head together with
the units that were measured on it.

What passes between these modules are named tuples: frozen like the dataclasses of the results, and
made faster at import, which is most of the time of a small fit.
"""
