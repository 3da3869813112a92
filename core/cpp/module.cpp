// vedette.kernels._compiled: the reference's kernels under the same names. A call that a compiled kernel is not made for,
// by its sizes, types or number of axes, goes to the reference.

#include "arguments.hpp"

#include <cmath>
#include <cstring>
#include <initializer_list>

namespace vedette {

namespace baseline {
extern const Table table;
}
#ifdef VEDETTE_X86
namespace avx2 {
extern const Table table;
}
namespace avx512 {
extern const Table table;
}
#endif

namespace {

enum Name {
    kPredict, kPropagate, kUpdate, kFilterStep, kInnovateReturns, kAbsorb, kWhiten, kSigmaPoints, kInnovatePoints, kPdaUpdate, kImmMix, kImmCombine, kInteract, kTogether, kWeighModes, kSplitWeights,
    kGateScores, kSampleDensity, kSoftmax, kOneHot, kExistence, kIsPlain, kNames
};
const char* const kText[kNames] = {
    "predict", "propagate", "update", "filter_step", "innovate_returns", "absorb", "whiten", "sigma_points", "innovate_points", "pda_update", "imm_mix", "imm_combine", "interact", "together", "weigh_modes",
    "split_weights", "gate_scores", "sample_density", "softmax", "one_hot", "existence", "is_plain",
};

PyObject* reference[kNames];
const Table* table = &baseline::table;
const char* chosen = "baseline";

using Args = PyObject* const*;

PyObject* refer(Name name, Args args, Py_ssize_t count) {
    if (reference[name] == nullptr) {
        PyErr_Format(PyExc_RuntimeError, "no reference is bound for %s", kText[name]);
        return nullptr;
    }
    return PyObject_Vectorcall(reference[name], args, static_cast<size_t>(count), nullptr);
}

template <class... Parts>
PyObject* pack(Parts... parts) {
    PyObject* all[] = {parts...};
    constexpr Py_ssize_t count = sizeof...(parts);
    PyObject* tuple = PyTuple_New(count);
    bool good = tuple != nullptr;
    for (PyObject* part : all) good = good && part != nullptr;
    if (!good) {
        for (PyObject* part : all) Py_XDECREF(part);
        Py_XDECREF(tuple);
        return nullptr;
    }
    for (Py_ssize_t i = 0; i < count; ++i) PyTuple_SET_ITEM(tuple, i, all[i]);
    return tuple;
}

bool square(const npy_intp* sizes, npy_intp n) { return sizes != nullptr && sizes[0] == n && sizes[1] == n; }

PyObject* predict(PyObject*, Args args, Py_ssize_t count) {
    Call call;
    if (count != 4) return refer(kPredict, args, count);
    const npy_intp *x = call.in(args[0], 1), *P = call.in(args[1], 2), *F = call.in(args[2], 2), *Q = call.in(args[3], 2);
    if (!call.ok || x[0] < 1 || x[0] > kMostStates || !square(P, x[0]) || !square(F, x[0]) || !square(Q, x[0]) ||
        !call.broadcast())
        return refer(kPredict, args, count);
    const npy_intp n = x[0];
    PyObject *to = call.out(1, n), *cov = call.out(2, n, n);
    if (to != nullptr && cov != nullptr) call.run(table->predict, {static_cast<int>(n)});
    return pack(to, cov);
}

PyObject* propagate(PyObject*, Args args, Py_ssize_t count) {
    Call call;
    if (count != 3) return refer(kPropagate, args, count);
    const npy_intp *P = call.in(args[0], 2), *F = call.in(args[1], 2), *Q = call.in(args[2], 2);
    if (!call.ok || P[0] < 1 || P[0] > kMostStates || !square(P, P[0]) || !square(F, P[0]) || !square(Q, P[0]) ||
        !call.broadcast())
        return refer(kPropagate, args, count);
    PyObject* cov = call.out(2, P[0], P[0]);
    if (cov != nullptr) call.run(table->propagate, {static_cast<int>(P[0])});
    return cov;
}

PyObject* updated(Name name, Args args, Py_ssize_t count) {
    Call call;
    const bool step = name == kFilterStep;
    if (count != (step ? 7 : 5)) return refer(name, args, count);
    const npy_intp *x = call.in(args[0], 1), *P = call.in(args[1], 2), *F = nullptr, *Q = nullptr;
    if (step) F = call.in(args[2], 2), Q = call.in(args[3], 2);
    Args rest = args + (step ? 4 : 2);
    const npy_intp *z = call.in(rest[0], 1), *H = call.in(rest[1], 2), *R = call.in(rest[2], 2);
    if (!call.ok) return refer(name, args, count);
    const npy_intp n = x[0], m = z[0];
    if (n < 1 || n > kMostStates || m < 1 || m > kMostMeasured || !square(P, n) || !square(R, m) || H[0] != m || H[1] != n ||
        (step && (!square(F, n) || !square(Q, n))) || !call.broadcast())
        return refer(name, args, count);
    PyObject *to = call.out(1, n), *cov = call.out(2, n, n), *loglik = call.out(0);
    if (to != nullptr && cov != nullptr && loglik != nullptr)
        call.run(table->update, {static_cast<int>(n), static_cast<int>(m), step});
    return pack(to, cov, loglik);
}

PyObject* update(PyObject*, Args args, Py_ssize_t count) { return updated(kUpdate, args, count); }
PyObject* filter_step(PyObject*, Args args, Py_ssize_t count) { return updated(kFilterStep, args, count); }

PyObject* innovate_returns(PyObject*, Args args, Py_ssize_t count) {
    Call call;
    shapes::InnovateReturns shape;
    if (count != 8 || !read_periods(args[7], shape.periods)) return refer(kInnovateReturns, args, count);
    const npy_intp *P = call.in(args[0], 2), *z = call.in(args[1], 2, true), *expected = call.in(args[2], 1),
                   *H = call.in(args[3], 2), *R = call.in(args[4], 3);
    call.in(args[5], 0);
    shape.p_gate = PyFloat_AsDouble(args[6]);
    if (PyErr_Occurred()) PyErr_Clear(), call.refuse();
    if (!call.ok) return refer(kInnovateReturns, args, count);
    const npy_intp n = P[0], m = z[1], k = z[0], noises = R[0];
    if (n < 1 || n > kMostStates || m < 1 || m > kMostMeasured || !square(P, n) || expected[0] != m || H[0] != m ||
        H[1] != n || !square(R + 1, m) || (noises != 1 && noises != k) || !are_among(shape.periods, m) || !call.broadcast())
        return refer(kInnovateReturns, args, count);
    shape.n = static_cast<int>(n), shape.m = static_cast<int>(m), shape.k = static_cast<int>(k);
    shape.noises = static_cast<int>(noises);
    PyObject *loglik = call.out(1, 1 + k), *distance = call.out(1, k), *volume = call.out(0), *shift = call.out(2, k, n),
             *post = call.out(3, noises, n, n);
    if (loglik && distance && volume && shift && post) call.run(table->innovate_returns, shape);
    return pack(loglik, distance, volume, shift, post);
}

PyObject* absorb(PyObject*, Args args, Py_ssize_t count) {
    Call call;
    shapes::Absorb shape;
    if (count != 6 || !read_periods(args[5], shape.periods)) return refer(kAbsorb, args, count);
    const npy_intp *x = call.in(args[0], 1), *P = call.in(args[1], 2), *shift = call.in(args[2], 2),
                   *post = call.in(args[3], 3), *weights = call.in(args[4], 1);
    if (!call.ok) return refer(kAbsorb, args, count);
    const npy_intp n = x[0], k = shift[0];
    if (n < 1 || n > kMostStates || !square(P, n) || shift[1] != n || !square(post + 1, n) || weights[0] != 1 + k ||
        (post[0] != 1 && post[0] != k) || !are_among(shape.periods, n) || !call.broadcast())
        return refer(kAbsorb, args, count);
    shape.n = static_cast<int>(n), shape.k = static_cast<int>(k), shape.shared = post[0] == 1;
    PyObject *to = call.out(1, n), *cov = call.out(2, n, n);
    if (to != nullptr && cov != nullptr) call.run(table->absorb, shape);
    return pack(to, cov);
}

// The reference tells what is wrong with a covariance, so it takes what came out without a number.
PyObject* whiten(PyObject*, Args args, Py_ssize_t count) {
    Call call;
    if (count != 2) return refer(kWhiten, args, count);
    const npy_intp *vector = call.in(args[0], 1), *cov = call.in(args[1], 2);
    if (!call.ok || vector[0] < 1 || vector[0] > kMostStates || !square(cov, vector[0]) || !call.broadcast())
        return refer(kWhiten, args, count);
    PyObject* white = call.out(1, vector[0]);
    if (white == nullptr) return nullptr;
    call.run(table->whiten, {static_cast<int>(vector[0])});
    auto* array = reinterpret_cast<PyArrayObject*>(white);
    const auto* numbers = static_cast<const double*>(PyArray_DATA(array));
    for (npy_intp i = 0, size = PyArray_SIZE(array); i < size; ++i)
        if (std::isnan(numbers[i])) {
            Py_DECREF(white);
            return refer(kWhiten, args, count);
        }
    return white;
}

PyObject* sigma_points(PyObject*, Args args, Py_ssize_t count) {
    Call call;
    if (count != 2) return refer(kSigmaPoints, args, count);
    const npy_intp* P = call.in(args[0], 2);
    const double kappa = PyFloat_AsDouble(args[1]);
    if (PyErr_Occurred()) PyErr_Clear(), call.refuse();
    if (!call.ok || P[0] < 1 || P[0] > kMostStates || !square(P, P[0]) || !call.broadcast())
        return refer(kSigmaPoints, args, count);
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
    return pack(offsets, weights);
}

PyObject* innovate_points(PyObject*, Args args, Py_ssize_t count) {
    Call call;
    if (count != 5) return refer(kInnovatePoints, args, count);
    const npy_intp *dx = call.in(args[0], 2), *dz = call.in(args[1], 2), *weights = call.in(args[2], 1),
                   *nu = call.in(args[3], 2), *R = call.in(args[4], 3);
    if (!call.ok) return refer(kInnovatePoints, args, count);
    const npy_intp s = dx[0], n = dx[1], k = nu[0], m = nu[1], noises = R[0];
    if (n < 1 || n > kMostStates || m < 1 || m > kMostMeasured || s < 1 || s > kMostPoints || dz[0] != s || dz[1] != m ||
        weights[0] != s || !square(R + 1, m) || (noises != 1 && noises != k) || !call.broadcast())
        return refer(kInnovatePoints, args, count);
    PyObject *loglik = call.out(1, k), *distance = call.out(1, k), *volume = call.out(1, noises), *shift = call.out(2, k, n),
             *post = call.out(3, noises, n, n);
    if (loglik && distance && volume && shift && post)
        call.run(table->innovate_points, {static_cast<int>(n), static_cast<int>(m), static_cast<int>(k), static_cast<int>(s),
                                          static_cast<int>(noises)});
    return pack(loglik, distance, volume, shift, post);
}

PyObject* pda_update(PyObject*, Args args, Py_ssize_t count) {
    Call call;
    shapes::PdaUpdate shape;
    if (count != 9) return refer(kPdaUpdate, args, count);
    const npy_intp *xs = call.in(args[0], 2), *Ps = call.in(args[1], 3), *z = call.in(args[2], 2), *H = call.in(args[3], 2),
                   *R = call.in(args[4], 2);
    double* const numbers[] = {&shape.p_detect, &shape.p_gate, &shape.limit, &shape.log_density};
    for (int i = 0; i < 4; ++i) *numbers[i] = PyFloat_AsDouble(args[5 + i]);
    if (PyErr_Occurred()) PyErr_Clear(), call.refuse();
    if (!call.ok) return refer(kPdaUpdate, args, count);
    const npy_intp r = xs[0], n = xs[1], k = z[0], m = z[1];
    if (r < 1 || r > kMostModes || n < 1 || n > kMostStates || m < 1 || m > kMostMeasured || k > kMostReturns || Ps[0] != r ||
        !square(Ps + 1, n) || H[0] != m || H[1] != n || !square(R, m) || !call.broadcast())
        return refer(kPdaUpdate, args, count);
    shape.n = static_cast<int>(n), shape.m = static_cast<int>(m), shape.k = static_cast<int>(k), shape.r = static_cast<int>(r);
    PyObject *to = call.out(2, r, n), *cov = call.out(3, r, n, n), *loglik = call.out(1, r);
    if (to && cov && loglik) call.run(table->pda_update, shape);
    return pack(to, cov, loglik);
}

PyObject* imm_mix(PyObject*, Args args, Py_ssize_t count) {
    Call call;
    if (count != 4) return refer(kImmMix, args, count);
    const npy_intp *prob = call.in(args[0], 1), *transition = call.in(args[1], 2), *xs = call.in(args[2], 2),
                   *Ps = call.in(args[3], 3);
    if (!call.ok) return refer(kImmMix, args, count);
    const npy_intp r = prob[0], n = xs[1];
    if (r < 1 || r > kMostModes || n < 1 || n > kMostStates || !square(transition, r) || xs[0] != r || Ps[0] != r ||
        !square(Ps + 1, n) || !call.broadcast())
        return refer(kImmMix, args, count);
    PyObject *after = call.out(1, r), *means = call.out(2, r, n), *covs = call.out(3, r, n, n);
    if (after && means && covs) call.run(table->imm_mix, {static_cast<int>(n), static_cast<int>(r)});
    return pack(after, means, covs);
}

PyObject* imm_combine(PyObject*, Args args, Py_ssize_t count) {
    Call call;
    if (count != 4) return refer(kImmCombine, args, count);
    const npy_intp *prob = call.in(args[0], 1), *seen = call.in(args[1], 1), *xs = call.in(args[2], 2),
                   *Ps = call.in(args[3], 3);
    if (!call.ok) return refer(kImmCombine, args, count);
    const npy_intp r = prob[0], n = xs[1];
    if (r < 1 || r > kMostModes || n < 1 || n > kMostStates || seen[0] != r || xs[0] != r || Ps[0] != r ||
        !square(Ps + 1, n) || !call.broadcast())
        return refer(kImmCombine, args, count);
    PyObject *after = call.out(1, r), *mean = call.out(1, n), *cov = call.out(2, n, n), *loglik = call.out(0);
    if (after && mean && cov && loglik) call.run(table->imm_combine, {static_cast<int>(n), static_cast<int>(r)});
    return pack(after, mean, cov, loglik);
}

// The arrays of a sequence, one a mode.
bool take_modes(Call& call, PyObject* given, Py_ssize_t r, int core, const npy_intp** sizes) {
    const bool is_tuple = PyTuple_CheckExact(given);
    if (!is_tuple && !PyList_CheckExact(given)) return false;
    if ((is_tuple ? PyTuple_GET_SIZE(given) : PyList_GET_SIZE(given)) != r) return false;
    for (Py_ssize_t j = 0; j < r; ++j) {
        sizes[j] = call.in(is_tuple ? PyTuple_GET_ITEM(given, j) : PyList_GET_ITEM(given, j), core);
        if (!call.ok) return false;
    }
    return true;
}

// The means, covariances and axes of a bank: arguments xs, Ps, own, absent, periods.
bool take_bank(Call& call, Args args, npy_intp r, shapes::Interact& shape) {
    const npy_intp *means[kMostModes], *covs[kMostModes];
    if (r < 1 || r > kMostModes || !take_modes(call, args[0], r, 1, means) || !take_modes(call, args[1], r, 2, covs) ||
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
            if (axis < 0 || axis >= n) return PyErr_Clear(), false;
            shape.own[j][a] = static_cast<int>(axis);
            shape.same = shape.same && axis == a;
        }
    }
    return true;
}

PyObject* interact(PyObject*, Args args, Py_ssize_t count) {
    Call call;
    shapes::Interact shape;
    if (count != 7) return refer(kInteract, args, count);
    const npy_intp *prob = call.in(args[0], 1), *transition = call.in(args[1], 2);
    if (!call.ok || !square(transition, prob[0]) || !take_bank(call, args + 2, prob[0], shape) || !call.broadcast())
        return refer(kInteract, args, count);
    const int r = shape.r;
    PyObject *after = call.out(1, r), *means = PyTuple_New(r), *covs = PyTuple_New(r);
    bool good = after != nullptr && means != nullptr && covs != nullptr;
    for (int j = 0; good && j < r; ++j) {
        PyObject* mean = call.out(1, shape.sizes[j]);
        good = mean != nullptr;
        if (good) PyTuple_SET_ITEM(means, j, mean);
    }
    for (int j = 0; good && j < r; ++j) {
        PyObject* cov = call.out(2, shape.sizes[j], shape.sizes[j]);
        good = cov != nullptr;
        if (good) PyTuple_SET_ITEM(covs, j, cov);
    }
    if (!good) {
        Py_XDECREF(after), Py_XDECREF(means), Py_XDECREF(covs);
        return nullptr;
    }
    call.run(table->interact, shape);
    return pack(after, means, covs);
}

PyObject* together(PyObject*, Args args, Py_ssize_t count) {
    Call call;
    shapes::Together shape;
    if (count != 6) return refer(kTogether, args, count);
    const npy_intp* prob = call.in(args[0], 1);
    if (!call.ok || !take_bank(call, args + 1, prob[0], shape.bank) || !call.broadcast()) return refer(kTogether, args, count);
    PyObject *mean = call.out(1, shape.bank.n), *cov = call.out(2, shape.bank.n, shape.bank.n);
    if (mean != nullptr && cov != nullptr) call.run(table->together, shape);
    return pack(mean, cov);
}

PyObject* weigh_modes(PyObject*, Args args, Py_ssize_t count) {
    Call call;
    if (count != 2) return refer(kWeighModes, args, count);
    const npy_intp *prob = call.in(args[0], 1), *sizes[4][kMostModes];
    const npy_intp r = call.ok ? prob[0] : 0;
    if (r < 1 || r > kMostModes || !PyList_CheckExact(args[1]) || PyList_GET_SIZE(args[1]) != r)
        return refer(kWeighModes, args, count);
    constexpr int core[4] = {1, 1, 0, 1};  // loglik, distance, log volume, squared distance expected
    for (int what = 0; what < 4; ++what)
        for (npy_intp j = 0; j < r; ++j) {
            PyObject* said = PyList_GET_ITEM(args[1], j);
            if (!PyTuple_CheckExact(said) || PyTuple_GET_SIZE(said) != 4) return refer(kWeighModes, args, count);
            sizes[what][j] = call.in(PyTuple_GET_ITEM(said, what), core[what]);
            if (!call.ok) return refer(kWeighModes, args, count);
        }
    const npy_intp k = sizes[1][0][0];
    for (npy_intp j = 0; j < r; ++j)
        if (sizes[0][j][0] != 1 + k || sizes[1][j][0] != k || sizes[3][j][0] != k) return refer(kWeighModes, args, count);
    if (!call.broadcast()) return refer(kWeighModes, args, count);
    PyObject *loglik = call.out(1, 1 + k), *distance = call.out(1, k), *volume = call.out(0), *expected = call.out(1, k),
             *share = call.out(2, 1 + k, r);
    if (loglik && distance && volume && expected && share)
        call.run(table->weigh_modes, {static_cast<int>(k), static_cast<int>(r)});
    return pack(loglik, distance, volume, expected, share);
}

PyObject* split_weights(PyObject*, Args args, Py_ssize_t count) {
    Call call;
    if (count != 2) return refer(kSplitWeights, args, count);
    const npy_intp *weights = call.in(args[0], 1), *share = call.in(args[1], 2);
    if (!call.ok || weights[0] < 1 || share[0] != weights[0] || share[1] < 1 || share[1] > kMostModes || !call.broadcast())
        return refer(kSplitWeights, args, count);
    const npy_intp k = weights[0] - 1, r = share[1];
    PyObject *after = call.out(1, r), *own = PyTuple_New(r);
    bool good = after != nullptr && own != nullptr;
    for (npy_intp j = 0; good && j < r; ++j) {
        PyObject* part = call.out(1, 1 + k);
        good = part != nullptr;
        if (good) PyTuple_SET_ITEM(own, j, part);
    }
    if (!good) {
        Py_XDECREF(after), Py_XDECREF(own);
        return nullptr;
    }
    call.run(table->split_weights, {static_cast<int>(k), static_cast<int>(r)});
    return pack(after, own);
}

// Which returns count, as numbers, unless all do.
bool take_valid(Call& call, PyObject* valid, npy_intp k, bool& needed) {
    if (!PyArray_CheckExact(valid)) return false;
    auto* array = reinterpret_cast<PyArrayObject*>(valid);
    if (PyArray_TYPE(array) != NPY_BOOL || PyArray_NDIM(array) < 1 ||
        PyArray_DIM(array, PyArray_NDIM(array) - 1) != k)
        return false;
    needed = !PyArray_IS_C_CONTIGUOUS(array) ||
             std::memchr(PyArray_DATA(array), 0, static_cast<size_t>(PyArray_SIZE(array))) != nullptr;
    return !needed || call.in(valid, 1, true) != nullptr;
}

PyObject* gate_scores(PyObject*, Args args, Py_ssize_t count) {
    Call call;
    shapes::GateScores shape;
    if (count != 7 || !PyFloat_Check(args[4])) return refer(kGateScores, args, count);
    const npy_intp *loglik = call.in(args[0], 1), *distance = call.in(args[1], 1);
    call.in(args[3], 0);
    shape.limit = PyFloat_AS_DOUBLE(args[4]);
    const bool is_number = PyFloat_Check(args[5]) ||
                           (PyArray_CheckExact(args[5]) && PyArray_NDIM(reinterpret_cast<PyArrayObject*>(args[5])) == 0);
    const npy_intp* density = call.in(args[5], is_number ? 0 : 1);
    if (!call.ok) return refer(kGateScores, args, count);
    const npy_intp k = distance[0];
    shape.k = static_cast<int>(k);
    shape.per_return = !is_number && density[0] != 1;
    shape.evidence = args[6] != Py_None;
    if (loglik[0] != 1 + k || (shape.per_return && density[0] != k)) return refer(kGateScores, args, count);
    if (shape.evidence) {
        const npy_intp* evidence = call.in(args[6], 1);
        if (!call.ok || evidence[0] != k) return refer(kGateScores, args, count);
    }
    if (!take_valid(call, args[2], k, shape.valid) || !call.broadcast()) return refer(kGateScores, args, count);
    PyObject* scores = call.out(1, 1 + k);
    if (scores != nullptr) call.run(table->gate_scores, shape);
    return scores;
}

PyObject* sample_density(PyObject*, Args args, Py_ssize_t count) {
    Call call;
    shapes::SampleDensity shape;
    if (count != 5 || !PyFloat_Check(args[2]) || !PyFloat_Check(args[4])) return refer(kSampleDensity, args, count);
    const npy_intp* distance = call.in(args[0], 1);
    call.in(args[3], 0);
    shape.limit = PyFloat_AS_DOUBLE(args[2]), shape.log_ball = PyFloat_AS_DOUBLE(args[4]);
    if (!call.ok || !take_valid(call, args[1], distance[0], shape.valid) || !call.broadcast())
        return refer(kSampleDensity, args, count);
    shape.k = static_cast<int>(distance[0]);
    PyObject* density = call.out(1, 1);
    if (density != nullptr) call.run(table->sample_density, shape);
    return density;
}

PyObject* choose(Name name, Args args, Py_ssize_t count) {
    Call call;
    if (count != 1) return refer(name, args, count);
    const npy_intp* scores = call.in(args[0], 1);
    if (!call.ok || scores[0] < 1 || !call.broadcast()) return refer(name, args, count);
    PyObject* weights = call.out(1, scores[0]);
    if (weights != nullptr) call.run(table->choose, {static_cast<int>(scores[0] - 1), name == kOneHot});
    return weights;
}

PyObject* softmax(PyObject*, Args args, Py_ssize_t count) { return choose(kSoftmax, args, count); }
PyObject* one_hot(PyObject*, Args args, Py_ssize_t count) { return choose(kOneHot, args, count); }

PyObject* existence(PyObject*, Args args, Py_ssize_t count) {
    Call call;
    shapes::Existence shape;
    if (count != 6 || !PyBool_Check(args[5])) return refer(kExistence, args, count);
    const npy_intp *scores = call.in(args[0], 2), *weights = call.in(args[1], 2), *prior = call.in(args[2], 1),
                   *loglik = call.in(args[3], 2);
    shape.p_gate = PyFloat_AsDouble(args[4]);
    shape.exclusive = args[5] == Py_True;
    if (PyErr_Occurred()) PyErr_Clear(), call.refuse();
    if (!call.ok) return refer(kExistence, args, count);
    const npy_intp t = scores[0], columns = scores[1];
    if (columns < 1 || weights[0] != t || weights[1] != columns || prior[0] != t || loglik[0] != t || loglik[1] != columns ||
        !call.broadcast())
        return refer(kExistence, args, count);
    shape.t = static_cast<int>(t), shape.k = static_cast<int>(columns - 1);
    PyObject *hit = call.out(1, t), *exists = call.out(1, t), *detected = call.out(1, t), *room = call.out(1, columns - 1);
    if (hit && exists && detected && room) call.run(table->existence, shape);
    Py_XDECREF(room);
    return room == nullptr ? (Py_XDECREF(hit), Py_XDECREF(exists), Py_XDECREF(detected), nullptr) : pack(hit, exists, detected);
}

PyObject* is_plain(PyObject*, Args args, Py_ssize_t count) {
    if (count != 4 || !PyArray_CheckExact(args[0]) || !PyArray_CheckExact(args[1]) || !PyFloat_Check(args[3]))
        return refer(kIsPlain, args, count);
    auto *z = reinterpret_cast<PyArrayObject*>(args[0]), *valid = reinterpret_cast<PyArrayObject*>(args[1]);
    const int dims = PyArray_NDIM(valid);
    const long axes = PyLong_AsLong(args[2]);
    if (PyErr_Occurred() || dims < 1 || PyArray_TYPE(z) != NPY_DOUBLE || PyArray_TYPE(valid) != NPY_BOOL ||
        !PyArray_ISCARRAY_RO(z) || !PyArray_ISCARRAY_RO(valid)) {
        PyErr_Clear();
        return refer(kIsPlain, args, count);
    }
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

// bind(name, function): where the calls go that the kernel of that name does not take.
PyObject* bind(PyObject*, Args args, Py_ssize_t count) {
    const char* name = count == 2 ? PyUnicode_AsUTF8(args[0]) : nullptr;
    for (int i = 0; name != nullptr && i < kNames; ++i)
        if (std::strcmp(name, kText[i]) == 0) {
            Py_INCREF(args[1]);
            Py_XSETREF(reference[i], args[1]);
            Py_RETURN_NONE;
        }
    return PyErr_Occurred() ? nullptr : PyErr_Format(PyExc_KeyError, "bind takes the name of a kernel and a function");
}

bool can(const char* name) {
#ifdef VEDETTE_X86
    if (std::strcmp(name, "avx512") == 0)
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
               __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw");
    if (std::strcmp(name, "avx2") == 0) return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#endif
    return std::strcmp(name, "baseline") == 0;
}

// Takes the named instruction set; ValueError if this processor or this build has it not. For tests.
PyObject* use(PyObject*, PyObject* given) {
    const char* name = PyUnicode_AsUTF8(given);
    if (name == nullptr) return nullptr;
    if (!can(name)) return PyErr_Format(PyExc_ValueError, "this processor or build has no kernels for %R", given);
    if (std::strcmp(name, "baseline") == 0) table = &baseline::table, chosen = "baseline";
#ifdef VEDETTE_X86
    if (std::strcmp(name, "avx2") == 0) table = &avx2::table, chosen = "avx2";
    if (std::strcmp(name, "avx512") == 0) table = &avx512::table, chosen = "avx512";
#endif
    Py_RETURN_NONE;
}

PyObject* instruction_set(PyObject*, PyObject*) { return PyUnicode_FromString(chosen); }

PyObject* instruction_sets(PyObject*, PyObject*) {
    PyObject* all = PyList_New(0);
    for (const char* name : {"baseline", "avx2", "avx512"}) {
        if (all == nullptr || !can(name)) continue;
        PyObject* text = PyUnicode_FromString(name);
        if (text == nullptr || PyList_Append(all, text) < 0) Py_CLEAR(all);
        Py_XDECREF(text);
    }
    return all;
}

#define FAST(name) {#name, reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(name)), METH_FASTCALL, nullptr}
PyMethodDef methods[] = {
    FAST(predict), FAST(propagate), FAST(update), FAST(filter_step), FAST(innovate_returns), FAST(absorb),
    FAST(whiten), FAST(sigma_points), FAST(innovate_points), FAST(pda_update),
    FAST(imm_mix), FAST(imm_combine), FAST(interact),
    FAST(together), FAST(weigh_modes), FAST(split_weights), FAST(gate_scores), FAST(sample_density), FAST(softmax),
    FAST(one_hot), FAST(existence), FAST(is_plain), FAST(bind),
    {"use", use, METH_O, nullptr},
    {"instruction_set", instruction_set, METH_NOARGS, nullptr},
    {"instruction_sets", instruction_sets, METH_NOARGS, nullptr},
    {nullptr, nullptr, 0, nullptr},
};

PyModuleDef module = {PyModuleDef_HEAD_INIT, "_compiled", nullptr, -1, methods, nullptr, nullptr, nullptr, nullptr};

}  // namespace
}  // namespace vedette

PyMODINIT_FUNC PyInit__compiled() {
    import_array();
#ifdef VEDETTE_X86
    for (const char* name : {"avx2", "avx512"})
        if (vedette::can(name)) {
            PyObject* text = PyUnicode_FromString(name);
            PyObject* done = text == nullptr ? nullptr : vedette::use(nullptr, text);
            Py_XDECREF(text);
            if (done == nullptr) return nullptr;
            Py_DECREF(done);
        }
#endif
    return PyModule_Create(&vedette::module);
}
