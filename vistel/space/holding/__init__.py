"""Who holds what: taking, carrying, sharing, letting go, and what a holding hand feels."""
