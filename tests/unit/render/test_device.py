import pytest

from core.device import resolve_device, usable_gpus
from core.errors import OptionInvalid


def test_cpu_is_always_there():
    assert resolve_device("cpu") == "cpu"


def test_auto_takes_a_gpu_only_where_there_is_one():
    assert resolve_device("auto") == ("cuda:0" if usable_gpus() else "cpu")


@pytest.mark.parametrize("name", ["", "gpu", "CPU", "cuda:", "cuda:-1", "cuda:x", "cuda:0 ", "mps", "cuda:1000"])
def test_other_names_are_refused(name):
    with pytest.raises(OptionInvalid, match="must be auto, cpu, cuda or cuda:N"):
        resolve_device(name)


def test_absent_gpu_is_refused_with_a_remedy():
    with pytest.raises(OptionInvalid, match="--device cpu"):
        resolve_device("cuda:999")
