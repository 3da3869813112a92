// How the kernels of banks of modes are called.
#pragma once

#include "entries.hpp"

namespace vedette::entries {

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

}  // namespace vedette::entries
