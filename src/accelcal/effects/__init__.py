"""The catalogue of effects: what may disturb a tumble test beyond the model (1).

One effect is one entry in one place. The entries stand in files by what they belong to: `shape` of
the conversion function, `temperature`, `time` and history, `stand`, `readings`. To add an entry,
append it to the ``EFFECTS`` of its file, and run docs/effect_pages.py; nothing else changes. A
user adds one with `accelcal.register`, or as a `formula` in a file of effects. Simulation and
discovery read the catalogue through `accelcal.effects.catalogue`.
"""
