"""Streams of samples: the `headings` above them, the `reader` of their rows, their `accelerations`.

A stream is read block by block in bounded memory, however long it is.
"""
