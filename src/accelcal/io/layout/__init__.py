"""The parts of a table before its cells are read.

`parts` finds the headings and the rows of the table, and `rows_above` what `header_lines` and cells
of a form declare above them; `separators` splits rows. `rearranged` brings tables of other forms
into one, `output_headings` and `output_columns` find outputs and their unit.
"""
