"""Intervals: how sure parameters are, from the spread between blocks of a recording."""

import numpy as np

from rems_net.identification.drive import Floats

#: Least share of its own error that a block shows; the rest, it has fitted itself.
LONE = 1e-3
#: 97.5 % points of Student's t with 1, 2, 3 and 4 degrees of freedom.
KNOWN = (12.706, 4.303, 3.182, 2.776)


def sandwich(free: Floats, rest: Floats, inverse: Floats) -> tuple[Floats, Floats]:
    """Return variances of parameters and their degrees of freedom, from blocks.

    free: slopes (S, R, p)      rest: errors (S, R)      inverse: of the sum of squares
    Few blocks fit themselves too well, and each by its own weight: their errors are
    enlarged, and the freedom is reduced, as Bell and McCaffrey (2002) do.
    """
    # Of the hat matrices (S, R, R), only p directions are not 0.
    sizes, ways = np.linalg.eigh(inverse)
    half = free @ (ways * np.sqrt(np.maximum(sizes, 0.0)))
    ways, sizes, _ = np.linalg.svd(half, full_matrices=False)
    more = 1.0 / np.sqrt(np.maximum(1.0 - sizes**2, LONE)) - 1.0
    pull = free @ inverse
    reaches = pull + (ways * more[:, None]) @ (ways.transpose(0, 2, 1) @ pull)
    spread = (np.einsum("srp,sr->sp", reaches, rest) ** 2).sum(axis=0)
    pulls = np.einsum("srp,srq->qsp", free, reaches)  # (parameter, S, p)
    own = np.einsum("srq,srq->qs", reaches, reaches)
    shared = pulls @ inverse @ pulls.transpose(0, 2, 1)
    joint = np.eye(len(free)) * own[:, None] - shared
    freedom = np.einsum("qss->q", joint) ** 2 / ((joint**2).sum(axis=(1, 2)) + 1e-300)
    return spread, np.maximum(freedom, 1.0)


def student(freedom: float) -> float:
    """Return the 97.5 % point of Student's t, by Cornish and Fisher's expansion.

    Below 4, it is between the known points, straight over the inverse.
    """
    if freedom < 4:
        few = range(1, 5)
        return float(np.interp(-1 / freedom, [-1 / n for n in few], KNOWN))
    z, n = 1.959964, float(freedom)
    terms = (
        (z**3 + z) / (4 * n),
        (5 * z**5 + 16 * z**3 + 3 * z) / (96 * n**2),
        (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / (384 * n**3),
    )
    return z + sum(terms)
