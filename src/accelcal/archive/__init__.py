"""Archives: many tables in, one frame out, and none lost on the way.

`batch` finds the files (`sources`), divides them into blocks, and goes `through` them with the
`workers`, as `settings` ask. A `block` is read, large tables in `parts`, fitted, and goes by
`stacked_rows` to the columns of the frames, which `formats` encodes. `failures` words what goes
wrong with a file; `journal` and `lock` keep what is finished when a batch is killed.
"""
