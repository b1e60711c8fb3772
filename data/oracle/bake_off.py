"""Samplers beside each other on the posteriors of `haloray mock`: haloray's own, WALNUTS, adaptive importance sampling, tempered particles.

Run:   python3 bake_off.py --systems 2 --seeds 102,103 --models comprehensive,power-law --folder bake_off --summary ../../docs/BAKE_OFF.md
Needs: pip install ./python arviz==0.22.0 walnutpie==0.0.3 numpy; posteriors that are in the folder already are not sampled again
Units: evaluations of ln p or of its gradient after the start, which is the same for all; seconds of one core

Every sampler is given the maxima and metrics of one blind start. Those that are not haloray's see coordinates in which the normal
posterior about the highest maximum is N(0, 1). Chains are judged as by haloray: R-hat < 1.01 and more than 400 effective draws, bulk and
tail, of every quantity; draws of importance sampling by Pareto k < 0.7 and 400 effective draws of the weights (Vehtari et al. 2024); runs of particles by
R-hat among four of them.
"""

import argparse
import concurrent.futures
import json
import pathlib
import statistics
import time

import arviz
import numpy as np
import page
import walnutpie

import haloray as hr

#: Evaluations after which the others begin no other round.
MOST = 100_000
SHEARS = ("gamma1_los", "gamma2_los")


class Whitened:
    """ln p over x = Lᵀ(z − mode), with metric = L Lᵀ, whose normal approximation is N(0, 1); counts evaluations."""

    def __init__(self, target):
        self.target, self.mode = target, target.modes[0]
        self.factor = np.linalg.cholesky(self.mode.metric)
        self.dimension, self.evaluations = len(target.names), 0

    def z(self, x):
        return self.mode.latent + np.linalg.solve(self.factor.T, np.atleast_2d(x).T).T

    def __call__(self, x):
        self.evaluations += len(x)
        found = self.target(np.clip(self.z(x), -30.0, 30.0)) - self.mode.log_density
        return np.where(np.isfinite(found), found, -1e9)

    def gradient(self, x):
        self.evaluations += 1
        value, slope = self.target.gradient(np.clip(self.z(x)[0], -30.0, 30.0))
        if not np.isfinite(value):
            return -1e9, np.zeros(self.dimension)
        return value - self.mode.log_density, np.linalg.solve(self.factor, slope)

    def starts(self):
        """Mean and factor of the covariance of the normal posterior about every mode."""
        for mode in self.target.modes:
            whitened = np.linalg.solve(self.factor, np.linalg.solve(self.factor, mode.metric).T)
            yield self.factor.T @ (mode.latent - self.mode.latent), np.linalg.cholesky(np.linalg.inv(whitened))


def converged(target, draws):
    """Whether chains z of shape (chain, draw, n) have converged, and their quantities."""
    values = target.values(draws)
    data = arviz.convert_to_dataset({name: own for name, own in values.items() if np.ptp(own) > 0.0})
    worst = lambda found, of: float(of([of(found[name].values) for name in found.data_vars]))
    is_converged = worst(arviz.rhat(data), np.max) < 1.01 and min(
        worst(arviz.ess(data, method=method), np.min) for method in ("bulk", "tail")) > 400.0
    return is_converged, values


def moments(values, weights=None):
    return {name: [float(np.average(values[name].ravel(), weights=weights)),
                   float(np.sqrt(np.cov(values[name].ravel(), aweights=weights)))] for name in SHEARS}


def walnuts(whitened, rng):
    """Four chains by walnutpie (Bou-Rabee et al. 2025, arXiv:2506.18746), begun by draws of the normal posteriors about the modes: 200
    draws of warm-up, and 100 more until they have converged."""
    starts, chains, metric = list(whitened.starts()), [], None
    x = [mean + factor @ rng.normal(size=whitened.dimension) for mean, factor in (starts[i % len(starts)] for i in range(4))]
    while True:
        runs = walnutpie.walnuts_pyfunc(
            lambda x: whitened.gradient(x[None]), inits=np.array(x), num_chains=4, seed=int(rng.integers(2**31)),
            init_inv_metric=metric, save_inv_metric=True,
            min_warmup_iter=50 if chains else 200, max_warmup_iter=50 if chains else 200,
            min_sampling_iter=100, max_sampling_iter=100, max_trajectory_doublings=6)
        chains.append(np.array([np.asarray(run) for run in runs]))
        x, metric = chains[-1][:, -1], np.mean([run.warmup.inv_metric for run in runs], axis=0)
        all_draws = np.concatenate(chains, axis=1)
        z = whitened.z(all_draws.reshape(-1, whitened.dimension)).reshape(all_draws.shape)
        done, values = converged(whitened.target, z)
        if done or whitened.evaluations > MOST:
            return done, moments(values)


