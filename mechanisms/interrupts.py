"""Ctrl-C that is not forgotten: compilers swallow it in their callbacks and stumble over it later."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import FrameType

__all__ = ["remembering_interrupts"]


@contextmanager
def remembering_interrupts(seen: list[int]) -> Iterator[None]:
    """Append to `seen` at every Ctrl-C, which raises KeyboardInterrupt as ever."""
    if (
        threading.current_thread() is not threading.main_thread()
        or signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    ):
        yield  # the caller has arranged it otherwise
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        seen.append(number)
        signal.default_int_handler(number, frame)

    signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
