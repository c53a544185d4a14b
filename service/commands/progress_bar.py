"""Progress on a terminal."""

import sys
from types import TracebackType

from tqdm import tqdm

from core.progress import Progress

FORMAT = "{desc:<8} {percentage:3.0f}% |{bar}| {elapsed}{postfix}"


class ProgressBar:
    """A bar over a whole conversion, with the stage before it and the PSNR behind it.

    Where stderr is not a terminal, a line for each stage.
    """

    def __init__(self) -> None:
        self._plain = not sys.stderr.isatty()
        self._stage = ""

    def __enter__(self) -> "ProgressBar":
        self._bar = tqdm(total=1.0, bar_format=FORMAT, disable=self._plain, leave=False)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.close()

    def __call__(self, report: Progress) -> None:
        self.show(report.stage, report.fraction, report.psnr)

    def say(self, text: str) -> None:
        """Prints lines above the bar."""
        tqdm.write(text, file=sys.stderr)

    def show(self, stage: str, fraction: float, psnr: float | None) -> None:
        """Moves the bar to `fraction` of the whole."""
        if self._plain and stage != self._stage:
            print(f"{stage} ...", file=sys.stderr, flush=True)
        self._stage = stage
        self._bar.set_description_str(stage, refresh=False)
        if psnr is not None:
            self._bar.set_postfix_str(f"{psnr:.1f} dB", refresh=False)
        self._bar.update(max(0.0, fraction - self._bar.n))