def importance(whitened, rng):
    """Population Monte Carlo (Cappé et al. 2008, Stat. Comput. 18, 447): a mixture of Student's t, two about every mode, fitted anew to its weighted draws."""
    DEGREES, DRAWS = 5.0, 4000
    d = whitened.dimension
    parts = [(mean, factor * width) for mean, factor in whitened.starts() for width in (1.0, 3.0)]
    shares, done = np.full(len(parts), 1.0 / len(parts)), False

    def log_parts(x):
        found = []
        for mean, factor in parts:
            u = np.linalg.solve(factor, (x - mean).T)
            log_det = np.log(np.diag(factor)).sum()
            found.append(-0.5 * (DEGREES + d) * np.log1p((u**2).sum(axis=0) / DEGREES) - log_det)
        return np.array(found) + np.log(np.maximum(shares, 1e-300))[:, None]

    while whitened.evaluations < MOST and not done:
        chosen = rng.choice(len(parts), size=DRAWS, p=shares)
        scale = np.sqrt(DEGREES / rng.chisquare(DEGREES, size=DRAWS))
        unit = rng.normal(size=(DRAWS, d)) * scale[:, None]
        x = np.array([parts[k][0] + parts[k][1] @ u for k, u in zip(chosen, unit)])
        own = log_parts(x)
        log_q = np.logaddexp.reduce(own, axis=0)
        log_w, k_hat = arviz.psislw(whitened(x) - log_q)
        w = np.exp(log_w - log_w.max())
        w /= w.sum()
        done = float(k_hat) < 0.7 and 1.0 / (w**2).sum() > 400.0
        belongs = w * np.exp(own - log_q)
        for k, (mean, factor) in enumerate(parts):
            u = np.linalg.solve(factor, (x - mean).T)
            narrow = belongs[k] * (DEGREES + d) / (DEGREES + (u**2).sum(axis=0))
            if belongs[k].sum() < 1e-6 or 1.0 / ((belongs[k] / belongs[k].sum()) ** 2).sum() < 5.0 * d:
                continue
            middle = (narrow[:, None] * x).sum(axis=0) / narrow.sum()
            off = x - middle
            covariance = (narrow[:, None, None] * off[:, :, None] * off[:, None, :]).sum(axis=0) / belongs[k].sum()
            parts[k] = middle, np.linalg.cholesky(covariance + 1e-9 * np.eye(d))
        shares = np.maximum(belongs.sum(axis=1), 1e-3)
        shares /= shares.sum()
    return done, moments(whitened.target.values(whitened.z(x)), w)


def particles(whitened, rng):
    """Tempered sequential Monte Carlo (Del Moral et al. 2006, J. R. Stat. Soc. B 68, 411), four runs of 250: from the modes' normal posteriors, twice as wide,
    by temperatures that keep half of the particles effective, each followed by Metropolis steps as wide as the particles; more steps until the runs agree."""
    PARTICLES, RUNS, STEPS = 250, 4, 5
    d, starts, steps = whitened.dimension, list(whitened.starts()), STEPS
    wide = [(mean, 2.0 * factor) for mean, factor in starts]

    def log_first(x):
        found = [-0.5 * (np.linalg.solve(f, (x - m).T) ** 2).sum(axis=0) - np.log(np.diag(f)).sum() for m, f in wide]
        return np.logaddexp.reduce(found, axis=0) - np.log(len(wide))

    def run():
        chosen = rng.integers(len(wide), size=PARTICLES)
        x = np.array([wide[k][0] + wide[k][1] @ rng.normal(size=d) for k in chosen])
        log_p, log_q, power, scale = whitened(x), log_first(x), 0.0, 2.4 / np.sqrt(d)
        while power < 1.0:
            effective = lambda p: (lambda w: w.sum() ** 2 / (w**2).sum())(np.exp((own := (p - power) * (log_p - log_q)) - own.max()))
            low, high = power, 1.0
            if effective(1.0) < 0.5 * PARTICLES:
                for _ in range(40):
                    middle = 0.5 * (low + high)
                    low, high = (middle, high) if effective(middle) > 0.5 * PARTICLES else (low, middle)
            w = np.exp((high - power) * (log_p - log_q - (log_p - log_q).max()))
            kept = rng.choice(PARTICLES, size=PARTICLES, p=w / w.sum())
            x, log_p, log_q, power = x[kept], log_p[kept], log_q[kept], high
            factor = np.linalg.cholesky(np.cov(x.T) + 1e-9 * np.eye(d))
            for _ in range(steps):
                there = x + scale * rng.normal(size=x.shape) @ factor.T
                p, q = whitened(there), log_first(there)
                gain = power * (p - log_p) + (1.0 - power) * (q - log_q)
                is_taken = np.log(rng.random(PARTICLES)) < gain
                x[is_taken], log_p[is_taken], log_q[is_taken] = there[is_taken], p[is_taken], q[is_taken]
                scale *= np.exp(0.3 * (is_taken.mean() - 0.234))
        return x

    while True:
        z = np.array([whitened.z(run()) for _ in range(RUNS)])
        done, values = converged(whitened.target, z)
        if done or whitened.evaluations > MOST:
            return done, moments(values)
        steps *= 3


