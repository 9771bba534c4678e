"""Session logs: reading, checking and repairing them, and playing them back."""
