"""Errors of outputs whose files cannot be written."""

from pathlib import Path

from rems_net.errors import AgentError


def failed(agent: str, path: Path, error: OSError) -> AgentError:
    """Return the error of an agent for a file that cannot be written."""
    return AgentError(
        agent,
        f"cannot write {path}: {error.strerror}; make room there, or name another "
        "folder: rems run --out (R0801)",
    )


def taken(agent: str, path: Path) -> AgentError:
    """Return the error for a file that no run left, or it would have been moved."""
    return AgentError(
        agent,
        f"{path} is there already, and no earlier run has left it; move it, or give "
        "this run a folder of its own (R0801)",
    )
