"""What photos see of a scene."""

import numpy as np
import torch

from core.baking.seen import look_from
from core.render.reference import visibility
from core.render.visibility import subpixel_camera


def constant(features: torch.Tensor, directions: torch.Tensor) -> torch.Tensor:
    return torch.full((len(features), 3), 0.25)


def by_direction(features: torch.Tensor, directions: torch.Tensor) -> torch.Tensor:
    return 0.5 + 0.5 * directions


def test_seen_texels_are_those_that_some_sub_pixel_shows(scene):
    cameras = [camera.resized((40, 30)) for camera in scene.cameras]
    expected = [np.zeros(page.features_u8.shape[:2], bool) for page in scene.pages]
    for camera in cameras:
        view = visibility(scene, subpixel_camera(camera))
        for index, mask in enumerate(expected):
            here = view.page == index
            mask[view.row[here], view.column[here]] = True
    seen = look_from(scene, cameras, constant, device="cpu", seed=0, report=lambda share: None)
    different = sum(int((a != b).sum()) for a, b in zip(seen.texels, expected, strict=True))
    assert sum(int(mask.sum()) for mask in expected) > 300
    assert different <= 2  # a sub-pixel on the edge of a texel, to within rounding
    for page, mask in zip(scene.pages, seen.texels, strict=True):
        assert (page.features_u8[mask][:, 0] > 0).all()


def test_colours_are_means_over_the_directions_that_a_texel_is_seen_from(scene):
    cameras = [camera.resized((40, 30)) for camera in scene.cameras]
    seen = look_from(scene, cameras, by_direction, device="cpu", seed=0, report=lambda share: None)
    sums = [np.zeros((*mask.shape, 4)) for mask in seen.texels]
    for camera in cameras:
        samples = subpixel_camera(camera)
        view, directions = visibility(scene, samples), samples.directions(samples.pixel_centres())
        for index, total in enumerate(sums):
            here = view.page == index
            values = np.concatenate([0.5 + 0.5 * directions[here], np.ones((here.sum(), 1))], -1)
            np.add.at(total, (view.row[here], view.column[here]), values)
    for color, total in zip(seen.colors, sums, strict=True):
        known = total[..., 3] > 0
        close = np.abs(color[known] - total[known][:, :3] / total[known][:, 3:]).max(-1) < 1e-5  # float32 colours
        assert close.mean() > 0.99  # the others: a sample that fell on another texel by rounding
        assert np.isnan(color[total[..., 3] == 0]).mean() > 0.99


def test_looking_reports_the_share_that_is_done(scene):
    told: list[float] = []
    look_from(scene, [scene.cameras[0].resized((8, 6))] * 4, constant, device="cpu", seed=0, report=told.append)
    assert told == [0.25, 0.5, 0.75, 1.0]
