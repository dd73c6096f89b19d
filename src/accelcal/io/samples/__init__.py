"""Streams of samples: the `headings` above them, and the `reader` of their rows.

A `stream` of accelerations follows from what one of the `instruments` measured; it goes block by
block in bounded memory, however long it is.
"""
