"""How shapes are combined, changed into one another and coloured (Singh §3.3, Appendix B)."""
