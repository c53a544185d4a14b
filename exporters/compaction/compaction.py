"""A scene in fewer bytes: the steps in turn."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from core.baked import BakedScene, Page
from core.conventions import FEATURE_CHANNELS, is_opaque
from exporters.compaction.filling import filled
from exporters.compaction.packing import packed
from exporters.compaction.quads import CHANNELS, Patches, Quads, joined, quads_of
from exporters.compaction.recoding import Recoding, recoding_of, widened
from exporters.compaction.resampling import shrunk
from exporters.compaction.resolution import LEADING, SizeOptions, Trade, best_sizes, picked, size_options
from exporters.compaction.sharing import with_constant_axes_collapsed, with_equal_patches_shared, without_empty
from exporters.compaction.surface import surface_points
from exporters.threads import mapped, products_on_one_thread

T = TypeVar("T")
SAMPLE_POINTS = 40_000
SAMPLE_QUADS, SAMPLE_TEXELS = 8_000, 1 << 20
SEARCH_STEPS = 14
FINEST_STEP = 1e-4
LEAST_BITS = 0.2  # of a channel
BITS_OF_HOLES = 0.5
LEAST_WEIGHT = 1e-30  # times an infinite error stays infinite


@dataclass(frozen=True)
class Quality:
    """How much may change.

    Attributes:
        color_db: PSNR of the surface's colours after against before, seen so close that every texel shows; at a
            distance texels are averaged and it is higher.
        fallback_db: the same of the fallback's colours.
        most: largest side of a patch as a share of its own; below 1, what is lost by that alone is not counted.
        hole_cost: squared error (sum over RGB) of a hole that is filled or made; infinite: none is.
    """

    color_db: float
    fallback_db: float
    most: float = 1.0
    hole_cost: float = np.inf


# On screen 45 dB at least, and more where a pixel averages texels; far below what a photo's own noise hides.
WEB = Quality(color_db=44.0, fallback_db=36.0)
# Half the texels a side. Silhouettes may move by parts of a texel.
PHONE = Quality(color_db=36.0, fallback_db=33.0, most=0.5, hole_cost=0.5)


def repacked(scene: BakedScene) -> BakedScene:
    """The same scene, to the bit, on as few and small pages as will do.

    Every lookup on every triangle finds the same texel: quads that are all hole go, axes along which nothing changes
    take one texel, equal patches are shared, and patches of all sizes are packed tightly. A page that is not made of
    quads with patches (`quads_of`) stays as it is.
    """
    parts, others = _parts(scene)
    return replace(scene, pages=(*_lossless(parts), *others)) if parts else scene


def compacted(scene: BakedScene, quality: Quality = WEB) -> BakedScene:
    """The scene in fewer bytes, its colours within `quality` of what they were.

    Features are recoded and rounded (recoding.py), patches take the resolution that they need (resolution.py), and what
    `repacked` does is done. Features under holes are no longer zero, but for the first.
    """
    with products_on_one_thread():
        return _compacted(scene, quality)


def _compacted(scene: BakedScene, quality: Quality) -> BakedScene:
    seen = surface_points(scene, SAMPLE_POINTS)
    if len(seen.features_u8) == 0:
        return repacked(scene)
    recoding = recoding_of(scene.network, seen)
    for page in scene.pages:
        recoding = widened(recoding, page.features_u8)
    parts, others = _parts(scene)
    pages: list[Page] = []
    if parts:
        recoding, trade = _settled(parts, recoding, quality)
        reduced = _reduced_in_turn(parts, recoding, trade, quality)
        if not reduced and not others:
            return repacked(scene)
        pages += _lossless(reduced) if reduced else ()
    else:
        recoding = _coarsest(recoding, quality)
    pages += [_recoded(page, recoding, quality) for page in others]
    return replace(scene, pages=tuple(pages), network=recoding.network(scene.network))


def _parts(scene: BakedScene) -> tuple[list[Quads], list[Page]]:
    """The pages that are made of quads, taken apart, and the others."""
    found = list(zip(scene.pages, mapped(quads_of, scene.pages), strict=True))
    return [quads for _, quads in found if quads is not None], [page for page, quads in found if quads is None]


def _lossless(parts: list[Quads]) -> tuple[Page, ...]:
    """All of them on pages; takes them from the list, so that they are in memory once."""
    for number, quads in enumerate(parts):
        parts[number] = replace(quads, patches=with_constant_axes_collapsed(quads.patches))
        del quads
    return packed(with_equal_patches_shared(without_empty(joined(parts))))


def _budget(quality: Quality) -> float:
    """Squared error per point of the surface, summed over RGB."""
    return float(3 * 10 ** (-quality.color_db / 10))


def _coarsest(recoding: Recoding, quality: Quality) -> Recoding:
    """The coarsest rounding within the budget, where resolution stays as it is."""
    return _search(lambda step: (found := recoding.with_step(step), found.squared_error()), _budget(quality))


def _settled(parts: list[Quads], recoding: Recoding, quality: Quality) -> tuple[Recoding, Trade]:
    """Rounding and resolution that share the budget at the least bytes, found on some of the quads."""
    sample = _Sample(parts, recoding, quality)

    def tried(step: float) -> tuple[tuple[Recoding, Trade], float]:
        coded = recoding.with_step(step)
        trade = sample.trade(coded)
        return (coded, trade), coded.squared_error() + sample.error(trade)

    return _search(tried, _budget(quality))


def _search(tried: Callable[[float], tuple[T, float]], budget: float) -> T:
    """What `tried(step) -> (result, error)` gives for the largest step whose error is within the budget."""
    low, high = FINEST_STEP, 1.0
    best = tried(low)[0]
    for _ in range(SEARCH_STEPS):
        step = float(np.sqrt(low * high))
        result, error = tried(step)
        if error <= budget:
            low, best = step, result
        else:
            high = step
    return best


class _Sample:
    """Some of the quads, to find out on."""

    def __init__(self, parts: list[Quads], recoding: Recoding, quality: Quality) -> None:
        numbers = _sampled(np.concatenate([quads.patches.areas[quads.patch] for quads in parts]))
        self._options: list[tuple[SizeOptions, np.ndarray]] = []
        squares, pairs, texels, covered, patches = np.zeros(FEATURE_CHANNELS), 0, 0, 0.0, 0
        mean, first = _mean_area(parts), 0
        for quads in parts:
            here = numbers[(numbers >= first) & (numbers < first + len(quads))] - first
            weight, first = _patch_weights(quads, mean), first + len(quads)
            for some in quads.patches.groups(np.unique(quads.patch[here])):
                features = quads.patches.content(some)[..., :FEATURE_CHANNELS]
                y, opaque = recoding.coordinates(features), is_opaque(features)
                self._options.append((size_options(y, opaque, quality.most, quality.hole_cost), weight[some]))
                both = opaque[:, :, 1:] & opaque[:, :, :-1]
                squares += ((y[:, :, 1:] - y[:, :, :-1])[both] ** 2).sum(0)
                pairs, texels, patches = pairs + int(both.sum()), texels + opaque.size, patches + len(some)
                covered += float((opaque.mean((1, 2)) * weight[some]).sum())
        self._difference = np.sqrt(squares / max(pairs, 1))
        self._texels = texels / patches
        self._covered = max(covered, 1e-9)

    def error(self, trade: Trade) -> float:
        """Squared error of colour per point of the surface, beyond that of the largest patches allowed."""
        found = ((options.best(weight, trade)[1], weight) for options, weight in self._options)
        total = sum(float((np.maximum(error, 0) * weight).sum()) for error, weight in found)
        return total / self._covered

    def trade(self, recoding: Recoding) -> Trade:
        """A bit is worth what it saves in rounding: error falls by 2 ln 2 / channels of itself per bit and texel.

        Bits are the entropy of differences between neighbours, taken for Laplacian: log2(deviation / step) + 1.94.
        """
        active = recoding.step > 0
        slope = 2 * np.log(2) / max(int(active.sum()), 1) * recoding.squared_error() / self._texels
        bits = np.log2(np.maximum(self._difference[active], 1e-9) / recoding.step[active]) + 1.94
        return Trade(float(slope), float(np.maximum(bits, LEAST_BITS).sum() + BITS_OF_HOLES))


def _sampled(texels: np.ndarray) -> np.ndarray:
    """Numbers of the quads to find out on, of the texels [Q] that each has: evenly spread."""
    numbers = np.random.default_rng(0).permutation(len(texels))[:SAMPLE_QUADS]
    return numbers[: max(1, int((np.cumsum(texels[numbers]) <= SAMPLE_TEXELS).sum()))]


def _mean_area(parts: list[Quads]) -> float:
    """Of all quads; 1 where none has any, so that weights stay finite."""
    return float(np.concatenate([quads.world_areas() for quads in parts]).mean()) or 1.0


def _patch_weights(quads: Quads, mean_area: float) -> np.ndarray:
    """[N] each patch's share of the surface, mean 1 and above 0; the largest of the quads that show it."""
    weight = np.full(len(quads.patches.sizes), LEAST_WEIGHT)
    np.maximum.at(weight, quads.patch, quads.world_areas() / mean_area)
    return weight


