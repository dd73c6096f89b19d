"""Streams of samples: the `headings` above them in their `forms`, and the `reader` of their rows.

A `stream` of accelerations follows from what an `accelerometer` or a `triad` measured, by its
`options` and the `temperatures`; it goes block by block in bounded memory, however long it is.
"""
