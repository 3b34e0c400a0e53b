"""Condition numbers that tests/val_figures.rs holds: the matrix of Zhang 2025, eq. 4-5, on 185 frames of 0.02 s.

In powers of time by mpmath, in Chebyshev polynomials by numpy:  pip install mpmath numpy
"""

import mpmath
import numpy
from numpy.polynomial import chebyshev

FRAMES = 185


def raw(order):
    mpmath.mp.dps = 60 + 5 * order
    times = [mpmath.mpf(i) / 50 for i in range(FRAMES)]
    rows = [[t**k for k in range(order + 1)] for t in times]
    rows += [[k * t ** (k - 1) if k else mpmath.mpf(0) for k in range(order + 1)] for t in times]
    matrix = mpmath.matrix(rows)
    gram = matrix.T * matrix

    def largest(matrix):
        vector, norm = mpmath.matrix([1 + mpmath.mpf(i) / 7 for i in range(order + 1)]), 0
        for _ in range(60):
            vector = matrix * vector
            norm = mpmath.norm(vector)
            vector /= norm
        return norm

    return mpmath.sqrt(largest(gram) * largest(gram**-1))


def sound(order):
    times = numpy.arange(FRAMES) * 0.02
    x = 2 * times / times[-1] - 1
    unit = numpy.eye(order + 1)
    value = numpy.stack([chebyshev.chebval(x, unit[k]) for k in range(order + 1)], 1)
    slope = numpy.stack([chebyshev.chebval(x, chebyshev.chebder(unit[k])) for k in range(order + 1)], 1)
    return numpy.linalg.cond(numpy.vstack([value, slope * 2 / times[-1]]))


for order in (12, 48):
    print(order, mpmath.nstr(raw(order), 6), f"{sound(order):.6g}")
