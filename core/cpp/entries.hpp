// How a kernel is called: its arguments are taken and its results made. Null without an exception says that the call is none that
// the kernel is made for, by its sizes, types or number of axes.
#pragma once

#include <climits>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <optional>

#include "arguments.hpp"
#include "boxes.hpp"
#include "joint.hpp"

namespace vedette {

// The kernels of the instruction set that is in use.
inline const Table* table = nullptr;

namespace entries {

inline bool square(const npy_intp* sizes, npy_intp n) { return sizes != nullptr && sizes[0] == n && sizes[1] == n; }

inline PyObject* predict(Call& call, Args args) {
    const npy_intp *x = call.in(args[0], 1), *P = call.in(args[1], 2), *F = call.in(args[2], 2), *Q = call.in(args[3], 2);
    if (!call.ok || x[0] < 1 || x[0] > kMostStates || !square(P, x[0]) || !square(F, x[0]) || !square(Q, x[0]) ||
        !call.broadcast())
        return nullptr;
    const npy_intp n = x[0];
    PyObject *to = call.out(1, n), *cov = call.out(2, n, n);
    if (to != nullptr && cov != nullptr) call.run(table->predict, {static_cast<int>(n)});
    return call.pack(to, cov);
}

inline PyObject* propagate(Call& call, Args args) {
    const npy_intp *P = call.in(args[0], 2), *F = call.in(args[1], 2), *Q = call.in(args[2], 2);
    if (!call.ok || P[0] < 1 || P[0] > kMostStates || !square(P, P[0]) || !square(F, P[0]) || !square(Q, P[0]) ||
        !call.broadcast())
        return nullptr;
    PyObject* cov = call.out(2, P[0], P[0]);
    if (cov != nullptr) call.run(table->propagate, {static_cast<int>(P[0])});
    return cov;
}

inline PyObject* update_or_step(Call& call, Args args, bool step) {
    const npy_intp *x = call.in(args[0], 1), *P = call.in(args[1], 2), *F = nullptr, *Q = nullptr;
    if (step) F = call.in(args[2], 2), Q = call.in(args[3], 2);
    Args rest = args + (step ? 4 : 2);
    const npy_intp *z = call.in(rest[0], 1), *H = call.in(rest[1], 2), *R = call.in(rest[2], 2);
    if (!call.ok) return nullptr;
    const npy_intp n = x[0], m = z[0];
    if (n < 1 || n > kMostStates || m < 1 || m > kMostMeasured || !square(P, n) || !square(R, m) || H[0] != m || H[1] != n ||
        (step && (!square(F, n) || !square(Q, n))) || !call.broadcast())
        return nullptr;
    PyObject *to = call.out(1, n), *cov = call.out(2, n, n), *loglik = call.out(0);
    if (to != nullptr && cov != nullptr && loglik != nullptr)
        call.run(table->update, {static_cast<int>(n), static_cast<int>(m), step});
    return call.pack(to, cov, loglik);
}

inline PyObject* update(Call& call, Args args) { return update_or_step(call, args, false); }
inline PyObject* filter_step(Call& call, Args args) { return update_or_step(call, args, true); }

inline PyObject* scan_step(Call& call, Args args) {
    shapes::ScanStep shape;
    if (!PyBool_Check(args[11]) || !read_periods(args[12], shape.periods)) return nullptr;
    const npy_intp *x = call.in(args[0], 1), *P = call.in(args[1], 2), *F = call.in(args[2], 2), *Q = call.in(args[3], 2),
                   *z = call.in(args[4], 2, true), *H = call.in(args[5], 2), *R = call.in(args[6], 2);
    const double p_detect = call.number(args[7]), p_gate = call.number(args[8]), log_density = call.number(args[10]);
    shape.limit = call.number(args[9]), shape.best = args[11] == Py_True;
    if (!call.ok) return nullptr;
    const npy_intp n = x[0], m = z[1], k = z[0];
    if (n < 1 || n > kMostStates || m < 1 || m > kMostMeasured || k > kMostTaken || !square(P, n) || !square(F, n) ||
        !square(Q, n) || !square(R, m) || H[0] != m || H[1] != n || !are_among(shape.periods, m) || !call.broadcast())
        return nullptr;
    shape.n = static_cast<int>(n), shape.m = static_cast<int>(m), shape.k = static_cast<int>(k);
    constexpr double tiny = std::numeric_limits<double>::min();
    shape.log_miss = std::log(std::max(1.0 - p_detect * p_gate, tiny));
    shape.log_detect = std::log(std::max(p_detect, tiny)) - log_density;
    PyObject *to = call.out(1, n), *cov = call.out(2, n, n), *weights = call.out(1, 1 + k), *distance = call.out(1, k);
    if (to && cov && weights && distance) call.run(table->scan_step, shape);
    PyObject* after = call.pack_within(to, cov);
    return call.pack(after, weights, distance);
}

inline PyObject* evaluate_returns(Call& call, Args args) {
    shapes::EvaluateReturns shape;
    if (!read_periods(args[7], shape.periods)) return nullptr;
    const npy_intp *P = call.in(args[0], 2), *z = call.in(args[1], 2, true), *expected = call.in(args[2], 1),
                   *H = call.in(args[3], 2), *R = call.in(args[4], 3);
    call.in(args[5], 0);
    shape.p_gate = call.number(args[6]);
    if (!call.ok) return nullptr;
    const npy_intp n = P[0], m = z[1], k = z[0], noises = R[0];
    if (n < 1 || n > kMostStates || m < 1 || m > kMostMeasured || !square(P, n) || expected[0] < m || H[0] != m ||
        H[1] != n || !square(R + 1, m) || (noises != 1 && noises != k) || !are_among(shape.periods, m) || !call.broadcast())
        return nullptr;
    shape.n = static_cast<int>(n), shape.m = static_cast<int>(m), shape.k = static_cast<int>(k);
    shape.noises = static_cast<int>(noises);
    PyObject *loglik = call.out(1, 1 + k), *distance = call.out(1, k), *volume = call.out(0), *shift = call.out(2, k, n),
             *post = call.out(3, noises, n, n);
    if (loglik && distance && volume && shift && post) call.run(table->evaluate_returns, shape);
    PyObject* detail = call.pack_within(shift, post);
    return call.pack(loglik, distance, volume, Py_XNewRef(distance), detail);
}

inline PyObject* weighted_update(Call& call, Args args) {
    shapes::WeightedUpdate shape;
    if (!read_periods(args[5], shape.periods)) return nullptr;
    const npy_intp *x = call.in(args[0], 1), *P = call.in(args[1], 2), *shift = call.in(args[2], 2),
                   *post = call.in(args[3], 3), *weights = call.in(args[4], 1);
    if (!call.ok) return nullptr;
    const npy_intp n = x[0], k = shift[0];
    if (n < 1 || n > kMostStates || !square(P, n) || shift[1] != n || !square(post + 1, n) || weights[0] != 1 + k ||
        (post[0] != 1 && post[0] != k) || !are_among(shape.periods, n) || !call.broadcast())
        return nullptr;
    shape.n = static_cast<int>(n), shape.k = static_cast<int>(k), shape.shared = post[0] == 1;
    PyObject *to = call.out(1, n), *cov = call.out(2, n, n);
    if (to != nullptr && cov != nullptr) call.run(table->weighted_update, shape);
    return call.pack(to, cov);
}

inline PyObject* smooth_linear(Call& call, Args args) {
    shapes::SmoothLinear shape;
    if (!read_periods(args[6], shape.periods)) return nullptr;
    const npy_intp *x = call.in(args[0], 1), *P = call.in(args[1], 2), *F = call.in(args[2], 2), *Q = call.in(args[3], 2),
                   *later = call.in(args[4], 1), *cov = call.in(args[5], 2);
    if (!call.ok) return nullptr;
    const npy_intp n = x[0];
    if (n < 1 || n > kMostStates || !square(P, n) || !square(F, n) || !square(Q, n) || later[0] != n || !square(cov, n) ||
        !are_among(shape.periods, n) || !call.broadcast())
        return nullptr;
    shape.n = static_cast<int>(n);
    PyObject *to = call.out(1, n), *smoothed = call.out(2, n, n);
    if (to != nullptr && smoothed != nullptr) call.run(table->smooth_linear, shape);
    return call.pack(to, smoothed);
}

// The reference tells what is wrong with a covariance, so it takes what came out without a number.
inline PyObject* whiten(Call& call, Args args) {
    const npy_intp *vector = call.in(args[0], 1), *cov = call.in(args[1], 2);
    if (!call.ok || vector[0] < 1 || vector[0] > kMostStates || !square(cov, vector[0]) || !call.broadcast())
        return nullptr;
    PyObject* white = call.out(1, vector[0]);
    if (white == nullptr) return nullptr;
    call.run(table->whiten, {static_cast<int>(vector[0])});
    auto* array = reinterpret_cast<PyArrayObject*>(white);
    const auto* numbers = static_cast<const double*>(PyArray_DATA(array));
    for (npy_intp i = 0, size = PyArray_SIZE(array); i < size; ++i)
        if (std::isnan(numbers[i])) {
            Py_DECREF(white);
            return nullptr;
        }
    return white;
}

inline PyObject* sigma_points(Call& call, Args args) {
    const npy_intp* P = call.in(args[0], 2);
    const double kappa = call.number(args[1]);
    if (!call.ok || P[0] < 1 || P[0] > kMostStates || !square(P, P[0]) || !call.broadcast())
        return nullptr;
    const npy_intp n = P[0];
    npy_intp points = 2 * n + 1;
    PyObject *offsets = call.out(2, points, n), *weights = new_array(1, &points);
    if (offsets != nullptr && weights != nullptr) {
        const double scale = static_cast<double>(n) + kappa;
        auto* each = static_cast<double*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(weights)));
        each[0] = kappa / scale;
        for (npy_intp i = 1; i < points; ++i) each[i] = 0.5 / scale;
        call.run(table->sigma_points, {static_cast<int>(n), scale});
    }
    return call.pack(offsets, weights);
}

