"""Other people's smoothers on the samples of the study, as its tables have them.

    pip install 'numpy>=2' 'scipy>=1.15'
    cargo run --release --example study -- ours --samples DIR && python examples/study/peers.py DIR/ours

DIR holds `FAMILY.samples.csv` (a row a sample, sensor 0 the datum) and `FAMILY.truth.csv` (a row an instant to be judged at,
parts 0 phase 1, 1 overlap, 2 phase 2). Prints `family,peer,part,position_m,velocity_m_s`: root mean square 3-D errors.

spline        scipy's make_smoothing_spline (cubic, smoothness by generalised cross-validation), weights 1 / sigma^2, on the
              positions of all sensors, merged where their instants are equal; its derivative is the velocity.
RTS           Kalman filter and smoother of positions and velocities of all sensors at their own instants: constant
              acceleration driven by white jerk, its density by maximum likelihood for each run and axis.
RTS + errors  the same with the second sensor's bias, drift, velocity bias (by axis), clock offset and scale as constant
              states, with trackfuse's default priors. What isn't linear is linearised about the last smoothed track, and
              the samples put to where the last clock offset has them, four times. A position or velocity more than five sigmas
              from its prediction is left out, as is usual; the likelihood has what that costs.

The smoother goes backwards by Bryson and Frazier's recursion (1963; Bierman 1973), which gives Rauch, Tung and
Striebel's means without an inverse. All runs of a family go through it side by side.
"""

import os
import sys
from multiprocessing import Pool
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # a process a core already

import numpy as np
from scipy.interpolate import make_smoothing_spline
from scipy.stats import theilslopes

# State: position, velocity, acceleration, bias, drift, velocity bias (each x y z), clock offset, scale.
POSITION, VELOCITY, ACCELERATION, BIAS, DRIFT, VELOCITY_BIAS = (slice(3 * i, 3 * i + 3) for i in range(6))
OFFSET, SCALE = 18, 19
MOTION, ALL = 9, 20
# m, m/s, m/s, s, -
PRIORS = [(BIAS, 3.0), (DRIFT, 0.10), (VELOCITY_BIAS, 0.30), (OFFSET, 0.06), (SCALE, 0.003)]
# m, m/s, m/s^2, about a robust line through the first positions
START = [(POSITION, 0.3), (VELOCITY, 5.0), (ACCELERATION, 20.0)]
FIRST = 15
GATE_SIGMAS = 5.0
# white jerk's density, m^2/s^5: the first grid, and the steps about its best
DENSITIES = 10.0 ** np.arange(-2.0, 4.1, 1.0)
HALF, QUARTER = 10.0**0.5, 10.0**0.25
COMPONENTS, AXES, PAIR = np.arange(6), np.arange(3), np.array([0, 3])
# runs that go through the filter side by side
BATCH = 50
ROUNDS = 4


class Run:
    """The samples and the instants of one run."""

    def __init__(self, samples, truth):
        self.sensor = samples[:, 0].astype(int)
        self.stamp_s = samples[:, 1]
        self.values = samples[:, 2:8]
        self.sigmas = samples[:, 8:10]
        self.part = truth[:, 0].astype(int)
        self.time_s = truth[:, 1]
        self.truth = truth[:, 2:8]
        first = np.argsort(self.stamp_s)[:FIRST]
        lines = [theilslopes(self.values[first, axis], self.stamp_s[first]) for axis in range(3)]
        self.start = np.array([(line.intercept + line.slope * self.stamp_s[first[0]], line.slope) for line in lines]).T
        late = self.sensor > 0
        # where drift and scale error are zero
        self.anchor_s = 0.5 * (self.stamp_s[~late].max() + self.stamp_s[late].min()) if late.any() else 0.0


class Steps:
    """The samples and instants of all runs in order of time, padded to one length: what the filter goes through."""

    def __init__(self, runs, offsets, with_instants):
        order = []
        for run, offset in zip(runs, offsets):
            instants = run.time_s if with_instants else []
            times = np.concatenate([run.stamp_s - offset * (run.sensor > 0), instants])
            index = np.argsort(times, kind="stable")
            order.append((times[index], index))
        self.count = max(len(times) for times, _ in order)
        shape = (self.count, len(runs))
        self.time_s = np.empty(shape)
        self.sample = np.full(shape, -1)
        self.instant = np.full(shape, -1)
        for r, (run, (times, index)) in enumerate(zip(runs, order)):
            n = len(times)
            self.time_s[:n, r], self.time_s[n:, r] = times, times[-1]
            samples = len(run.stamp_s)
            self.sample[:n, r] = np.where(index < samples, index, -1)
            self.instant[:n, r] = np.where(index < samples, -1, index - samples)


