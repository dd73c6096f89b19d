"""From the text of cells to values.

`cells` has numbers and labels, `thousands` and `sexagesimal` two ways in which numbers are written.
`times`, `places` and `lots` are what a column of them means, and `markers` what is no reading.
"""
