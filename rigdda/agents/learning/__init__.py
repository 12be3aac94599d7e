"""Learning of policies: relative layouts, their forecasts and outcomes, and training algorithms."""
