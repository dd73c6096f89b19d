"""Files in and out: tables of readings and calibration documents.

A table of readings becomes a record in `tables`, by way of `files` (bytes to text), `layout`
(header lines, headings and rows), `columns` (what each column holds, by the `words` of tables),
`engines` and `values` (text to numbers), `readings`, `runs` and `records`. Many ordinary tables at
once take the shorter way of `ordinary` to the same records. Other tables, of a `head`, a `triad` or
a `stability_record`, have headings of their own, and the same header lines and cells.

`of_serial` chooses one unit of several. `samples` has streams to be compensated, `documents`
results in JSON, `toml` what people write by hand: data sheets, stands, laboratories and effects.
"""
