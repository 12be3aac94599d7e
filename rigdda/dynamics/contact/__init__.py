"""Detection of contacts and the law that they follow."""
