"""What policies have learned, in pictures and numbers."""
