"""The application: the command line, what its commands compute, and their reports."""