def _reduced_in_turn(parts: list[Quads], recoding: Recoding, trade: Trade, quality: Quality) -> list[Quads]:
    """`_reduced` of each, where anything is left; takes them from the list to keep little in memory.

    Several pages at a time, although each takes every core: not all that is done to a page does.
    """
    mean_area, waiting = _mean_area(parts), dict(enumerate(parts))
    parts.clear()
    found = mapped(
        lambda number: _reduced(waiting.pop(number), mean_area, recoding, trade, quality), range(len(waiting))
    )
    return [quads for quads in found if quads is not None]


def _reduced(quads: Quads, mean_area: float, recoding: Recoding, trade: Trade, quality: Quality) -> Quads | None:
    """Patches at their chosen resolution, in bytes of the recoding; quads that are not worth theirs are left out.

    None where none is.
    """
    weight, channels = _patch_weights(quads, mean_area), np.argsort(-recoding.deviation)[:LEADING].tolist()

    def reduced(some: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Patches of one size as (numbers [n], texels [n, h, w, 11]), of one new size each."""
        texels = quads.patches.content(some)
        y, opaque = recoding.coordinates(texels[..., :FEATURE_CHANNELS]), is_opaque(texels)
        best = best_sizes(y, opaque, quality.most, quality.hole_cost, weight[some], trade, channels)
        found = []
        for height, width in np.unique(best[best[:, 0] > 0], axis=0):
            here = np.flatnonzero((best == (height, width)).all(1))
            resized = _resized(picked(texels, here), picked(y, here), (height, width), recoding, quality)
            found.append((some[here], resized))
        return found

    parts = [part for group in mapped(reduced, quads.patches.groups()) for part in group]
    if not parts:
        return None
    order = np.concatenate([numbers for numbers, _ in parts])
    new = np.full(len(weight), -1)
    new[order] = np.arange(len(order))
    left = quads.subset(new[quads.patch] >= 0)
    sizes = np.concatenate([np.tile(texels.shape[1:3], (len(texels), 1)) for _, texels in parts])
    patches = Patches(sizes, np.concatenate([texels.reshape(-1, CHANNELS) for _, texels in parts]))
    return Quads(left.corners, left.ends, left.triangles, new[left.patch], patches).in_order_of_patches()


def _resized(
    texels: np.ndarray, y: np.ndarray, size: tuple[int, int], recoding: Recoding, quality: Quality
) -> np.ndarray:
    """Texels [n, h, w, 11] whose coordinates are y, at a size, recoded; only channel 0 says where holes are."""
    opaque, colors = is_opaque(texels), texels[..., FEATURE_CHANNELS:]
    if size != opaque.shape[1:]:
        both, opaque = shrunk(np.concatenate([y, colors.astype(np.float32)], -1), opaque, size)
        y, colors = both[..., :FEATURE_CHANNELS], both[..., FEATURE_CHANNELS:]
    result = np.empty((*opaque.shape, CHANNELS), np.uint8)
    result[..., :FEATURE_CHANNELS] = recoding.bytes_of(y)
    result[..., FEATURE_CHANNELS:] = rounded_colors(colors, quality.fallback_db)
    cut = np.flatnonzero(~opaque.all((1, 2)))
    result[cut] = filled(result[cut], opaque[cut])
    result[cut, ..., 0] *= opaque[cut]
    return result


def rounded_colors(colors: np.ndarray, decibels: float) -> np.ndarray:
    """uint8, rounded to multiples of the step that gives this PSNR."""
    step = max(1, int(np.sqrt(12 * 10 ** (-decibels / 10)) * 255))
    if colors.dtype == np.uint8:  # whole numbers: looked up, which takes a third of the time
        return rounded_colors(np.arange(256.0), decibels).take(colors)
    rounded: np.ndarray = np.clip(np.rint(colors / step) * step, 0, 255 // step * step).astype(np.uint8)
    return rounded


def _recoded(page: Page, recoding: Recoding, quality: Quality) -> Page:
    """A page that cannot be taken apart, texel by texel."""
    opaque = is_opaque(page.features_u8)
    features = np.where(opaque[..., None], recoding.bytes_of(recoding.coordinates(page.features_u8)), np.uint8(0))
    return replace(page, features_u8=features, colors_u8=rounded_colors(page.colors_u8, quality.fallback_db))