inline PyObject* evaluate_points(Call& call, Args args) {
    const npy_intp *dx = call.in(args[0], 2), *dz = call.in(args[1], 2), *weights = call.in(args[2], 1),
                   *nu = call.in(args[3], 2), *R = call.in(args[4], 3);
    if (!call.ok) return nullptr;
    const npy_intp s = dx[0], n = dx[1], k = nu[0], m = nu[1], noises = R[0];
    if (n < 1 || n > kMostStates || m < 1 || m > kMostMeasured || s < 1 || s > kMostPoints || dz[0] != s || dz[1] != m ||
        weights[0] != s || !square(R + 1, m) || (noises != 1 && noises != k) || !call.broadcast())
        return nullptr;
    PyObject *loglik = call.out(1, k), *distance = call.out(1, k), *volume = call.out(1, noises), *shift = call.out(2, k, n),
             *post = call.out(3, noises, n, n);
    if (loglik && distance && volume && shift && post)
        call.run(table->evaluate_points, {static_cast<int>(n), static_cast<int>(m), static_cast<int>(k), static_cast<int>(s),
                                          static_cast<int>(noises)});
    return call.pack(loglik, distance, volume, shift, post);
}

inline PyObject* evaluate_particles(Call& call, Args args) {
    shapes::EvaluateParticles shape;
    if (!read_periods(args[6], shape.periods)) return nullptr;
    const npy_intp *log_weights = call.in(args[0], 1), *z = call.in(args[1], 2, true), *expected = call.in(args[2], 2),
                   *R = call.in(args[3], 3), *detects = call.in(args[4], 1);
    shape.p_gate = call.number(args[5]);
    if (!call.ok) return nullptr;
    const npy_intp p = log_weights[0], k = z[0], m = z[1];
    if (p < kLanes || p > kMostParticles || m < 1 || m > kMostMeasured || k > kMostReturns || expected[0] != p ||
        expected[1] != m || (R[0] != 1 && R[0] != p) || !square(R + 1, m) || (detects[0] != 1 && detects[0] != p) ||
        !are_among(shape.periods, m) || !call.broadcast())
        return nullptr;
    shape.p = static_cast<int>(p), shape.m = static_cast<int>(m), shape.k = static_cast<int>(k);
    shape.noises = static_cast<int>(R[0]), shape.detected = static_cast<int>(detects[0]);
    PyObject *likelihoods = call.out(2, 1 + k, p), *loglik = call.out(1, 1 + k), *mean = call.out(1, m), *cov = call.out(2, m, m),
             *noise = call.out(2, m, m);
    if (likelihoods && loglik && mean && cov && noise) call.run(table->evaluate_particles, shape);
    return call.pack(likelihoods, loglik, mean, cov, noise);
}

