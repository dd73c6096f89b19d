"""The parts of a table before its cells are read.

`parts` finds the headings and the rows of the table, and `rows_above` what `header_lines` and cells
of a form declare above them; `unit_rows` takes units in a row of their own. `units_below` and
`output_columns` mend headings by what stands below them; `output_unit` finds the unit of outputs.
"""
