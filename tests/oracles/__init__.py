"""What tests compare with, each derived independently of the package."""
