"""Gates: checks that warn before anyone believes a fit.

Each looks at one way in which a tumble test goes wrong without the fit noticing. A gate passes,
warns, or says why it could not look.

`table` makes all gates of tables of one plan (`plan`), stacked as `stack` has them, and `record`
those on what several tables say together. The gates are in `replicates` (closure, forward against
back, outlier), `drift`, `order`, `resolution` and `sizes` (proportions, units); `verdict` words
what they find. The others help: `swaps` and `stroke_groups` look for the mistake behind a warning,
`copies` for readings that say nothing of their own, and `replicate_plan` has the statistics below.
"""
