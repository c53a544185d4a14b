"""How large a scene may be: what keeps a small hostile file from filling the memory."""

from collections.abc import Iterable

from core.conventions import MAX_PAGE_SIZE_PX
from core.errors import AssetInvalid, SceneInvalid

MAX_PAGES = 256
MAX_TEXELS = 32 * MAX_PAGE_SIZE_PX**2  # 32 full pages, 6 GB decoded; large outdoor scenes of the paper take about ten


def check_size(sizes: Iterable[tuple[int, ...]], error: type[AssetInvalid] | type[SceneInvalid]) -> None:
    """Refuses pages of these sizes (height, width) with `error` if there are too many, or too many texels."""
    sizes = list(sizes)
    texels = sum(height * width for height, width in sizes)
    if len(sizes) > MAX_PAGES or texels > MAX_TEXELS:
        raise error(
            "texture pages",
            f"must be at most {MAX_PAGES}, with at most {MAX_TEXELS} texels together",
            f"{len(sizes)} pages with {texels} texels",
            "Lower the texels per quad or the number of quads.",
        )
