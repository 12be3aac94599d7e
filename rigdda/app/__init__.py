"""Applications of the library: the command line, reports and the page in the browser."""
