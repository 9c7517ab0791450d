"""What the page's rig is made of: its parts as data, its code, and all that the page says of it."""
