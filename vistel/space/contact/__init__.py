"""Where bodies meet: near primitives, patches they share, pressure and force."""
