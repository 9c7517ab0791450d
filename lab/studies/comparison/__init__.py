"""Every controller under all conditions."""
