"""What pycolmap says of lenses and models. Run in a process of its own, because importing it takes over signals.

    python -m tests.unit.datasets.colmap_oracle lenses.json   {"cases": [[model, parameters], ...], "points": [[x, y]]}
    python -m tests.unit.datasets.colmap_oracle model FOLDER  a synthetic model in FOLDER/bin and FOLDER/txt

Both print JSON: where each lens shows each point; what the model holds.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pycolmap


def lens_pixels(path: Path) -> list:
    question = json.loads(path.read_text())
    points = np.array(question["points"])
    rays = np.concatenate([points, np.ones((len(points), 1))], 1)
    cameras = [
        pycolmap.Camera(model=model, width=640, height=480, params=params) for model, params in question["cases"]
    ]
    return [camera.img_from_cam(rays).tolist() for camera in cameras]


def write_model(folder: Path) -> dict:
    pycolmap.set_random_seed(0)
    options = pycolmap.SyntheticDatasetOptions()
    options.num_rigs, options.num_cameras_per_rig, options.num_frames_per_rig, options.num_points3D = 2, 1, 6, 150
    options.camera_model_id = pycolmap.CameraModelId.OPENCV
    options.camera_params = [1200.0, 1210.0, 512.0, 384.0, 0.05, -0.01, 0.001, -0.002]
    model = pycolmap.synthesize_dataset(options)
    for name in ("bin", "txt"):
        (folder / name).mkdir(parents=True)
    model.write_binary(folder / "bin")
    model.write_text(folder / "txt")
    points = sorted(model.points3D.items())
    return {
        "images": {
            image.name: {
                "world_from_camera": image.cam_from_world().inverse().matrix().tolist(),
                "parameters": image.camera.params.tolist(),
                "size_px": [image.camera.width, image.camera.height],
            }
            for image in model.images.values()
        },
        "points": [point.xyz.tolist() for _, point in points],
        "tracks": [[model.image(e.image_id).name for e in point.track.elements] for _, point in points],
    }


if __name__ == "__main__":
    answer = write_model(Path(sys.argv[2])) if sys.argv[1] == "model" else lens_pixels(Path(sys.argv[1]))
    print("\n" + json.dumps(answer))
