"""MobileNeRF's own layout: `shape{i}.obj`, `shape{i}.pngfeat0.png`, `shape{i}.pngfeat1.png`, `mlp.json`.

What the reference implementation (jax3d, projects/mobilenerf) writes into its folders `*_phone`, and what its viewers,
and those for WebXR, Unity and Unreal, read.
"""

from exporters.mobilenerf.axes import Axes
from exporters.mobilenerf.reader import read_mobilenerf
from exporters.mobilenerf.writer import write_mobilenerf

__all__ = ["Axes", "read_mobilenerf", "write_mobilenerf"]
