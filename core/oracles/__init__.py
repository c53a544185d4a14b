"""Slow, readable counterparts of the kernels: plain torch or NumPy in float64, gradients by autograd.

Only tests use them. Nothing here imports a kernel; what both sides must agree on (thresholds, say) is passed in.
"""
