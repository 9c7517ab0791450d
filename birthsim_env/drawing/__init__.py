"""Pictures of the rig. Modules here import pygame, all but ``scene``: load them only when a frame is wanted."""

import os

# Pygame's greeting would end up in the output of the console commands.
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
