"""Learning of policies: relative layouts, their forecasts and outcomes, one algorithm a file."""
