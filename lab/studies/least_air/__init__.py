"""The schedule of pneumatic stiffness that needs least air: what could be saved, and what it costs (docs/air.md)."""
