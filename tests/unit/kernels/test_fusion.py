"""Depth pictures and what they agree on, against float64 loops over cameras and hits."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch
import warp as wp

from core.field.bricks import places_in
from core.field.frame import Frame, as_vec3
from core.field.space import Space
from core.kernels.fusion import DepthPictures, compare_depths, fuse_depths, median_depth, vote_opacity
from core.kernels.launch import accumulator_parts, launch
from core.kernels.march import Samples
from core.kernels.trace import Hits
from core.kernels.types import FAR, vec8
from core.training.depth_pictures import SurfaceDistance
from tests.scenes import look_at_camera
from tests.unit.kernels.rays import as_float32, random_rays

NOWHERE = float(FAR)
CELLS = 16
RADIUS = 0.55
FRAME = Frame(np.zeros(3), 1.0)


def ball_depth(camera, radius: float = RADIUS) -> np.ndarray:
    """[h, w] float64: the distance to a ball around the origin along each pixel's ray, or FAR."""
    o, d = camera.position, camera.directions(camera.pixel_centres())
    b = d @ o
    root = b**2 - (o @ o - radius**2)
    return np.where(root > 0, -b - np.sqrt(np.maximum(root, 0.0)), NOWHERE)


def ring(count: int = 12, size_px: int = 64):
    turn = np.arange(count) * 2.4
    z = np.linspace(-0.7, 0.8, count)
    across = np.sqrt(1.0 - z**2)
    places = 3.0 * np.stack([across * np.cos(turn), across * np.sin(turn), z], -1)
    return [look_at_camera(str(i), place, size_px=(size_px, size_px)) for i, place in enumerate(places)]


def pictures_of(cameras, depths, device: str) -> DepthPictures:
    made = DepthPictures()
    made.cameras = FRAME.camera_array(cameras, device)
    start = np.cumsum([0, *(depth.size for depth in depths[:-1])]).astype(np.int32)
    made.start = wp.array(start, dtype=wp.int32, device=device)
    made.size = wp.array(np.array([camera.size_px for camera in cameras], np.int32), dtype=wp.vec2i, device=device)
    flat = np.concatenate([depth.reshape(-1) for depth in depths]).astype(np.float32)
    made.depth = wp.array(flat, dtype=float, device=device)
    return made


def fused(cameras, depths, points: np.ndarray, band: float, hidden: float, device: str):
    at = torch.from_numpy(points.astype(np.float32)).to(device)
    distance, weight = (torch.empty(len(points), device=device) for _ in range(2))
    inputs = [Space.cube().kernel_space(), pictures_of(cameras, depths, device), as_vec3(at), band, hidden,
              wp.from_torch(distance), wp.from_torch(weight)]  # fmt: skip
    launch(fuse_depths, len(points), inputs, device)
    return distance.cpu().numpy(), weight.cpu().numpy()


def expected_fusion(cameras, depths, points: np.ndarray, band: float, hidden: float):
    """The same by loops: (distance, weight, margin of the closest decision)."""
    distances, weights, margins = [], [], []
    for p in points:
        votes, margin = [], 1.0
        for camera, depth in zip(cameras, depths, strict=True):
            matrix = np.linalg.inv(camera.world_from_camera)
            x, y, z = matrix[:3, :3] @ p + matrix[:3, 3]
            if z >= 0:
                continue
            u = camera.centre_px[0] - camera.focal_px[0] * x / z - 0.5
            v = camera.centre_px[1] + camera.focal_px[1] * y / z - 0.5
            width, height = camera.size_px
            if not (-0.5 <= u < width - 0.5 and -0.5 <= v < height - 0.5):
                continue
            u, v = np.clip(u, 0, width - 1), np.clip(v, 0, height - 1)
            column, row = min(int(u), max(width - 2, 0)), min(int(v), max(height - 2, 0))
            right, below = min(column + 1, width - 1), min(row + 1, height - 1)
            four = np.array([[depth[row, column], depth[row, right]], [depth[below, column], depth[below, right]]])
            fx, fy = u - column, v - row
            if np.ptp(four) < hidden * band:
                found = (four[0] * [1 - fx, fx]).sum() * (1 - fy) + (four[1] * [1 - fx, fx]).sum() * fy
            else:
                found = four[int(fy >= 0.5), int(fx >= 0.5)]
                margin = min(margin, abs(fx - 0.5), abs(fy - 0.5))
            margin = min(margin, abs(np.ptp(four) / (hidden * band) - 1))
            d = (found - np.linalg.norm(p - camera.position)) / band
            margin = min(margin, abs(d + hidden))
            if d > -hidden:
                votes.append(np.clip(d, -1, 1))
        distances.append(np.mean(votes) if votes else 0.0)
        weights.append(len(votes))
        margins.append(margin)
    return np.array(distances), np.array(weights), np.array(margins)