inline PyObject* reweigh_particles(Call& call, Args args) {
    const npy_intp *log_weights = call.in(args[0], 1), *likelihoods = call.in(args[1], 2), *loglik = call.in(args[2], 1),
                   *weights = call.in(args[3], 1);
    if (!call.ok) return nullptr;
    const npy_intp p = log_weights[0], k = loglik[0] - 1;
    if (p < kLanes || p > kMostParticles || k < 0 || k > kMostReturns || likelihoods[0] != 1 + k || likelihoods[1] != p ||
        weights[0] != 1 + k || !call.broadcast())
        return nullptr;
    PyObject* to = call.out(1, p);
    if (to != nullptr) call.run(table->reweigh_particles, {static_cast<int>(p), static_cast<int>(k)});
    return to;
}

inline PyObject* pda_update(Call& call, Args args) {
    shapes::PdaUpdate shape;
    const npy_intp *xs = call.in(args[0], 2), *Ps = call.in(args[1], 3), *z = call.in(args[2], 2), *H = call.in(args[3], 2),
                   *R = call.in(args[4], 2);
    double* const numbers[] = {&shape.p_detect, &shape.p_gate, &shape.limit, &shape.log_density};
    for (int i = 0; i < 4; ++i) *numbers[i] = call.number(args[5 + i]);
    if (!call.ok) return nullptr;
    const npy_intp r = xs[0], n = xs[1], k = z[0], m = z[1];
    if (r < 1 || r > kMostModes || n < 1 || n > kMostStates || m < 1 || m > kMostMeasured || k > kMostReturns || Ps[0] != r ||
        !square(Ps + 1, n) || H[0] != m || H[1] != n || !square(R, m) || !call.broadcast())
        return nullptr;
    shape.n = static_cast<int>(n), shape.m = static_cast<int>(m), shape.k = static_cast<int>(k), shape.r = static_cast<int>(r);
    PyObject *to = call.out(2, r, n), *cov = call.out(3, r, n, n), *loglik = call.out(1, r);
    if (to && cov && loglik) call.run(table->pda_update, shape);
    return call.pack(to, cov, loglik);
}

inline PyObject* imm_mix(Call& call, Args args) {
    const npy_intp *prob = call.in(args[0], 1), *transition = call.in(args[1], 2), *xs = call.in(args[2], 2),
                   *Ps = call.in(args[3], 3);
    if (!call.ok) return nullptr;
    const npy_intp r = prob[0], n = xs[1];
    if (r < 1 || r > kMostModes || n < 1 || n > kMostStates || !square(transition, r) || xs[0] != r || Ps[0] != r ||
        !square(Ps + 1, n) || !call.broadcast())
        return nullptr;
    PyObject *after = call.out(1, r), *means = call.out(2, r, n), *covs = call.out(3, r, n, n);
    if (after && means && covs) call.run(table->imm_mix, {static_cast<int>(n), static_cast<int>(r)});
    return call.pack(after, means, covs);
}

