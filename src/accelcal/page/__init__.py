"""Results as pages: one file of HTML, Markdown or PDF, for paper, screen and phone."""