def test_fusion_is_the_mean_of_what_pictures_say(rng, device):
    cameras = ring(5, 24)
    depths = [ball_depth(camera) for camera in cameras]
    points = rng.uniform(-1.2, 1.2, (300, 3)).astype(np.float32).astype(np.float64)
    distance, weight = fused(cameras, depths, points, 0.1, 2.0, device)
    wanted, count, margin = expected_fusion(cameras, depths, points, 0.1, 2.0)
    clear = margin > 1e-3  # else float32 may decide otherwise
    assert clear.mean() > 0.9
    np.testing.assert_array_equal(weight[clear], count[clear])
    # float32 knows distances of about 3 to 4e-7; a band of 0.1 makes ten times that of it.
    np.testing.assert_allclose(distance[clear], wanted[clear], atol=3e-5)


def test_points_behind_every_camera_and_beside_every_picture_are_unknown(device):
    cameras = ring(3, 16)
    depths = [ball_depth(camera) for camera in cameras]
    behind = np.array([camera.position * 1.5 for camera in cameras])
    distance, weight = fused(cameras[:1], depths[:1], behind[:1], 0.1, 2.0, device)
    assert weight.tolist() == [0.0]
    assert distance.tolist() == [0.0]
    assert fused(cameras[:1], depths[:1], np.array([cameras[0].position]), 0.1, 2.0, device)[1].tolist() == [0.0]


def test_pictures_of_one_pixel_are_read(device):
    camera = ring(1, 1)[0]
    distance, weight = fused([camera], [ball_depth(camera)], np.array([[0.0, 0.0, 0.0]]), 10.0, 2.0, device)
    assert weight.tolist() == [1.0]
    assert distance[0] == pytest.approx(-RADIUS / 10.0, abs=1e-6)


