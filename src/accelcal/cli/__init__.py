"""The command line: one file per command, and the options, output and errors that they share.

Nothing here calculates. A command reads its options, calls the library and shows what comes back.
The files import click and one another at the top; the library is imported where a command runs, so
that ``accelcal --help`` stays quick.
"""
