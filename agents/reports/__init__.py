"""What policies have learned, in figures."""
