"""Results: frozen, complete at birth, and able to become a JSON document and come back.

`documents` has what writes and reads all of them, `tabular` what makes them texts and tables.
`quantity` and `covariance` are what they consist of.

Found by ``fit``: `calibration`, in whose `table` are the coefficients, beside `temperature`,
`fixture_angle` and `verdict`; `calibration_parts` reads its parts. By ``discover``: `discovery`,
`stand_discovery`, of `findings`. By ``compare``: `disagreement`, `calibration_comparison`, of
`agreement`. By other commands: `error_budget`, `stand_budget` with `stand_requirements`,
`stability`, `designs`, `optimal_design`, `head_calibration`, `triad`, `unit_history`,
`fleet_history`.

What a calibration may be used for: `usable`, `tables_in_use`, `beyond_uncertainty`.
"""
