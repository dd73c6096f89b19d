"""Results: frozen, complete at birth, and able to become a JSON document and come back."""
