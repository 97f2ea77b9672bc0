"""The contract that both sides share: scenes, geometry, images. Knows neither the GPU nor Mitsuba."""
