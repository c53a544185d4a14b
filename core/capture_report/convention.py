"""What a capture's format is called, and by which convention its poses were read."""

from __future__ import annotations

from pathlib import Path

from core.datasets.detect import find_source

ESTIMATED = "photos without poses; cameras estimated by COLMAP (SIFT, incremental structure from motion)"


def convention_of(path: Path) -> str:
    """Of a posed capture, as a phrase.

    Raises:
        CaptureNotFound, NoImages, PosesMissing
    """
    source = find_source(path)
    if source.is_nerf_synthetic:
        return "NeRF-synthetic: camera to world, OpenGL axes, +z up, one focal length"
    if source.is_colmap:
        return "COLMAP model: world to camera, OpenCV axes, up estimated from the cameras"
    if source.is_llff:
        return "LLFF (poses_bounds.npy): columns down, right, backwards; up estimated from the cameras"
    return "nerfstudio or instant-ngp (transforms.json): camera to world, OpenGL axes, +z up"
