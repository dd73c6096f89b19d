"""Files in and out: tables of readings and calibration documents.

A table of readings becomes a record in `tables`, by way of `text` (bytes to text), `layout`
(header lines, headings and rows), `columns` (what each column holds, by the words of
`vocabulary`), `engines` and `cells` (text to numbers), `runs` and `readings`. Many ordinary tables
at once take the shorter way of `ordinary` to the same records. Each other module reads or writes
one kind of file.
"""
