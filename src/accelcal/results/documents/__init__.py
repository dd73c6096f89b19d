"""Documents of JSON: how a result is written as one, and read back from it.

`checked` takes what stands in a document for what it must be, `fields` writes and reads the fields
of a result by their types, `stored` whole documents by their schema, and `json_text` has the text.
"""
