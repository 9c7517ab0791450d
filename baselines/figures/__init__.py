"""The figures of the bench."""
