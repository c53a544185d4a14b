"""What a measurement was taken on, in words that name no machine."""

import os
import platform
from pathlib import Path


def hardware(device: str) -> str:
    """CPU model and usable cores and, where `device` is one, the GPU."""
    cpu = f"{_cpu_model()}, {len(os.sched_getaffinity(0))} cores"
    if not device.startswith("cuda"):
        return cpu
    import torch  # only here, so that the CPU's name can be had without

    return f"{torch.cuda.get_device_name(device)}; {cpu}"


def _cpu_model() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor() or platform.machine()
