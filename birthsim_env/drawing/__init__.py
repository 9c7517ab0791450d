"""What ``rendering`` draws with. The modules of this package import pygame: load them only when a frame is wanted."""
