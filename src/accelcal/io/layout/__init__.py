"""The parts of a table before its cells are read.

`parts` finds `header_lines`, `heading_rows` and the rows of the table, and above them the
`rows_above`, cells of a form. `rows_below` and `output_columns` mend headings by what stands below
them; `output_unit` finds the unit of the outputs wherever it is written.
"""
