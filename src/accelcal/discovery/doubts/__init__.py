"""What stands beside the names of a discovery.

`caveats` are what a reader must know, `otherwise` and `as_well` what else explains the readings.
"""
