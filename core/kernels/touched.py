"""Lists of the texels that a batch touched, one for each part: a texel may stand on several."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.func
def is_listed_before(stamp: wp.array2d(dtype=wp.int32), i: int, part: int, batch: int):
    """Whether an earlier part lists texel i, too. stamp: [parts, texels], the last batch that touched a texel."""
    for p in range(part):  # noqa: SIM110 -- kernels know no `any`
        if stamp[p, i] == batch:
            return True
    return False
