"""A job's progress as server-sent events."""

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import aclosing
from typing import Any

from core.errors import OptionInvalid
from service.errors import JobNotFound
from service.jobs import Jobs

KEEP_ALIVE_S = 15.0


async def job_events(jobs: Jobs, job_id: str, after: int) -> AsyncIterator[str]:
    """The text of the stream.

    Each report is an event without a name (`onmessage`): `{"stage", "fraction", "psnr", "preview"}`, with its number as
    id, so that a client that lost the connection goes on after `Last-Event-ID`. The last event is named `end` and
    carries the job.
    """
    async with aclosing(_with_pauses(jobs.reports(job_id, after))) as reports:  # type: ignore[type-var]
        async for item in reports:
            yield ": still here\n\n" if item is None else _event(item[1], number=item[0])
    try:
        job = await jobs.get(job_id)
    except JobNotFound:
        job = {"id": job_id, "state": "deleted"}
    yield _event(job, name="end")


def last_event_id(header: str | None) -> int:
    """The number of the last event a client has seen; 0 for none."""
    if not header:
        return 0
    if not header.isdecimal() or len(header) > 9:
        raise OptionInvalid("Last-Event-ID", "must be the id of an event of this stream", repr(header[:40]))
    return int(header)


def _event(value: Any, *, number: int | None = None, name: str = "") -> str:
    lines = [f"id: {number}"] if number is not None else []
    lines += [f"event: {name}"] if name else []
    return "\n".join([*lines, f"data: {json.dumps(value)}", "", ""])


async def _with_pauses(items: AsyncIterator[Any]) -> AsyncIterator[Any]:
    """`items`, with None whenever nothing came for a while: proxies cut silent connections."""
    iterator = aiter(items)
    pending: asyncio.Task[Any] | None = None
    try:
        while True:
            pending = pending or asyncio.ensure_future(anext(iterator))
            done, _ = await asyncio.wait({pending}, timeout=KEEP_ALIVE_S)
            if not done:
                yield None
                continue
            try:
                item = pending.result()
            except StopAsyncIteration:
                return
            finally:
                pending = None
            yield item
    finally:
        if pending:
            pending.cancel()
            await asyncio.wait({pending})
