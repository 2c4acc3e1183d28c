"""Kinematic synthesis of linkages, completely."""