def advance(states, dt):
    """The states, along their second axis, `dt` later."""
    dt = dt.reshape((-1,) + (1,) * (states.ndim - 1))
    states[:, POSITION] += dt * states[:, VELOCITY] + 0.5 * dt**2 * states[:, ACCELERATION]
    states[:, VELOCITY] += dt * states[:, ACCELERATION]


def retreat(adjoint, dt):
    """The transpose of `advance`."""
    dt = dt[:, None]
    adjoint[:, ACCELERATION] += dt * adjoint[:, VELOCITY] + 0.5 * dt**2 * adjoint[:, POSITION]
    adjoint[:, VELOCITY] += dt * adjoint[:, POSITION]


def diffuse(covariance, dt, density):
    """White jerk's share of the covariance, by axis."""
    growth = {(0, 0): 1 / 20, (0, 1): 1 / 8, (0, 2): 1 / 6, (1, 1): 1 / 3, (1, 2): 1 / 2, (2, 2): 1.0}
    power = {(0, 0): 5, (0, 1): 4, (0, 2): 3, (1, 1): 3, (1, 2): 2, (2, 2): 1}
    axes = np.arange(3)
    for (i, j), share in growth.items():
        q = density * (share * dt ** power[i, j])[:, None]
        covariance[:, 3 * i + axes, 3 * j + axes] += q
        if i != j:
            covariance[:, 3 * j + axes, 3 * i + axes] += q