def haloray_with(sampler, target, observation, model, **options):
    fit = hr.fit(observation, model, sampler=sampler, pixel_sampling="point", **options)
    found = {name: [fit.parameters[name].mean, fit.parameters[name].standard_deviation] for name in SHEARS}
    return fit.converged, found, fit.statistics["evaluations"] - target.evaluations


OTHERS = {"importance sampling": importance, "tempered particles": particles, "WALNUTS": walnuts}
#: NUTS may make as many draws of each of its chains.
OURS = {"valley": {}, "nuts": {"max_draws": 400}}


def sampled(task):
    """One system by every sampler, as rows; each is kept in a file."""
    folder, seed, system, model = task
    hr.set_threads(1)
    path = folder / f"{seed}_{system}_{model}.json"
    rows = json.loads(path.read_text()) if path.exists() else {}
    observation = hr.mock(system + 1, seed=seed).images[system].observation()
    began = time.process_time()
    target = hr.LogPosterior(observation, model, pixel_sampling="point")
    start_seconds = time.process_time() - began
    rows["modes"] = len(target.modes)

    def keep(name, row):
        rows[name] = row
        path.write_text(json.dumps(rows, indent=1))
        print(seed, system, model, name, row, flush=True)

    if "reference" not in rows:
        done, found, evaluations = haloray_with("valley", target, observation, model, seed=2, min_ess=1000.0)
        keep("reference", {"converged": done, "shears": found, "evaluations": evaluations})
    for name in ("valley", *OTHERS, "nuts"):
        if name in rows:
            continue
        began = time.process_time()
        if name in OURS:
            done, found, evaluations = haloray_with(name, target, observation, model, **OURS[name])
            began += start_seconds
        else:
            whitened = Whitened(target)
            done, found = OTHERS[name](whitened, np.random.default_rng([seed, system]))
            evaluations = whitened.evaluations
        keep(name, {"converged": bool(done), "shears": found, "evaluations": evaluations, "seconds": time.process_time() - began})
    return task, rows


def table(rows):
    """One row a model and sampler."""
    lines = ["| model | sampler | posteriors | converged | evaluations: median, largest | seconds of a core: median, sum | γ_LOS off a longer run, in σ: largest | σ of γ_LOS over that of the longer run: least, largest |",
             "|---|---|---:|---:|---:|---:|---:|---:|"]
    for model in dict.fromkeys(task[3] for task, _ in rows):
        for name in (*OURS, *OTHERS):
            own = [(row[name], row["reference"]["shears"]) for task, row in rows if task[3] == model]
            both = [(row["shears"][n], reference[n]) for row, reference in own for n in SHEARS]
            off = [abs(mean - at) / width for (mean, _), (at, width) in both]
            ratio = [width / wanted for (_, width), (_, wanted) in both]
            good = sum(row["converged"] for row, _ in own)
            evaluations, seconds = ([row[of] for row, _ in own] for of in ("evaluations", "seconds"))
            lines.append(f"| {model} | {name} | {len(own)} | {good} | {statistics.median(evaluations):,.0f}, {max(evaluations):,} "
                         f"| {statistics.median(seconds):.0f}, {sum(seconds):,.0f} | {max(off):.2f} | {min(ratio):.2f}, {max(ratio):.2f} |")
    modes = [row["modes"] for _, row in rows]
    lines.append(f"\n{sum(m > 1 for m in modes)} of the {len(modes)} posteriors have more than one mode within 3 of the highest in ln p. Not converged: not by {MOST:,} evaluations, "
                 "or, of haloray's own, by as many draws as they may make.")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--systems", type=int, default=2, help="how many systems of each seed, the first whose images are small enough")
    parser.add_argument("--seeds", default="102,103")
    parser.add_argument("--pixels", type=int, default=80, help="only images no wider, so that the slowest ends")
    parser.add_argument("--models", default="comprehensive,power-law")
    parser.add_argument("--folder", type=pathlib.Path, required=True)
    parser.add_argument("--summary", type=pathlib.Path, required=True)
    parser.add_argument("--jobs", type=int, default=2, help="posteriors at a time, one core each")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    chosen = []
    for seed in map(int, options.seeds.split(",")):
        sides = [image.observation().data_e_s.shape[0] for image in hr.mock(64, seed=seed).images]
        chosen += [(seed, system) for system, side in enumerate(sides) if side <= options.pixels][:options.systems]
    tasks = [(options.folder, seed, system, model) for model in options.models.split(",") for seed, system in chosen]
    with concurrent.futures.ProcessPoolExecutor(options.jobs) as executor:
        rows = list(executor.map(sampled, tasks))
    command = f"just bake-off '--systems {options.systems} --seeds {options.seeds} --models {options.models}'"
    page.write(options.summary, command, table(rows), ("haloray", "arviz", "walnutpie", "numpy"))


if __name__ == "__main__":
    main()