inline PyObject* imm_combine(Call& call, Args args) {
    const npy_intp *prob = call.in(args[0], 1), *seen = call.in(args[1], 1), *xs = call.in(args[2], 2),
                   *Ps = call.in(args[3], 3);
    if (!call.ok) return nullptr;
    const npy_intp r = prob[0], n = xs[1];
    if (r < 1 || r > kMostModes || n < 1 || n > kMostStates || seen[0] != r || xs[0] != r || Ps[0] != r ||
        !square(Ps + 1, n) || !call.broadcast())
        return nullptr;
    PyObject *after = call.out(1, r), *mean = call.out(1, n), *cov = call.out(2, n, n), *loglik = call.out(0);
    if (after && mean && cov && loglik) call.run(table->imm_combine, {static_cast<int>(n), static_cast<int>(r)});
    return call.pack(after, mean, cov, loglik);
}

// The arrays of a list or tuple, one a mode.
inline bool read_modes(Call& call, PyObject* given, Py_ssize_t r, int core, const npy_intp** sizes) {
    PyObject* items = call.as_tuple(given);
    if (items == nullptr || PyTuple_GET_SIZE(items) != r) return false;
    for (Py_ssize_t j = 0; j < r; ++j) {
        sizes[j] = call.in(PyTuple_GET_ITEM(items, j), core);
        if (!call.ok) return false;
    }
    return true;
}

// The means, covariances and axes of a bank: arguments xs, Ps, own, absent, periods.
inline bool read_bank(Call& call, Args args, npy_intp r, shapes::MixModes& shape) {
    const npy_intp *means[kMostModes], *covs[kMostModes];
    if (r < 1 || r > kMostModes || !read_modes(call, args[0], r, 1, means) || !read_modes(call, args[1], r, 2, covs) ||
        !read_periods(args[4], shape.periods) || !PyTuple_CheckExact(args[2]) || PyTuple_GET_SIZE(args[2]) != r)
        return false;
    PyArrayObject* absent = call.as_doubles(args[3], 2);
    if (absent == nullptr || PyArray_NDIM(absent) != 2 || PyArray_DIM(absent, 0) != 2) return false;
    const npy_intp n = PyArray_DIM(absent, 1);
    if (n < 1 || n > kMostStates || !are_among(shape.periods, n)) return false;
    std::memcpy(shape.absent, PyArray_DATA(absent), 2 * static_cast<size_t>(n) * sizeof(double));
    shape.n = static_cast<int>(n), shape.r = static_cast<int>(r), shape.same = true;
    for (npy_intp j = 0; j < r; ++j) {
        PyObject* axes = PyTuple_GET_ITEM(args[2], j);
        const npy_intp size = means[j][0];
        if (!PyTuple_CheckExact(axes) || PyTuple_GET_SIZE(axes) != size || size > n || !square(covs[j], size)) return false;
        shape.sizes[j] = static_cast<int>(size);
        shape.same = shape.same && size == n;
        for (npy_intp a = 0; a < size; ++a) {
            const long axis = PyLong_AsLong(PyTuple_GET_ITEM(axes, a));
            if (axis < 0 || axis >= n) return false;
            shape.own[j][a] = static_cast<int>(axis);
            shape.same = shape.same && axis == a;
        }
    }
    return true;
}

inline PyObject* mix_modes(Call& call, Args args) {
    shapes::MixModes shape;
    const npy_intp *prob = call.in(args[0], 1), *transition = call.in(args[1], 2);
    if (!call.ok || !square(transition, prob[0]) || !read_bank(call, args + 2, prob[0], shape) || !call.broadcast())
        return nullptr;
    const int r = shape.r;
    PyObject *after = call.out(1, r), *beliefs = PyTuple_New(r), *means[kMostModes], *covs[kMostModes];
    bool good = after != nullptr && beliefs != nullptr;
    int made = 0;
    for (; good && made < r; ++made) {
        means[made] = call.out(1, shape.sizes[made]), covs[made] = nullptr;
        good = means[made] != nullptr;
    }
    for (int j = 0; good && j < r; ++j) {
        covs[j] = call.out(2, shape.sizes[j], shape.sizes[j]);
        good = covs[j] != nullptr;
    }
    for (int j = 0; j < made; ++j) {
        PyObject* belief = good ? call.pack_within(means[j], covs[j]) : (Py_XDECREF(means[j]), Py_XDECREF(covs[j]), nullptr);
        if (good) PyTuple_SET_ITEM(beliefs, j, belief);
        good = good && belief != nullptr;
    }
    if (!good) {
        Py_XDECREF(after), Py_XDECREF(beliefs);
        return nullptr;
    }
    call.run(table->mix_modes, shape);
    return call.pack(after, beliefs);
}

