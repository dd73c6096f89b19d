"""From the text of cells to values.

`cells` has numbers and labels, `thousands` marks in numbers. `times` and `places` are what
a column of them means, and `markers` what is no reading or temperature.
"""
