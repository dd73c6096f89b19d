"""What a test can show, what looks alike in it, and what to measure next."""
