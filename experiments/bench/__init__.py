"""This core and other engines of rigid bodies side by side: error against processor time."""
