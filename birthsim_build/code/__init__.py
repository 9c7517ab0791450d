"""From stages to machine code of another processor."""
