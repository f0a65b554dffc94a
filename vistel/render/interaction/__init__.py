"""What somebody does at a desktop window: look about, walk, pick and drag things; the panel beside the picture."""
