"""Response times of the page in the browser."""
