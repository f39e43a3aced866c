"""What is uncertain, and what follows for the hover time."""
