"""What a user of the wheel alone finds, who types what README and documentation say."""
