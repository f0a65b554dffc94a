"""Built-in people by specification."""