inline PyObject* mixture_moments(Call& call, Args args) {
    shapes::MixtureMoments shape;
    const npy_intp* prob = call.in(args[0], 1);
    if (!call.ok || !read_bank(call, args + 1, prob[0], shape.bank) || !call.broadcast()) return nullptr;
    PyObject *mean = call.out(1, shape.bank.n), *cov = call.out(2, shape.bank.n, shape.bank.n);
    if (mean != nullptr && cov != nullptr) call.run(table->mixture_moments, shape);
    return call.pack(mean, cov);
}

inline PyObject* weigh_modes(Call& call, Args args) {
    const npy_intp *prob = call.in(args[0], 1), *sizes[4][kMostModes];
    PyObject* all = call.as_tuple(args[1]);
    const npy_intp r = call.ok ? prob[0] : 0;
    if (r < 1 || r > kMostModes || PyTuple_GET_SIZE(all) != r) return nullptr;
    constexpr int core[4] = {1, 1, 0, 1};  // loglik, distance, log volume, squared distance expected
    for (int what = 0; what < 4; ++what)
        for (npy_intp j = 0; j < r; ++j) {
            PyObject* said = PyTuple_GET_ITEM(all, j);
            if (!PyTuple_CheckExact(said) || PyTuple_GET_SIZE(said) != 4) return nullptr;
            sizes[what][j] = call.in(PyTuple_GET_ITEM(said, what), core[what]);
            if (!call.ok) return nullptr;
        }
    const npy_intp k = sizes[1][0][0];
    for (npy_intp j = 0; j < r; ++j)
        if (sizes[0][j][0] != 1 + k || sizes[1][j][0] != k || sizes[3][j][0] != k) return nullptr;
    if (!call.broadcast()) return nullptr;
    PyObject *loglik = call.out(1, 1 + k), *distance = call.out(1, k), *volume = call.out(0), *expected = call.out(1, k),
             *share = call.out(2, 1 + k, r);
    if (loglik && distance && volume && expected && share)
        call.run(table->weigh_modes, {static_cast<int>(k), static_cast<int>(r)});
    return call.pack(loglik, distance, volume, expected, share);
}

inline PyObject* split_weights(Call& call, Args args) {
    const npy_intp *weights = call.in(args[0], 1), *share = call.in(args[1], 2);
    if (!call.ok || weights[0] < 1 || share[0] != weights[0] || share[1] < 1 || share[1] > kMostModes || !call.broadcast())
        return nullptr;
    const npy_intp k = weights[0] - 1, r = share[1];
    PyObject *after = call.out(1, r), *own = PyTuple_New(r);
    bool good = after != nullptr && own != nullptr;
    for (npy_intp j = 0; good && j < r; ++j) {
        PyObject* at_offset = call.out(1, 1 + k);
        good = at_offset != nullptr;
        if (good) PyTuple_SET_ITEM(own, j, at_offset);
    }
    if (!good) {
        Py_XDECREF(after), Py_XDECREF(own);
        return nullptr;
    }
    call.run(table->split_weights, {static_cast<int>(k), static_cast<int>(r)});
    return call.pack(after, own);
}

// Which returns count: as numbers, or where all do for their shape alone.
inline bool read_valid(Call& call, PyObject* valid, npy_intp k, bool& needed) {
    if (!PyArray_CheckExact(valid)) return false;
    auto* array = reinterpret_cast<PyArrayObject*>(valid);
    if (PyArray_TYPE(array) != NPY_BOOL || PyArray_NDIM(array) < 1 ||
        PyArray_DIM(array, PyArray_NDIM(array) - 1) != k)
        return false;
    needed = !PyArray_IS_C_CONTIGUOUS(array) ||
             std::memchr(PyArray_DATA(array), 0, static_cast<size_t>(PyArray_SIZE(array))) != nullptr;
    return (needed ? call.in(valid, 1, true) : call.shape_of(array, 1, true)) != nullptr;
}

inline PyObject* gate_scores(Call& call, Args args) {
    shapes::GateScores shape;
    if (!PyFloat_Check(args[4])) return nullptr;
    const npy_intp *loglik = call.in(args[0], 1), *distance = call.in(args[1], 1);
    call.in(args[3], 0);
    shape.limit = PyFloat_AS_DOUBLE(args[4]);
    const bool is_number = PyFloat_Check(args[5]) ||
                           (PyArray_CheckExact(args[5]) && PyArray_NDIM(reinterpret_cast<PyArrayObject*>(args[5])) == 0);
    const npy_intp* density = call.in(args[5], is_number ? 0 : 1);
    if (!call.ok) return nullptr;
    const npy_intp k = distance[0];
    shape.k = static_cast<int>(k);
    shape.per_return = !is_number && density[0] != 1;
    shape.evidence = args[6] != Py_None;
    if (loglik[0] != 1 + k || (shape.per_return && density[0] != k)) return nullptr;
    if (shape.evidence) {
        const npy_intp* evidence = call.in(args[6], 1);
        if (!call.ok || evidence[0] != k) return nullptr;
    }
    if (!read_valid(call, args[2], k, shape.valid) || !call.broadcast()) return nullptr;
    PyObject* scores = call.out(1, 1 + k);
    if (scores != nullptr) call.run(table->gate_scores, shape);
    return scores;
}

