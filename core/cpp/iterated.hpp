// The iterated extended filter's evaluation through a sensor's twin: what estimators/iterated.py says of each return.
#pragma once

#include <utility>
#include <vector>

#include "twin_entries.hpp"

namespace vedette {

// S = L D L' (m, m) with a unit lower triangular L; false where a pivot is too small a part of its diagonal.
struct Factored {
    double L[kMeasured2], D[kMostMeasured];
    int m;

    bool factor(const double* S, int size) {
        m = size;
        for (int j = 0; j < m; ++j) {
            D[j] = S[j * m + j];
            for (int l = 0; l < j; ++l) D[j] -= L[j * m + l] * L[j * m + l] * D[l];
            if (!(D[j] > 1e-12 * S[j * m + j])) return false;
            for (int i = j + 1; i < m; ++i) {
                double sum = S[i * m + j];
                for (int l = 0; l < j; ++l) sum -= L[i * m + l] * L[j * m + l] * D[l];
                L[i * m + j] = sum / D[j];
            }
        }
        return true;
    }
    void solve(const double* b, double* to) const {
        for (int i = 0; i < m; ++i) {
            to[i] = b[i];
            for (int l = 0; l < i; ++l) to[i] -= L[i * m + l] * to[l];
        }
        for (int i = m - 1; i >= 0; --i) {
            to[i] /= D[i];
            for (int l = i + 1; l < m; ++l) to[i] -= L[l * m + i] * to[l];
        }
    }
    double log_det() const {
        double sum = 0.0;
        for (int i = 0; i < m; ++i) sum += std::log(D[i]);
        return sum;
    }
};

constexpr double kRises = 1 + 1e-9;  // times the last cost, that of a pass must be less than this: the rest is rounding
constexpr double kStill = 1e-12;     // standard deviations of an axis: a pass that moves the estimate by less changes nothing

// A linearisation around one point, over all axes of the state: the derivative, and the residual that it gives at the prior.
struct Line {
    double H[kMostMeasured * kMostStates], nu[kMostMeasured];
};

// A track's mean, covariance and parameters of the sensor, a return z, and its noise.
struct Pair {
    const double *x, *P, *parameters, *z, *R;
};

// Gauss and Newton's steps of up to `kBlock` pairs side by side, each until its cost rises or it stands still.
struct Iterations {
    const Twin<SensorTwin>& twin;
    const Axes& axes;
    const Periods &state, &measured;
    int n, m, numbers, passes;

    // The lines at `count` points (n) each, R and detection probability there.
    void look(int count, const Pair* pairs, const double* points, Line* lines, double* R, double* detects) const {
        double x[kMostStates * kBlock], own[kMostParameters * kBlock], at[kMostMeasured * kBlock];
        double H[kMostMeasured * kMostStates * kBlock];
        for (int i = 0; i < count; ++i) {
            for (int a = 0; a < axes.count; ++a) x[a * count + i] = points[i * n + axes.each[a]];
            put_aside(pairs[i].parameters, numbers, own, count, i);
        }
        twin.function(count, x, own, at, H, R, detects, twin.data);
        for (int i = 0; i < count; ++i) {
            Line& line = lines[i];
            double apart[kMostStates];
            for (int a = 0; a < n; ++a) apart[a] = pairs[i].x[a] - points[i * n + a];
            wrap(apart, state);
            std::fill_n(line.H, m * n, 0.0);
            for (int j = 0; j < m; ++j) line.nu[j] = pairs[i].z[j] - at[j * count + i];
            wrap(line.nu, measured);
            for (int j = 0; j < m; ++j)
                for (int a = 0; a < axes.count; ++a) {
                    const double by = H[(j * axes.count + a) * count + i];
                    line.H[j * n + axes.each[a]] = by;
                    line.nu[j] -= by * apart[axes.each[a]];
                }
        }
    }

    // H P H' (m, m), and H P (m, n)
    void spread(const double* H, const double* P, double* cross, double* S) const {
        for (int j = 0; j < m; ++j)
            for (int a = 0; a < n; ++a) {
                cross[j * n + a] = 0.0;
                for (int c = 0; c < axes.count; ++c) cross[j * n + a] += H[j * n + axes.each[c]] * P[axes.each[c] * n + a];
            }
        for (int i = 0; i < m; ++i)
            for (int j = 0; j < m; ++j) {
                S[i * m + j] = 0.0;
                for (int c = 0; c < axes.count; ++c) S[i * m + j] += cross[i * n + axes.each[c]] * H[j * n + axes.each[c]];
            }
    }

