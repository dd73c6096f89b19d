"""What stands beside the names of a discovery.

`caveats` and `noise_caveats` are what a reader must know, `otherwise` what else explains the
readings, such as `dead_zone_or_cube`.
"""