class Smoother:
    """All runs of a family; with `errors` the second sensor has some."""

    def __init__(self, runs, errors):
        self.runs, self.errors = runs, errors
        self.states = ALL if errors else MOTION
        count = len(runs)
        self.offset, self.scale = np.zeros(count), np.zeros(count)
        # the track at each sample, its velocity and acceleration, and at the anchor; none before the first pass
        self.at_samples, self.at_anchor = None, None

    def equations(self, predicted, r_of, index, free):
        """Rows, noise variances and values of the samples `index` of the runs `r_of`, in terms of the states."""
        runs = [self.runs[r] for r in r_of]
        values = np.array([run.values[i] for run, i in zip(runs, index)])
        sigmas = np.array([run.sigmas[i] for run, i in zip(runs, index)])
        rows = np.zeros((len(r_of), 6, self.states))
        axes = np.arange(3)
        rows[:, axes, axes] = rows[:, 3 + axes, 3 + axes] = 1.0
        if self.errors:
            late = np.array([float(run.sensor[i] > 0) for run, i in zip(runs, index)])
            since = np.array([run.stamp_s[i] - run.anchor_s for run, i in zip(runs, index)]) - self.offset[r_of]
            if self.at_samples is None:
                track, anchor = predicted[:, :9], predicted[:, :3]
            else:
                track = np.array([self.at_samples[r][i] for r, i in zip(r_of, index)])
                anchor = self.at_anchor[r_of]
            p, v, a = track[:, :3], track[:, 3:6], track[:, 6:9]
            scale = late * self.scale[r_of]
            rows[:, axes, axes] += scale[:, None]
            rows[:, 3 + axes, 3 + axes] += scale[:, None]
            rows[:, axes, 9 + axes] = rows[:, 3 + axes, 12 + axes] = rows[:, 3 + axes, 15 + axes] = late[:, None]
            rows[:, axes, 12 + axes] = (late * since)[:, None]
            if free:
                rows[:, :3, OFFSET], rows[:, 3:, OFFSET] = -late[:, None] * v, -late[:, None] * a
                rows[:, :3, SCALE], rows[:, 3:, SCALE] = late[:, None] * (p - anchor), late[:, None] * v
            # the share of the scale that is known already, and what offset and scale are counted from
            values[:, :3] += scale[:, None] * anchor
        return rows, np.repeat(sigmas**2, 3, axis=1), values

    def run(self, density, free, smooth):
        """Log-likelihood by run and axis, and, if asked for, the smoothed states at each step.

        `free` leaves clock offset and scale open, as differences from the last ones."""
        steps = Steps(self.runs, self.offset, smooth)
        count = len(self.runs)
        x = np.zeros((count, self.states))
        P = np.zeros((count, self.states, self.states))
        for r, run in enumerate(self.runs):
            x[r, POSITION], x[r, VELOCITY] = run.start
        for which, sigma in START + (PRIORS if self.errors else []):
            diagonal = np.arange(self.states)[which]
            P[:, diagonal, diagonal] = sigma**2
        if self.errors and free:
            # the prior holds for the whole, not for the difference
            x[:, OFFSET], x[:, SCALE] = -self.offset, -self.scale
        elif self.errors:
            P[:, OFFSET, OFFSET] = P[:, SCALE, SCALE] = 0.0
        likelihood = np.zeros((count, 3))
        last_s = steps.time_s[0].copy()
        history = []
        for k in range(steps.count):
            dt = steps.time_s[k] - last_s
            last_s = steps.time_s[k]
            advance(x, dt)
            advance(P, dt)
            advance(P.transpose(0, 2, 1), dt)
            diffuse(P, dt, density)
            updates = []
            if smooth:
                history.append((dt, x.copy(), P.copy(), updates))
            r_of = np.flatnonzero(steps.sample[k] >= 0)
            if not len(r_of):
                continue
            rows, variances, values = self.equations(x[r_of], r_of, steps.sample[k][r_of], free)
            xs, Ps = x[r_of], P[r_of]
            nu = values - np.matmul(rows, xs[:, :, None])[:, :, 0]
            PH = np.matmul(Ps, rows.transpose(0, 2, 1))
            S = np.matmul(rows, PH)
            S[:, COMPONENTS, COMPONENTS] += variances
            far = (nu**2 > GATE_SIGMAS**2 * S[:, COMPONENTS, COMPONENTS]).reshape(-1, 2, 3).any(axis=2)
            far = np.repeat(far & self.errors, 3, axis=1)
            S[:, COMPONENTS, COMPONENTS] += np.where(far, 1e9, 0.0)
            inverse = np.linalg.inv(S)
            weighted = np.matmul(inverse, nu[:, :, None])[:, :, 0]
            # with offset and scale fixed the axes have nothing in common
            pairs = S[:, AXES[:, None, None] + PAIR[:, None], AXES[:, None, None] + PAIR]
            cost = np.where(far, GATE_SIGMAS**2, nu * weighted).reshape(-1, 2, 3).sum(axis=1)
            rejected = far.reshape(-1, 2, 3).sum(axis=1)
            likelihood[r_of] -= 0.5 * (cost + np.log(np.linalg.det(pairs)) - rejected * np.log(1e9))
            K = np.matmul(PH, inverse)
            if smooth:
                updates.append((r_of, rows, K, weighted))
            x[r_of] = xs + np.matmul(K, nu[:, :, None])[:, :, 0]
            Ps = Ps - np.matmul(K, PH.transpose(0, 2, 1))
            P[r_of] = 0.5 * (Ps + Ps.transpose(0, 2, 1))
        if not smooth:
            return likelihood, None, None
        smoothed = np.empty((steps.count, count, self.states))
        adjoint = np.zeros((count, self.states))
        for k in reversed(range(steps.count)):
            dt, x, P, updates = history[k]
            for r_of, rows, K, weighted in updates:
                own = adjoint[r_of][:, :, None]
                back = np.matmul(K.transpose(0, 2, 1), own)[:, :, 0] + weighted
                adjoint[r_of] -= np.matmul(rows.transpose(0, 2, 1), back[:, :, None])[:, :, 0]
            smoothed[k] = x - np.matmul(P, adjoint[:, :, None])[:, :, 0]
            retreat(adjoint, dt)
        return likelihood, steps, smoothed

    def best_density(self, about=None, step=DENSITIES[1] / DENSITIES[0]):
        """The density of greatest likelihood by run and axis: the best of a grid, or of three about the last, and a
        parabola through it."""
        shape = (len(self.runs), 3)
        grid = [np.full(shape, q) for q in DENSITIES] if about is None else [about / step, about, about * step]
        found = np.array([self.run(q, False, False)[0] for q in grid])
        best = np.clip(found.argmax(axis=0), 1, len(grid) - 2)
        a, b, c = (np.take_along_axis(found, best[None] + i, axis=0)[0] for i in (-1, 0, 1))
        bend = a - 2 * b + c
        shift = np.where(bend < 0, 0.5 * (a - c) / np.where(bend < 0, bend, 1.0), 0.0)
        return np.take_along_axis(np.array(grid), best[None], axis=0)[0] * step ** np.clip(shift, -1.0, 1.0)

    def smooth(self):
        """The track of each run at its instants: position and velocity."""
        if not self.errors:
            density = self.best_density(self.best_density(self.best_density(), HALF), QUARTER)
            return self.tracks(*self.run(density, False, True)[1:])
        density = np.full((len(self.runs), 3), 10.0)
        for turn in range(ROUNDS):
            _, steps, smoothed = self.run(density, True, True)
            tracks = self.tracks(steps, smoothed)
            self.offset = self.offset + smoothed[-1, :, OFFSET]
            self.scale = self.scale + smoothed[-1, :, SCALE]
            self.linearise(steps, smoothed)
            if turn == 1:
                density = self.best_density(self.best_density(), HALF)
            elif turn == 2:
                density = self.best_density(density, QUARTER)
        return tracks

    def linearise(self, steps, smoothed):
        """Keeps the track at each sample, and at the anchor."""
        self.at_samples = [np.empty((len(run.stamp_s), 9)) for run in self.runs]
        self.at_anchor = np.empty((len(self.runs), 3))
        for r, run in enumerate(self.runs):
            own = steps.sample[:, r] >= 0
            self.at_samples[r][steps.sample[own, r]] = smoothed[own, r, :9]
            time_s, unique = np.unique(steps.time_s[:, r], return_index=True)
            for axis in range(3):
                self.at_anchor[r, axis] = np.interp(run.anchor_s, time_s, smoothed[unique, r, axis])

    def tracks(self, steps, smoothed):
        tracks = []
        for r, run in enumerate(self.runs):
            own = steps.instant[:, r] >= 0
            track = np.empty((len(run.time_s), 6))
            track[steps.instant[own, r]] = smoothed[own, r, :6]
            tracks.append(track)
        return tracks


