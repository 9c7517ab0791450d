"""Parameters under which predictions differ least from a log."""
