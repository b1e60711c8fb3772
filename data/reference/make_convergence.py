"""Reference R-hat, effective sizes and autocorrelation times of chains that both sides make from the same formula.

Needs: pip install arviz==0.22.0 emcee numpy
Run:   python3 make_convergence.py

Chains are x -> rho x + u - 1/2 with u from a linear congruential generator (multiplier and increment of
Numerical Recipes, 32 bits), then put through `kind`: plain, heavy (a power law), ties (steps), shifted (chain 0
moved) or wide (chain 0 stretched). Additions, products and quotients only: the same bits in any language.
"""

import warnings

import arviz
import emcee
import numpy as np

import reference_csv

KINDS = ["plain", "heavy", "ties", "shifted", "wide"]


def chains(count, draws, rho, kind, state):
    out = np.empty((count, draws))
    for chain in range(count):
        x = 0.0
        for draw in range(draws):
            state = (1664525 * state + 1013904223) % 2**32
            x = rho * x + ((state + 0.5) / 2**32 - 0.5)
            value = x
            if kind == "heavy":
                value = x / (1e-3 + x * x)
            elif kind == "ties":
                value = np.floor(4.0 * x)
            elif chain == 0 and kind == "shifted":
                value = x + 0.25
            elif chain == 0 and kind == "wide":
                value = 2.0 * x
            out[chain, draw] = value
    return out


warnings.simplefilter("ignore")
columns = {name: [] for name in ["chains", "draws", "rho", "kind", "seed", "r_hat", "ess_bulk", "ess_tail", "tau"]}
seed = 0
for kind in KINDS:
    for count, draws in [(2, 100), (4, 251), (8, 1000)]:
        for rho in [-0.5, 0.0, 0.6, 0.9]:
            seed += 1
            x = chains(count, draws, rho, kind, seed)
            tau = emcee.autocorr.integrated_time(x.T[:, :, None], c=5, tol=0, quiet=True)[0]
            values = [count, draws, rho, KINDS.index(kind), seed, arviz.rhat(x, method="rank"),
                      arviz.ess(x, method="bulk"), arviz.ess(x, method="tail"), tau]
            for name, value in zip(columns, values):
                columns[name].append(f"{float(value):.15g}")

reference_csv.write(
    "convergence",
    "arviz.rhat(method='rank'), arviz.ess(method='bulk'|'tail'); emcee.autocorr.integrated_time(c=5)",
    f"arviz {arviz.__version__}, emcee {emcee.__version__}, numpy {np.__version__}",
    "python3 make_convergence.py",
    "dimensionless; tau in draws",
    [f"kind is a place in {' '.join(KINDS)}"],
    columns,
)
