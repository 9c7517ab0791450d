"""The rig in the browser: one simulated rig in real time, a page that shows it, and hands that drag it."""
