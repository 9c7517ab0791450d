"""Real clients, each in a virtual environment of its own: ``make test-weekly``."""
