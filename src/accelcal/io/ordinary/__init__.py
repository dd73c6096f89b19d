"""Ordinary tables, many at once: the long form with commas, decimal points and nothing missing.

`reader` finds the ordinary ones, `cell_blocks` parses the rows of many together, `plans` divides
them by table and serial and tells where the readings were taken, and `rows` makes the records.
All other tables are left to the general reader.
"""
