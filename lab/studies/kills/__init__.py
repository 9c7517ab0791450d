"""Commands that are killed at random moments, meet a full disk or meet each other, and what they leave: ``make kills``."""
