"""The two errors a user can cause: input that cannot be used, and a problem that has no solution."""


class InputError(ValueError):
    """Input that cannot be used. The message is one line: where, field, value, what is allowed."""


class NoSolutionError(RuntimeError):
    """A well-posed question without an answer. The message is one line: which limit, where, by how much."""
