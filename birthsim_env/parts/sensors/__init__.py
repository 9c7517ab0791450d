"""What a controller is shown of the rig."""
