"""What describes a rig."""
