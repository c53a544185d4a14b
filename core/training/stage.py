"""What the three training stages have in common."""

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
import torch
from torch import nn

from core.errors import TrainingFailed
from core.presets import Settings
from core.training.loss import psnr_of

RECENT = 32  # steps that the reported PSNR is a mean of
NETWORK_BETAS = (0.9, 0.99)


class Stage(ABC):
    """A number of training steps that start from what the stage before them left.

    A stage's randomness depends on the seed and the step alone, so that a stage resumed from its checkpoint goes on as
    if nothing had happened.
    """

    name: ClassVar[str]

    def __init__(self, network: nn.Sequential, settings: Settings, steps: int, seed: int, device: str) -> None:
        self.network, self.settings, self.steps, self.seed, self.device = network, settings, steps, seed, device
        self.optimizer = torch.optim.Adam(network.parameters(), betas=NETWORK_BETAS, fused=device == "cpu")
        self.done = 0
        self._errors: list[float] = []

    @property
    def fraction(self) -> float:
        return self.done / self.steps

    @property
    def psnr(self) -> float | None:
        """Of recent training pixels, dB."""
        return psnr_of(self._errors) if self._errors else None

    def advance(self) -> None:
        """One training step.

        Raises:
            TrainingFailed: the loss is no longer a number.
        """
        error = self.step()
        if not np.isfinite(error):
            raise TrainingFailed(
                f"training ({self.name}, step {self.done})",
                "the error must stay finite",
                str(error),
                "Check the poses, or try another seed or preset.",
            )
        self._errors = [*self._errors[-RECENT + 1 :], error]
        self.done += 1

    @staticmethod
    def gradient(tensor: torch.Tensor, pixels: int) -> torch.Tensor:
        """The gradient of a leaf in units of a single pixel's loss, so that rates do not depend on the batch size; zero
        where the loss does not depend on the leaf."""
        return torch.zeros_like(tensor) if tensor.grad is None else tensor.grad * float(pixels)

    @abstractmethod
    def step(self) -> float:
        """Trains on one batch; returns its mean squared colour error."""

    def optimize_network(self, loss: torch.Tensor, rate: float) -> None:
        """Back-propagates the loss and steps the network; leaf tensors keep their gradients."""
        for group in self.optimizer.param_groups:
            group["lr"] = rate
        self.optimizer.zero_grad()
        loss.backward()
        self.optimizer.step()

    def state(self) -> dict[str, Any]:
        """Everything needed to go on from here."""
        return {
            "done": self.done,
            "network": self.network.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            **self.own_state(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        self.done = state["done"]
        self.network.load_state_dict(state["network"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.restore_own(state)

    @abstractmethod
    def own_state(self) -> dict[str, Any]: ...

    @abstractmethod
    def restore_own(self, state: dict[str, Any]) -> None: ...
