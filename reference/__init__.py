"""Path-traced and analytic truth with Mitsuba. Never imports `realtime`."""
