"""The README's picture: a held-out photo beside the render of its .glb.

polyfield sample out/sample && polyfield convert out/sample -o out/readme
python scripts/readme_picture.py out/sample out/readme/scene.glb docs/images/sample.png [--view 0]
"""

import argparse
from pathlib import Path

from PIL import Image

from core.datasets import read_capture
from core.evaluation import comparison_picture
from exporters.gltf import read_glb


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("capture", type=Path)
    parser.add_argument("glb", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--view", type=int, default=0, help="number of the held-out view")
    arguments = parser.parse_args()
    view = read_capture(arguments.capture).test[arguments.view]
    photo_render_error = comparison_picture(read_glb(arguments.glb.read_bytes()), view)
    width = view.camera.size_px[0]
    Image.fromarray(photo_render_error[:, : 2 * width]).save(arguments.picture, optimize=True)


if __name__ == "__main__":
    main()
