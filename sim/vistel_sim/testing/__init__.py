"""The test kit: simulated devices as pytest fixtures (docs/how-to/test-your-integration.md)."""
