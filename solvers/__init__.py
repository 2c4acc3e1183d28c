"""Polynomial systems and all their roots."""
