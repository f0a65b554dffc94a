"""The rigid component: skin that follows the joints."""
