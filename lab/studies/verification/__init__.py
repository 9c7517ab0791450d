"""The verification report: what is measured, what keeps each promise, and the page that is generated from both."""