inline PyObject* sample_density(Call& call, Args args) {
    shapes::SampleDensity shape;
    if (!PyFloat_Check(args[2]) || !PyFloat_Check(args[4])) return nullptr;
    const npy_intp* distance = call.in(args[0], 1);
    call.in(args[3], 0);
    shape.limit = PyFloat_AS_DOUBLE(args[2]), shape.log_ball = PyFloat_AS_DOUBLE(args[4]);
    if (!call.ok || !read_valid(call, args[1], distance[0], shape.valid) || !call.broadcast())
        return nullptr;
    shape.k = static_cast<int>(distance[0]);
    PyObject* density = call.out(1, 1);
    if (density != nullptr) call.run(table->sample_density, shape);
    return density;
}

inline PyObject* association_weights(Call& call, Args args, bool hard) {
    const npy_intp* scores = call.in(args[0], 1);
    if (!call.ok || scores[0] < 1 || !call.broadcast()) return nullptr;
    PyObject* weights = call.out(1, scores[0]);
    if (weights != nullptr) call.run(table->softmax, {static_cast<int>(scores[0] - 1), hard});
    return weights;
}

inline PyObject* softmax(Call& call, Args args) { return association_weights(call, args, false); }
inline PyObject* one_hot(Call& call, Args args) { return association_weights(call, args, true); }

inline PyObject* existence(Call& call, Args args) {
    shapes::Existence shape;
    if (!PyBool_Check(args[5])) return nullptr;
    const npy_intp *scores = call.in(args[0], 2), *weights = call.in(args[1], 2), *prior = call.in(args[2], 1),
                   *loglik = call.in(args[3], 2);
    shape.p_gate = call.number(args[4]);
    shape.exclusive = args[5] == Py_True;
    if (!call.ok) return nullptr;
    const npy_intp t = scores[0], columns = scores[1];
    if (columns < 1 || weights[0] != t || weights[1] != columns || prior[0] != t || loglik[0] != t || loglik[1] != columns ||
        !call.broadcast())
        return nullptr;
    shape.t = static_cast<int>(t), shape.k = static_cast<int>(columns - 1);
    PyObject *hit = call.out(1, t), *exists = call.out(1, t), *detected = call.out(1, t), *room = call.out(1, columns - 1);
    if (hit && exists && detected && room) call.run(table->existence, shape);
    Py_XDECREF(room);
    return room == nullptr ? (Py_XDECREF(hit), Py_XDECREF(exists), Py_XDECREF(detected), nullptr) : call.pack(hit, exists, detected);
}

inline PyObject* is_plain(Call&, Args args) {
    if (!PyArray_CheckExact(args[0]) || !PyArray_CheckExact(args[1]) || !PyFloat_Check(args[3]))
        return nullptr;
    auto *z = reinterpret_cast<PyArrayObject*>(args[0]), *valid = reinterpret_cast<PyArrayObject*>(args[1]);
    const int dims = PyArray_NDIM(valid);
    const long axes = PyLong_AsLong(args[2]);
    if (PyErr_Occurred() || dims < 1 || PyArray_TYPE(z) != NPY_DOUBLE || PyArray_TYPE(valid) != NPY_BOOL ||
        !PyArray_ISCARRAY_RO(z) || !PyArray_ISCARRAY_RO(valid))
        return nullptr;
    if (PyArray_NDIM(z) != dims + 1 || PyArray_DIM(z, dims) != axes ||
        !PyArray_CompareLists(PyArray_DIMS(z), PyArray_DIMS(valid), dims) ||
        std::memchr(PyArray_DATA(valid), 0, static_cast<size_t>(PyArray_SIZE(valid))) != nullptr)
        Py_RETURN_FALSE;
    const auto* numbers = static_cast<const double*>(PyArray_DATA(z));
    const double limit = PyFloat_AS_DOUBLE(args[3]);
    for (npy_intp i = 0, size = PyArray_SIZE(z); i < size; ++i)
        if (!(std::fabs(numbers[i]) <= limit)) Py_RETURN_FALSE;
    Py_RETURN_TRUE;
}

// Arguments: costs (n, m), infinite where forbidden, and how many to find.
inline PyObject* k_best(Call& call, Args args) {
    PyArrayObject* cost = call.as_doubles(args[0], 2);
    const Py_ssize_t k = PyNumber_AsSsize_t(args[1], PyExc_OverflowError);
    if (!call.ok || PyErr_Occurred() || PyArray_NDIM(cost) != 2 || PyArray_DIM(cost, 0) > INT_MAX ||
        PyArray_DIM(cost, 1) > INT_MAX)
        return nullptr;
    const int n = static_cast<int>(PyArray_DIM(cost, 0)), m = static_cast<int>(PyArray_DIM(cost, 1));
    const auto* numbers = static_cast<const double*>(PyArray_DATA(cost));
    for (npy_intp i = 0, size = PyArray_SIZE(cost); i < size; ++i)
        if (!(numbers[i] > -std::numeric_limits<double>::infinity())) return nullptr;
    std::optional<Ranking> ranking;
    bool enough = true;
    Py_BEGIN_ALLOW_THREADS;
    try {
        ranking.emplace(numbers, n, m).find(k);
    } catch (const std::bad_alloc&) {
        enough = false;
    }
    Py_END_ALLOW_THREADS;
    if (!enough) return PyErr_NoMemory();
    npy_intp shape[2] = {static_cast<npy_intp>(ranking->found.size()), n};
    PyObject *columns = PyArray_SimpleNew(2, shape, NPY_INT64), *costs = new_array(1, shape);
    if (columns != nullptr && costs != nullptr) {
        auto* column = static_cast<npy_int64*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(columns)));
        auto* total = static_cast<double*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(costs)));
        for (const auto& [sum, node] : ranking->found) {
            *total++ = sum;
            column = std::copy_n(ranking->columns(node), n, column);
        }
    }
    return call.pack(columns, costs);
}

