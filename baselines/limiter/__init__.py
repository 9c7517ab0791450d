"""What any law can be wrapped in, so that a hand is never given more energy or speed than it should be."""
