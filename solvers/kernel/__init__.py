"""Tracking paths: elimination order, compiled tick, predictor, corrector and step control."""
