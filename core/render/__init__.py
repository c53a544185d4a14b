"""Renderers of a BakedScene: `reference` (slow, readable, float64) and `raster` (fast). Import-free."""
