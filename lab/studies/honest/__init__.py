"""What sensors that err as data sheets say cost."""
