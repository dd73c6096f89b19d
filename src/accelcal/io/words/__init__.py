"""Words: those of tables (`vocabulary`, `head_words`), and what `headings` mean by them."""
