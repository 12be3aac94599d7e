"""The core of `rigdda` and other engines of rigid bodies side by side: error against processor time."""
