"""Effects of a discovery outside the record in which they were found.

`correction` takes them out of the readings of another record: `carrying_over` tells which have
their size there, `another_record` what they, or others in their place, are in it.
`action` is what they do to an acceleration, `twin` makes them ready to be simulated.
"""
