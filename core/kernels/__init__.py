"""Warp kernels: one source for CPU and CUDA. Importing the package starts Warp, which torch tensors need to be handed
over."""

import os

from core.kernels.start import start_warp

# Kernels reach all over large arrays: with pages of 2 MB instead of 4 KB, where Linux grants them, steps take 8 % less
# time. PyTorch reads this once, when it first allocates memory.
os.environ.setdefault("THP_MEM_ALLOC_ENABLE", "1")

start_warp()