@pytest.mark.parametrize("radius", [0.3, 0.55])
def test_the_surface_that_pictures_agree_on_is_the_balls(rng, device, radius):
    cameras = ring()
    pictures = pictures_of(cameras, [ball_depth(camera, radius) for camera in cameras], device)
    distance = SurfaceDistance(pictures, Space.cube(), CELLS, device)
    ways = rng.normal(size=(400, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    cell = 2.0 / CELLS
    # A pixel is 0.04 wide at the ball, a third of a cell: that is how well silhouettes are known.
    assert (distance(ways * (radius - 0.4 * cell)) < 0).all()
    assert (distance(ways * (radius + 0.4 * cell)) > 0).all()
    distance = SurfaceDistance(pictures, Space.cube(), CELLS, device, 0.3)
    assert (distance(ways * radius) < 0).mean() > 0.8  # without a level, half of them


def test_no_points_have_no_distances(device):
    camera = ring(1, 8)[0]
    distance = SurfaceDistance(pictures_of([camera], [ball_depth(camera)], device), Space.cube(), CELLS, device)
    assert distance(np.zeros((0, 3))).shape == (0,)


def test_a_thin_things_back_does_not_hide_its_front(rng, device):
    """A plate thinner than a cell is solid inside and clear on either side."""
    places = [(3.0, 0.1, 0.3), (-3.0, 0.1, 0.3)]
    cameras = [look_at_camera(str(i), place, size_px=(32, 32)) for i, place in enumerate(places)]
    half = 0.03
    depths = []
    for camera in cameras:
        d = camera.directions(camera.pixel_centres())
        side = np.sign(camera.position[0]) * half
        depths.append((side - camera.position[0]) / d[..., 0])
    distance = SurfaceDistance(pictures_of(cameras, depths, device), Space.cube(), CELLS, device)
    yz = rng.uniform(-0.3, 0.3, (50, 2))
    at = lambda x: np.column_stack([np.full(50, x), yz])  # noqa: E731
    assert (distance(at(0.0)) < 0).all()
    assert (distance(at(0.2)) >= 0).all()
    assert (distance(at(-0.2)) >= 0).all()


def samples_of(t: np.ndarray, alpha: np.ndarray, device: str) -> Samples:
    """[rays, n] each."""
    left = np.cumprod(1.0 - alpha, 1)
    T = np.concatenate([np.ones((len(t), 1)), left[:, :-1]], 1)
    samples = Samples()
    for name, values in (("t", t), ("s", t), ("alpha", alpha), ("transmittance", T)):
        setattr(samples, name, wp.array(values.astype(np.float32), dtype=float, device=device))
    samples.features = wp.zeros(t.shape, dtype=vec8, device=device)
    samples.count = wp.array(np.full(len(t), t.shape[1], np.int32), dtype=wp.int32, device=device)
    return samples


def test_median_depth_is_where_half_of_the_light_has_ended(rng, device):
    step, n = 0.1, 12
    t = np.tile(np.arange(n) * step + 1.0, (200, 1))
    alpha = rng.random((200, n)) * rng.choice([0.0, 0.05, 1.0], (200, 1))
    found = torch.empty(200, device=device)
    launch(median_depth, 200, [samples_of(t, alpha, device), step, wp.from_torch(found)], device)
    edges = np.concatenate([t[0] - step / 2, [t[0, -1] + step / 2]])
    for ray in range(200):
        ended = np.concatenate([[0.0], 1.0 - np.cumprod(1.0 - alpha[ray])])
        if ended[-1] > 0.5 + 1e-6:
            first = np.argmax(ended > 0.5)
            share = (0.5 - ended[first - 1]) / (ended[first] - ended[first - 1])
            assert float(found[ray]) == pytest.approx(edges[first - 1] + share * step, abs=1e-4)
        elif ended[-1] < 0.5 - 1e-6:
            assert float(found[ray]) == NOWHERE


@pytest.mark.parametrize("space", [Space.cube(), Space.taper(), Space.shells()], ids=["cube", "taper", "shells"])
def test_depths_are_compared_among_the_cells(rng, device, space):
    origins, directions = as_float32(random_rays(rng, 100))
    if space.tangent != (1.0, 1.0):
        origins, directions = np.zeros((100, 3), np.float32), directions * np.sign(directions[:, 2:])
    depth, other = rng.uniform(1.5, 4.0, (2, 100)).astype(np.float32)
    depth[::9], other[::7] = NOWHERE, NOWHERE
    apart, cell = torch.empty(100, device=device), torch.empty(100, dtype=torch.int32, device=device)
    tensors = [torch.from_numpy(np.ascontiguousarray(a)).to(device) for a in (origins, directions, depth, other)]
    values = [wp.from_torch(tensor) for tensor in (*tensors[2:], apart, cell)]
    inputs = [space.kernel_space(), CELLS, as_vec3(tensors[0]), as_vec3(tensors[1]), *values]
    launch(compare_depths, 100, inputs, device)
    to_cells = space.to_grid if space.tangent != (1.0, 1.0) else np.asarray
    for ray in range(100):
        o, d = origins[ray].astype(float), directions[ray].astype(float)
        if max(depth[ray], other[ray]) >= NOWHERE:
            assert float(apart[ray]) == NOWHERE
        else:
            places = [to_cells(o + t * d) for t in (float(depth[ray]), float(other[ray]))]
            assert float(apart[ray]) == pytest.approx(np.linalg.norm(places[0] - places[1]), rel=1e-4, abs=1e-5)
        if depth[ray] >= NOWHERE:
            assert int(cell[ray]) == -1
            continue
        g = to_cells(o + float(depth[ray]) * d)
        if np.abs(np.abs(g).max() - 1.0) < 1e-4:
            continue
        if np.abs(g).max() > 1.0:
            assert int(cell[ray]) == -1
        elif (np.abs((g + 1) * CELLS / 2 % 1 - 0.5) < 0.499).all():
            i, j, k = ((g + 1) * CELLS / 2).astype(int)
            assert int(cell[ray]) == (i * CELLS + j) * CELLS + k


def hits_of(t: np.ndarray, count: np.ndarray, device: str):
    hits = Hits()
    shape = t.shape
    hits.t = wp.array(t.astype(np.float32), dtype=float, device=device)
    hits.count = wp.array(count.astype(np.int32), dtype=wp.int32, device=device)
    hits.quad = wp.zeros(shape, dtype=wp.int32, device=device)
    hits.ab = wp.zeros(shape, dtype=wp.vec2, device=device)
    hits.alpha, hits.transmittance = (wp.zeros(shape, dtype=float, device=device) for _ in range(2))
    hits.features = wp.zeros(shape, dtype=vec8, device=device)
    return hits


def votes_on(space: Space, t: list[float], depth: float, device: str) -> SimpleNamespace:
    """Votes of one ray along +x through the middle of the cube, from x = -2; tolerance 0.1."""
    nodes = 9
    n = places_in(nodes)
    row_of = torch.arange(n, dtype=torch.int32, device=device)
    o, d = (torch.tensor([v], device=device) for v in ([-2.0, 0.0, 0.0], [1.0, 0.0, 0.0]))
    parts = accumulator_parts(device)
    solid, clear = (torch.zeros(parts, n, device=device) for _ in range(2))
    found = torch.tensor([depth], device=device)
    hits = hits_of(np.array([t]), np.array([len(t)]), device)
    rays = [as_vec3(o), as_vec3(d), wp.from_torch(found)]
    shared = [space.kernel_space(), nodes, wp.from_torch(row_of), *rays, 0.1, hits]
    outputs = [wp.from_torch(solid), wp.from_torch(clear)]
    launch(vote_opacity, 1, lambda part: [*shared, part, *outputs], device, parts)
    return SimpleNamespace(solid=float(solid.sum()), clear=float(clear.sum()))


@pytest.mark.parametrize(
    ("t", "depth", "solid", "clear"),
    [
        ([1.5, 2.0, 2.5], 2.0, 1.0, 1.0),  # before, at, and behind where the ray ends
        ([1.95, 2.05], 2.0, 2.0, 0.0),  # near it on either side
        ([2.2, 2.9], 2.0, 0.0, 0.0),  # behind: unknown
        ([1.2, 2.8], NOWHERE, 0.0, 2.0),  # the ray ends nowhere
        ([], 2.0, 0.0, 0.0),
    ],
)
def test_hits_vote_by_where_their_ray_ends(device, t, depth, solid, clear):
    votes = votes_on(Space.cube(), t, depth, device)
    assert votes.solid == pytest.approx(solid, abs=1e-5)
    assert votes.clear == pytest.approx(clear, abs=1e-5)


def test_shells_around_the_cells_get_no_votes(device):
    votes = votes_on(Space.shells(), [2.0, 4.0], 8.0, device)
    assert votes.clear == pytest.approx(1.0, abs=1e-5)
