"""Cameras of photos that come without poses: incremental structure from motion by COLMAP (pycolmap), on the CPU.

    photos -> features (SIFT) -> matches of pairs that overlap -> cameras and points, one photo after another

`pose_photos.pose_photos` is all of it. The model is left in COLMAP's own format, which `core.datasets` reads
like anybody's. It runs in a process of its own: only `structure_from_motion` and what it uses import pycolmap.
"""
