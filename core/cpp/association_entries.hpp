// How the kernels of gates, associations and clusters are called.
#pragma once

#include <climits>
#include <cstring>
#include <limits>
#include <new>
#include <optional>

#include "boxes.hpp"
#include "entries.hpp"
#include "joint.hpp"

namespace vedette::entries {

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
    shape.sure = args[7] != Py_None;
    if (shape.sure) call.in(args[7], 0);
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

}  // namespace vedette::entries
