"""What things remember: dents and bonds, as values."""
