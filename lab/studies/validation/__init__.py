"""The plant's assumptions beside measured data."""