    // The last lines that lowered the cost, and .5 log |S| of the first; false where an S is near singular.
    bool run(int count, const Pair* pairs, Line* used, double* volumes) const {
        Line now[kBlock], ahead[kBlock];
        double points[kMostStates * kBlock], unused[kMeasured2 * kBlock], detects[kBlock];
        double cost[kBlock], pulled[kBlock], steps[kBlock][kMostStates] = {};
        bool moved[kBlock];
        Factored noises[kBlock];
        for (int i = 0; i < count; ++i) {
            std::copy_n(pairs[i].x, n, points + i * n);
            cost[i] = std::numeric_limits<double>::infinity();
            if (!noises[i].factor(pairs[i].R, m)) return false;
        }
        look(count, pairs, points, now, unused, detects);
        std::copy_n(now, count, used);
        for (int pass = 0; pass < passes; ++pass) {
            for (int i = 0; i < count; ++i) {
                double cross[kMostMeasured * kMostStates], seen[kMeasured2], S[kMeasured2], pull[kMostMeasured];
                Factored factored;
                spread(now[i].H, pairs[i].P, cross, seen);
                for (int e = 0; e < m * m; ++e) S[e] = seen[e] + pairs[i].R[e];
                if (!factored.factor(S, m)) return false;
                if (pass == 0) volumes[i] = 0.5 * factored.log_det();
                factored.solve(now[i].nu, pull);
                pulled[i] = 0.0, moved[i] = false;
                for (int j = 0; j < m; ++j)
                    for (int l = 0; l < m; ++l) pulled[i] += pull[j] * seen[j * m + l] * pull[l];
                for (int a = 0; a < n; ++a) {
                    const double last = std::exchange(steps[i][a], 0.0);
                    for (int j = 0; j < m; ++j) steps[i][a] += cross[j * n + a] * pull[j];
                    moved[i] |= std::abs(steps[i][a] - last) > kStill * std::sqrt(pairs[i].P[a * n + a]);
                    points[i * n + a] = pairs[i].x[a] + steps[i][a];
                }
                wrap(points + i * n, state);
            }
            look(count, pairs, points, ahead, unused, detects);
            bool any = false;
            for (int i = 0; i < count; ++i) {
                double left[kMostMeasured], white[kMostMeasured], total = pulled[i];
                for (int j = 0; j < m; ++j) {
                    left[j] = ahead[i].nu[j];
                    for (int a = 0; a < n; ++a) left[j] -= ahead[i].H[j * n + a] * steps[i][a];
                }
                noises[i].solve(left, white);
                for (int j = 0; j < m; ++j) total += left[j] * white[j];
                if (!moved[i] || !(total < cost[i] * kRises)) continue;
                any = true, cost[i] = total, used[i] = now[i], now[i] = ahead[i];
            }
            if (!any) break;
        }
        return true;
    }
};

// All returns of all tracks: each pair by its own last line, as a problem of its own. `noises`: how many each track's returns
// bring, 0 where they have the sensor's.
inline bool evaluate(const Iterations& iterations, const Batch& asked, npy_intp k, npy_intp noises, double p_gate) {
    double* const* out = asked.out;
    npy_intp t = 1;
    for (int d = 0; d < asked.dims; ++d) t *= asked.shape[d];
    const npy_intp n = iterations.n, m = iterations.m, all = t * k;
    std::vector<Pair> tracks(static_cast<std::size_t>(t));
    for (Problems each(asked); each.next();)
        tracks[static_cast<std::size_t>(each.out(2) - out[2])] = {each.in(0), each.in(1), each.in(3), each.in(2),
                                                                  noises == 0 ? nullptr : each.in(4)};
    const double nothing[kMostMeasured] = {};
    std::vector<double> room(static_cast<std::size_t>(t * (1 + n * n + m * m) + all * (m * n + m + m * m + 4)));
    double *detects = room.data(), *P = detects + t, *own = P + t * n * n, *H = own + t * m * m, *nu = H + all * m * n,
           *R = nu + all * m, *volumes = R + all * m * m, *likely = volumes + all, *unused = likely + 2 * all;
    Pair pairs[kBlock];
    Line lines[kBlock];
    for (npy_intp i = 0; i < t; i += kBlock) {
        const int count = static_cast<int>(std::min<npy_intp>(kBlock, t - i));
        double points[kMostStates * kBlock], noise[kMeasured2 * kBlock];
        for (int l = 0; l < count; ++l) {
            pairs[l] = tracks[static_cast<std::size_t>(i + l)], pairs[l].z = nothing;
            std::copy_n(pairs[l].x, n, points + l * n), std::copy_n(pairs[l].P, n * n, P + (i + l) * n * n);
        }
        iterations.look(count, pairs, points, lines, noise, detects + i);
        for (int l = 0; l < count; ++l) take_back(noise, static_cast<int>(m * m), count, l, own + (i + l) * m * m);
    }
    for (npy_intp i = 0; i < all; i += kBlock) {
        const int count = static_cast<int>(std::min<npy_intp>(kBlock, all - i));
        for (int l = 0; l < count; ++l) {
            const npy_intp track = (i + l) / k, h = (i + l) % k;
            pairs[l] = tracks[static_cast<std::size_t>(track)], pairs[l].z += h * m;
            const double* noise = noises == 0 ? own + track * m * m : pairs[l].R + (noises == 1 ? 0 : h * m * m);
            pairs[l].R = std::copy_n(noise, m * m, R + (i + l) * m * m) - m * m;
        }
        if (!iterations.run(count, pairs, lines, volumes + i)) return false;
        for (int l = 0; l < count; ++l)
            std::copy_n(lines[l].H, m * n, H + (i + l) * m * n), std::copy_n(lines[l].nu, m, nu + (i + l) * m);
    }
    if (all > 0) {
        shapes::EvaluateReturns shape{static_cast<int>(n), static_cast<int>(m), 1, 1, p_gate, {}};
        Batch batch;
        const int tall = t >= k, wide = !tall;  // the longer axis is the last one
        batch.dims = 2, batch.shape[tall] = t, batch.shape[wide] = k, batch.places[tall] = k, batch.places[wide] = 1;
        const double* in[] = {P, nu, nothing, H, R, detects};
        const std::ptrdiff_t by_track[] = {n * n, k * m, 0, k * m * n, k * m * m, 1}, by_return[] = {0, m, 0, m * n, m * m, 0};
        for (int i = 0; i < 6; ++i) batch.in[i] = in[i], batch.in_steps[i][tall] = by_track[i], batch.in_steps[i][wide] = by_return[i];
        double* to[] = {likely, out[1], unused, out[3], out[4]};
        const std::ptrdiff_t sizes[] = {2, 1, 1, n, n * n};
        for (int o = 0; o < 5; ++o) batch.out[o] = to[o], batch.out_size[o] = sizes[o];
        batch.ins = 6, batch.outs = 5;
        const WithoutSubnormals guard;
        table->evaluate_returns(batch, shape);
    }
    for (npy_intp i = 0; i < t; ++i) {
        constexpr double tiny = std::numeric_limits<double>::min();
        const double miss = 1.0 - detects[i] * p_gate;
        double *loglik = out[0] + i * (1 + k), &largest = out[2][i];
        loglik[0] = std::log(miss > tiny ? miss : tiny), largest = -std::numeric_limits<double>::infinity();
        for (npy_intp h = i * k; h < (i + 1) * k; ++h) loglik[1 + h - i * k] = likely[2 * h + 1], largest = std::max(largest, volumes[h]);
    }
    return true;
}

namespace entries {

// Arguments: x, P, returns z, their noises (*b, 1, k, m, m) or None, function, parameters, axes observed, P_G, periods of the
// state and of z, passes. Null where an S is near singular.
inline PyObject* iterate_twin(Call& call, Args args) {
    Twin<SensorTwin> twin;
    Axes axes;
    Periods state, measured;
    if (!read_periods(args[8], state) || !read_periods(args[9], measured) || !twin.read(args[4], kSensor)) return nullptr;
    const npy_intp *x = call.in(args[0], 1), *P = call.in(args[1], 2), *z = call.in(args[2], 2, true), *own = call.in(args[5], 1),
                   *R = args[3] == Py_None ? nullptr : call.in(args[3], 3);
    const double p_gate = call.number(args[7]);
    const long passes = PyLong_AsLong(args[10]);
    if (!call.ok || passes < 1) return nullptr;
    const npy_intp n = x[0], k = z[0], m = z[1];
    if (!sized(n, m, own[0]) || !square(P, n) || !axes.read(args[6], n) || !are_among(state, n) || !are_among(measured, m) ||
        (R != nullptr && (!square(R + 1, m) || (R[0] != 1 && R[0] != k))) || !call.broadcast())
        return nullptr;
    const Iterations iterations{twin, axes, state, measured, static_cast<int>(n), static_cast<int>(m), static_cast<int>(own[0]),
                                static_cast<int>(passes)};
    PyObject *loglik = call.out(1, 1 + k), *distance = call.out(1, k), *volume = call.out(0), *shift = call.out(2, k, n),
             *post = call.out(3, k, n, n);
    bool good = loglik && distance && volume && shift && post;
    if (good) good = evaluate(iterations, call.batch, k, R == nullptr ? 0 : R[0], p_gate);
    if (!good) {
        Py_XDECREF(loglik), Py_XDECREF(distance), Py_XDECREF(volume), Py_XDECREF(shift), Py_XDECREF(post);
        return nullptr;
    }
    return call.pack(loglik, distance, volume, Py_NewRef(distance), call.pack_within(shift, post));
}

}  // namespace entries
}  // namespace vedette
