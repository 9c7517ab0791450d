"""How controllers are measured and compared."""
