"""Progress on a terminal."""

from types import TracebackType

from tqdm import tqdm

from core.progress import Progress

FORMAT = "{desc:<8} {percentage:3.0f}% |{bar}| {elapsed}{postfix}"


class ProgressBar:
    """A bar over a whole conversion, with the stage before it and the PSNR behind it."""

    def __enter__(self) -> "ProgressBar":
        # `disable=None`: no bar where stderr is not a terminal.
        self._bar = tqdm(total=1.0, bar_format=FORMAT, disable=None, leave=False)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.close()

    def __call__(self, report: Progress) -> None:
        self.show(report.stage, report.fraction, report.psnr)

    def show(self, stage: str, fraction: float, psnr: float | None) -> None:
        """Moves the bar to `fraction` of the whole."""
        self._bar.set_description_str(stage, refresh=False)
        if psnr is not None:
            self._bar.set_postfix_str(f"{psnr:.1f} dB", refresh=False)
        self._bar.update(max(0.0, fraction - self._bar.n))
