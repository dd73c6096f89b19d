"""Gates: checks that warn before anyone believes a fit.

Each looks at one way in which a tumble test goes wrong without the fit noticing. A gate passes,
warns, or says why it could not look.

`record` makes all gates of tables of one plan (`plan`), stacked as `stack` has them, and those on
what several tables say together. The gates are in `replicates` (closure, forward against
back, outlier), `drift`, `order`, `resolution` and `sizes` (proportions, units); `verdict` words
what they find. `stroke_groups` looks for the mistake behind a warning.
"""
