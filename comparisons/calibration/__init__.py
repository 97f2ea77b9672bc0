"""Are the error bars honest? Measured on truths that are known exactly."""
