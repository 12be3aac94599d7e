"""Uncertain numbers of a site: fits to observations, sensitivity analysis and ground bands."""
