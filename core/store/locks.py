"""Locks of a store's folder: who has it open, and who flies its runs."""

import fcntl
import logging
import os
from collections.abc import Callable
from pathlib import Path
from typing import IO

from core.errors import StoreError

logger = logging.getLogger(__name__)


def share(root: Path) -> tuple[int | None, bool]:
    """A share in a store's folder for as long as it is open here, and whether it is the only one.

    One that is the only one is exclusive, until `admit_others`: who comes then waits.
    """
    try:
        share = os.open(root, os.O_RDONLY | os.O_DIRECTORY)
    except OSError:
        return None, False
    try:
        try:
            fcntl.flock(share, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return share, True
        except BlockingIOError:
            fcntl.flock(share, fcntl.LOCK_SH)
            return share, False
    except OSError:  # a file system without locks
        os.close(share)
        return None, False


def admit_others(share: int | None) -> None:
    """Make an exclusive share one among others."""
    if share is not None:
        fcntl.flock(share, fcntl.LOCK_SH)


def close(share: int | None) -> None:
    """Give a share up."""
    if share is not None:
        os.close(share)


def claim(root: Path, when_alone: Callable[[], object]) -> IO[str] | None:
    """Hold a share of the lock of those who fly runs of a store, for as long as this process lives.

    Who finds it free knows that every unfinished run was left by a process that has stopped, and
    may say so by ``when_alone``.
    """
    try:
        lock = (root / "engine.lock").open("a")
    except OSError:  # a read-only store: nothing can be marked
        return None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        when_alone()
    except BlockingIOError:
        logger.info("another process flies runs of the store %s", root)
    except (OSError, StoreError) as error:
        logger.warning("runs that an earlier server left unfinished stay so: %s", error)
        return lock
    fcntl.flock(lock, fcntl.LOCK_SH)
    return lock