def spline(run):
    time_s, inverse = np.unique(run.stamp_s, return_inverse=True)
    weight = 1.0 / run.sigmas[:, 0] ** 2
    total = np.bincount(inverse, weight)
    track = np.empty((len(run.time_s), 6))
    for axis in range(3):
        merged = np.bincount(inverse, weight * run.values[:, axis]) / total
        fitted = make_smoothing_spline(time_s, merged, w=total)
        track[:, axis], track[:, 3 + axis] = fitted(run.time_s), fitted.derivative()(run.time_s)
    return track


def read(path):
    table = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    bounds = np.flatnonzero(np.diff(table[:, 0])) + 1
    return [part[:, 1:] for part in np.split(table, bounds)]


def squares(runs):
    """Sums of squared errors, of position and velocity, and their number, by peer and part."""
    peers = {
        "spline": [spline(run) for run in runs],
        "RTS": Smoother(runs, False).smooth(),
        "RTS + errors": Smoother(runs, True).smooth(),
    }
    parts = np.concatenate([run.part for run in runs])
    sums = {}
    for peer, tracks in peers.items():
        errors = np.concatenate([track - run.truth for track, run in zip(tracks, runs)])
        for part in range(3):
            own = errors[parts == part]
            sums[peer, part] = np.array([(own[:, :3] ** 2).sum(), (own[:, 3:] ** 2).sum(), len(own)])
    return sums


def main():
    folder = Path(sys.argv[1])
    families = [path.name.removesuffix(".samples.csv") for path in sorted(folder.glob("*.samples.csv"))]
    batches = []
    for family in families:
        runs = [Run(*pair) for pair in zip(*(read(folder / f"{family}.{what}.csv") for what in ("samples", "truth")))]
        batches += [(family, runs[i : i + BATCH]) for i in range(0, len(runs), BATCH)]
    with Pool() as pool:
        found = pool.map(squares, [runs for _, runs in batches], chunksize=1)
    print("family,peer,part,position_m,velocity_m_s")
    for family in families:
        own = [sums for (name, _), sums in zip(batches, found) if name == family]
        for peer, part in own[0]:
            position, velocity, count = sum(sums[peer, part] for sums in own)
            if count:
                print(f"{family},{peer},{part},{np.sqrt(position / count):.6f},{np.sqrt(velocity / count):.6f}")


if __name__ == "__main__":
    main()
