"""Prints the near-minimax polynomials of src/numerics/elementary.rs.

Oracle: mpmath at 40 digits (pip install mpmath).  Command: python3 make_polynomials.py
"""
from mpmath import atan, atanh, chebyfit, mp, mpf, nstr, pi, sqrt, tan

mp.dps = 40


def excess_over_one(function):
    """(f(s)/s - 1)/s² as a function of z = s², with its limit at z = 0."""

    def g(z):
        s = sqrt(z)
        return (function(s) / s - 1) / z

    return g


def report(name, function, z_max, terms):
    tiny = mpf(10) ** -14
    coefficients, error = chebyfit(excess_over_one(function), [tiny, z_max], terms, error=True)
    print(f"{name}: {terms} terms on [0, {nstr(z_max, 6)}], error {nstr(error * z_max, 3)}")
    for c in reversed(coefficients):
        print("   ", nstr(c, 20))


report("artanh(s)/s", atanh, ((sqrt(2) - 1) / (sqrt(2) + 1)) ** 2 * mpf("1.003"), 7)
report("atan(t)/t", atan, tan(pi / 8) ** 2 * mpf("1.0007"), 11)