// Arguments: scores (*b, t, 1+k), and how many tracks or returns may be open at once. The tracks (*b, t) of clusters that need
// more, and before them, unless they alone are asked for, the weights.
inline PyObject* joint(Call& call, Args args, bool weigh) {
    PyArrayObject* given = call.as_doubles(args[0], 0);
    const Py_ssize_t most = PyNumber_AsSsize_t(args[1], PyExc_OverflowError);
    if (!call.ok || PyErr_Occurred() || most > kMostOpen) return nullptr;
    const int dims = PyArray_NDIM(given);
    if (dims < 2 || dims > kMostDims || !PyArray_IS_C_CONTIGUOUS(given)) return nullptr;
    npy_intp* shape = PyArray_DIMS(given);
    const npy_intp t = shape[dims - 2], columns = shape[dims - 1], size = PyArray_SIZE(given);
    if (columns < 1 || size > INT_MAX) return nullptr;
    PyObject *weights = weigh ? new_array(dims, shape) : nullptr, *wide = PyArray_SimpleNew(dims - 1, shape, NPY_BOOL);
    if (wide == nullptr || (weigh && weights == nullptr)) return Py_XDECREF(weights), Py_XDECREF(wide), nullptr;
    const auto* scores = static_cast<const double*>(PyArray_DATA(given));
    auto* to = weigh ? static_cast<double*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(weights))) : nullptr;
    auto* flags = static_cast<bool*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(wide)));
    bool enough = true;
    Py_BEGIN_ALLOW_THREADS;
    try {
        Joint one(static_cast<int>(columns - 1), static_cast<int>(most));
        Meetings met;
        std::vector<double> shares, misses(static_cast<std::size_t>(t));
        for (npy_intp done = 0; done < size; done += t * columns, flags += t) {
            met.clear();
            for (npy_intp i = 0; i < t; ++i) {
                const double* row = scores + done + i * columns;
                for (int j = 1; j < columns; ++j)
                    if (row[j] > -std::numeric_limits<double>::infinity()) met.returns.push_back(j - 1), met.scores.push_back(row[j]);
                met.close(row[0]);
            }
            shares.resize(met.returns.size());
            one.run(met, shares.data(), weigh ? misses.data() : nullptr, flags);
            if (!weigh) continue;
            std::fill_n(to + done, t * columns, 0.0);
            for (npy_intp i = 0; i < t; ++i) {
                double* row = to + done + i * columns;
                row[0] = misses[i];
                for (int e = met.starts[i]; e < met.starts[i + 1]; ++e) row[1 + met.returns[e]] = shares[e];
            }
        }
    } catch (const std::bad_alloc&) {
        enough = false;
    }
    Py_END_ALLOW_THREADS;
    if (!enough) return Py_XDECREF(weights), Py_DECREF(wide), PyErr_NoMemory();
    return weigh ? call.pack(weights, wide) : wide;
}

inline PyObject* joint_weights(Call& call, Args args) { return joint(call, args, true); }
inline PyObject* wide_clusters(Call& call, Args args) { return joint(call, args, false); }

// Arguments: lower and upper edges (t, m), points (k, m), periods, and how many pairs are too many.
inline PyObject* pairs_in_boxes(Call& call, Args args) {
    Periods periods;
    if (!read_periods(args[3], periods)) return nullptr;
    PyArrayObject* arrays[3];
    for (int i = 0; i < 3; ++i) {
        arrays[i] = call.as_doubles(args[i], 2);
        if (!call.ok || PyArray_NDIM(arrays[i]) != 2) return nullptr;
    }
    const Py_ssize_t most = PyNumber_AsSsize_t(args[4], PyExc_OverflowError);
    const npy_intp t = PyArray_DIM(arrays[0], 0), m = PyArray_DIM(arrays[0], 1), k = PyArray_DIM(arrays[2], 0);
    if (PyErr_Occurred() || m < 1 || k > INT_MAX || PyArray_DIM(arrays[1], 0) != t || PyArray_DIM(arrays[1], 1) != m ||
        PyArray_DIM(arrays[2], 1) != m || !are_among(periods, m))
        return nullptr;
    const double* numbers[3];
    for (int i = 0; i < 3; ++i) numbers[i] = static_cast<const double*>(PyArray_DATA(arrays[i]));
    std::vector<std::int64_t> boxes, points;
    bool enough = true;
    Py_BEGIN_ALLOW_THREADS;
    try {
        const Grid grid(numbers[2], k, static_cast<int>(m), periods);
        for (npy_intp i = 0; i < t && static_cast<Py_ssize_t>(points.size()) <= most; ++i) {
            grid.find(numbers[0] + i * m, numbers[1] + i * m, points);
            boxes.resize(points.size(), i);
        }
    } catch (const std::bad_alloc&) {
        enough = false;
    }
    Py_END_ALLOW_THREADS;
    if (!enough) return PyErr_NoMemory();
    npy_intp size = static_cast<npy_intp>(points.size());
    if (size > most) size = most + 1;
    PyObject *first = PyArray_SimpleNew(1, &size, NPY_INT64), *second = PyArray_SimpleNew(1, &size, NPY_INT64);
    if (first != nullptr && second != nullptr) {
        std::copy_n(boxes.data(), size, static_cast<std::int64_t*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(first))));
        std::copy_n(points.data(), size, static_cast<std::int64_t*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(second))));
    }
    return call.pack(first, second);
}

