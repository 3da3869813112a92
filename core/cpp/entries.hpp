// How a kernel is called: its arguments are taken and its results made. Null without an exception says that the call is none that
// the kernel is made for, by its sizes, types or number of axes.
#pragma once

#include <cmath>
#include <cstring>
#include <limits>

#include "arguments.hpp"

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

}  // namespace entries
}  // namespace vedette
