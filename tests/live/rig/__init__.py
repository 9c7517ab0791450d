"""The rig behind the page: control periods, the hand, settings, a second rig."""
