"""What model and barriers share: terrain, surfaces, grounds, prices and the barrier zone."""
