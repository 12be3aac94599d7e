"""Planning of a corridor: fronts of its sections, and the choice of layouts for a budget."""
