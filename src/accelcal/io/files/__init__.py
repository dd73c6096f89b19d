"""Files as text: compression and encodings (`text`), Parquet, and rows that are written as CSV."""
