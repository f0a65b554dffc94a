"""The pages that browsers show: how soon, how late, for how many."""
