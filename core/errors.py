"""The errors users meet. Everything else is a bug and may show a traceback."""


class MirrorTwinError(Exception):
    """Base of every error that carries a message meant for a person."""


class InputError(MirrorTwinError):
    """A value that cannot be flown, stored or read, named by its field.

    >>> raise InputError("severity", "must lie in 0-1, got 7")
    """

    def __init__(self, field: str, problem: str) -> None:
        """Name the ``field`` as the user knows it and say what its range is."""
        super().__init__(f"{field}: {problem}")
        self.field = field
        self.problem = problem

    def __reduce__(self) -> tuple[type["InputError"], tuple[str, str]]:
        """Pickle by both parts, so that it survives the way from a worker process."""
        return InputError, (self.field, self.problem)


class FlightError(MirrorTwinError):
    """JSBSim could not trim or fly the plan."""


class StoreError(MirrorTwinError):
    """The run store cannot be read or written."""


class NoSuchRunError(StoreError):
    """The run store is as it should be, and has no run of that name."""


class DiskFullError(StoreError):
    """The run store cannot be written for lack of room: deleting something would help."""


class WorkerError(MirrorTwinError):
    """A run did not finish: its worker died, was cancelled, or the scheduler is unreachable."""