// Arguments: a block, p rows of p floats in tuples, and the number of axes c: that block over each of them, (p c, p c).
inline PyObject* over_axes(Call&, Args args) {
    const Py_ssize_t count = PyNumber_AsSsize_t(args[1], PyExc_OverflowError);
    const Py_ssize_t p = PyTuple_CheckExact(args[0]) ? PyTuple_GET_SIZE(args[0]) : 0;
    if (PyErr_Occurred() || p < 1 || p > 4 || count < 1 || count > 4) return nullptr;
    double block[16];
    for (Py_ssize_t i = 0; i < p; ++i) {
        PyObject* row = PyTuple_GET_ITEM(args[0], i);
        if (!PyTuple_CheckExact(row) || PyTuple_GET_SIZE(row) != p) return nullptr;
        for (Py_ssize_t j = 0; j < p; ++j) {
            PyObject* number = PyTuple_GET_ITEM(row, j);
            if (!PyFloat_Check(number)) return nullptr;
            block[i * p + j] = PyFloat_AS_DOUBLE(number);
        }
    }
    npy_intp shape[2] = {p * count, p * count};
    PyObject* whole = new_array(2, shape);
    if (whole == nullptr) return nullptr;
    auto* to = static_cast<double*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(whole)));
    std::fill_n(to, shape[0] * shape[1], 0.0);
    for (Py_ssize_t i = 0; i < p; ++i)
        for (Py_ssize_t j = 0; j < p; ++j)
            for (Py_ssize_t a = 0; a < count; ++a) to[(i * count + a) * shape[1] + j * count + a] = block[i * p + j];
    return whole;
}

// Arguments: tracks (p,) and returns (p,) that go together, and how many there are of each: the number of the cluster that each
// track and each return is in, counted from the first track on.
inline PyObject* linked_clusters(Call&, Args args) {
    PyArrayObject* pairs[2];
    for (int i = 0; i < 2; ++i) {
        if (!PyArray_CheckExact(args[i])) return nullptr;
        pairs[i] = reinterpret_cast<PyArrayObject*>(args[i]);
        if (PyArray_TYPE(pairs[i]) != NPY_INT64 || PyArray_NDIM(pairs[i]) != 1 || !PyArray_ISCARRAY_RO(pairs[i])) return nullptr;
    }
    const Py_ssize_t t = PyNumber_AsSsize_t(args[2], PyExc_OverflowError), k = PyNumber_AsSsize_t(args[3], PyExc_OverflowError);
    const npy_intp size = PyArray_DIM(pairs[0], 0);
    if (PyErr_Occurred() || t < 0 || k < 0 || PyArray_DIM(pairs[1], 0) != size) return nullptr;
    const auto *tracks = static_cast<const std::int64_t*>(PyArray_DATA(pairs[0])),
               *returns = static_cast<const std::int64_t*>(PyArray_DATA(pairs[1]));
    for (npy_intp p = 0; p < size; ++p)
        if (tracks[p] < 0 || tracks[p] >= t || returns[p] < 0 || returns[p] >= k) return nullptr;
    npy_intp nodes = t + k;
    PyObject* labels = PyArray_SimpleNew(1, &nodes, NPY_INT64);
    if (labels == nullptr) return nullptr;
    auto* root = static_cast<std::int64_t*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(labels)));
    for (npy_intp i = 0; i < nodes; ++i) root[i] = i;
    const auto find = [root](std::int64_t i) {
        while (root[i] != i) i = root[i] = root[root[i]];
        return i;
    };
    for (npy_intp p = 0; p < size; ++p) {
        const std::int64_t a = find(tracks[p]), b = find(t + returns[p]);
        root[std::max(a, b)] = std::min(a, b);
    }
    std::int64_t count = 0;
    for (npy_intp i = 0; i < nodes; ++i) root[i] = root[i] == i ? -1 - count++ : root[root[i]];  // roots come first
    for (npy_intp i = 0; i < nodes; ++i) root[i] = -1 - root[i];
    return labels;
}

}  // namespace entries
}  // namespace vedette
