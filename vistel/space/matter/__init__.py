"""One step of what matter does by itself: bonds that hold and tear, dents that stay."""
