"""Warp kernels: one source for CPU and CUDA. Importing the package starts Warp, which torch tensors need to be handed
over."""

from core.kernels.start import start_warp

start_warp()
