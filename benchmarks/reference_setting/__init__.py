"""The paper's own setting, to measure ours against: slow, readable PyTorch, the same code on CPU and CUDA.

Three networks on a P^3 mesh, from nothing: A (opacity) and F (features) are NeRF's 8-layer networks with 384 neurons a
layer (supplement E), H (shader) has 11-16-16-3. Quadrature points are the ray's intersections with the mesh (supplement
G), thinned out by the acceleration grid G. Stage 1 trains continuous opacity, stage 2 binary opacity beside it and then
F and H alone, stage 3 bakes K x K texels a quad.

Training runs for a given time in place of a given number of steps: what the paper says in steps is done in shares of
that time. What the paper leaves open is as in the authors' published code (the opacity's bias of -8, Adam's epsilon,
the learning rates, means in place of sums in the regularisers).

What differs from the paper, so that its result is a `BakedScene` like ours and is measured alike:
- the anti-aliased pixel is Polyfield's (core.conventions): mean over the covered sub-pixels, blended by coverage;
- the cube is the one that Polyfield finds, where the authors chose it by hand for each scene;
- vertices are clamped to their cells, on top of the penalty.
"""

from benchmarks.reference_setting.baking import bake_paper
from benchmarks.reference_setting.setting import PaperSetting
from benchmarks.reference_setting.training import PaperRun

__all__ = ["PaperRun", "PaperSetting", "bake_paper"]
