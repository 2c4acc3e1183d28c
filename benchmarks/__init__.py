"""Polynomial systems with published root counts, and the programs that measure on them."""
