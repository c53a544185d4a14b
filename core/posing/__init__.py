"""Cameras of photos that come without poses: incremental structure from motion by COLMAP (pycolmap), on the CPU.

    photos -> features (SIFT) -> matches of pairs that overlap -> cameras and points, one photo after another

`structure_from_motion.pose_photos` is all of it. The model is left in COLMAP's own format, which `core.datasets` reads
like anybody's. `photo_set` and `posing`, which the server needs, do without pycolmap.
"""
