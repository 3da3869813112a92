// Hypotheses of clusters, as Python gives and takes them: they grow by a scan, leaves end, tracks exist. As `clusters.py`.
#pragma once

#include <algorithm>
#include <cmath>

#include "factors.hpp"
#include "growth.hpp"

namespace vedette {

namespace entries {

inline const npy_bool* truths(PyObject* given, npy_intp& count) {
    if (!PyArray_CheckExact(given)) return nullptr;
    auto* array = reinterpret_cast<PyArrayObject*>(given);
    if (PyArray_TYPE(array) != NPY_BOOL || PyArray_NDIM(array) != 1 || !PyArray_IS_C_CONTIGUOUS(array)) return nullptr;
    count = PyArray_DIM(array, 0);
    return static_cast<const npy_bool*>(PyArray_DATA(array));
}

// Whether numbers ascend from `low` at least to `high` at most.
inline bool ascend(const Integers& numbers, npy_int64 low, npy_int64 high) {
    npy_int64 before = low;
    for (npy_intp i = 0; i < numbers.size(0); ++i) {
        if (numbers.data()[i] < before || numbers.data()[i] > high) return false;
        before = numbers.data()[i];
    }
    return true;
}

inline bool within(const Integers& numbers, npy_int64 high) {
    for (npy_intp i = 0; i < numbers.size(0); ++i)
        if (numbers.data()[i] < 0 || numbers.data()[i] >= high) return false;
    return true;
}

inline bool are_flat(const Integers& cluster, PyArrayObject* weights, const Integers& starts, const Integers& leaves, npy_intp l) {
    const npy_intp h = cluster.size(0);
    return PyArray_NDIM(weights) == 1 && PyArray_DIM(weights, 0) == h && starts.size(0) == h + 1 &&
           ascend(cluster, 0, NPY_MAX_INT32) && starts.data()[0] == 0 && ascend(starts, 0, leaves.size(0)) &&
           starts.data()[h] == leaves.size(0) && within(leaves, l);
}

// Numbers the codes, all below `most`, in their order; returns those that there are.
inline std::vector<npy_int64> numbered(std::vector<npy_int64>& codes, npy_int64 most) {
    std::vector<npy_int64> there;
    if (most <= 16 * static_cast<npy_int64>(codes.size()) + 4096) {
        std::vector<npy_int64> number(static_cast<std::size_t>(most), -1);
        for (npy_int64 code : codes) number[code] = 0;
        for (npy_int64 code = 0; code < most; ++code)
            if (number[code] == 0) number[code] = static_cast<npy_int64>(there.size()), there.push_back(code);
        for (npy_int64& code : codes) code = number[code];
        return there;
    }
    there = codes;
    std::sort(there.begin(), there.end());
    there.erase(std::unique(there.begin(), there.end()), there.end());
    for (npy_int64& code : codes) code = std::lower_bound(there.begin(), there.end(), code) - there.begin();
    return there;
}

inline PyObject* flattened(const Call& call, Flat& flat, npy_int64 most, bool with_lost) {
    const std::vector<npy_int64> codes = numbered(flat.held.leaves, most);
    npy_intp l = static_cast<npy_intp>(codes.size());
    npy_intp h = static_cast<npy_intp>(flat.held.size()), edges = h + 1, m = static_cast<npy_intp>(flat.held.leaves.size());
    npy_intp c = static_cast<npy_intp>(flat.lost.size());
    PyObject *cluster = copied(flat.cluster, NPY_INT64, 1, &h), *weights = copied(flat.held.weights, NPY_DOUBLE, 1, &h),
             *starts = copied(flat.held.starts, NPY_INT64, 1, &edges), *leaves = copied(flat.held.leaves, NPY_INT64, 1, &m),
             *rows = copied(codes, NPY_INT64, 1, &l);
    if (with_lost) return call.pack(cluster, weights, starts, leaves, rows, copied(flat.lost, NPY_DOUBLE, 1, &c));
    return call.pack(cluster, weights, starts, leaves, rows);
}

// Arguments: cluster (h,), weights (h,), starts (h+1,), leaves (m,), miss (l,), ends (l,), returns (p,), scores (p,), begins (k,),
// most, least.
inline PyObject* grow(Call& call, Args args) {
    const Integers cluster(args[0], 1), starts(args[2], 1), leaves(args[3], 1), ends(args[5], 1), returns(args[6], 1);
    PyArrayObject *weights = call.as_doubles(args[1], 1), *miss = call.as_doubles(args[4], 1), *scores = call.as_doubles(args[7], 1);
    npy_intp k = 0;
    const npy_bool* begins = truths(args[8], k);
    if (!call.ok || begins == nullptr || !cluster.good() || !starts.good() || !leaves.good() || !ends.good() || !returns.good())
        return nullptr;
    const long long most = PyLong_AsLongLong(args[9]);
    const double least = call.number(args[10]);
    if (!call.ok || PyErr_Occurred() || most < 1 || PyArray_NDIM(miss) != 1 || PyArray_NDIM(scores) != 1) return nullptr;
    const npy_intp l = PyArray_DIM(miss, 0), p = returns.size(0);
    if (!are_flat(cluster, weights, starts, leaves, l) || ends.size(0) != l || PyArray_DIM(scores, 0) != p || !ascend(ends, 0, p) ||
        (l > 0 ? ends.data()[l - 1] : 0) != p || !within(returns, k))
        return nullptr;
    const auto* score = static_cast<const double*>(PyArray_DATA(scores));
    const auto* missed = static_cast<const double*>(PyArray_DATA(miss));
    for (npy_intp i = 0; i < p; ++i)
        if (!std::isfinite(score[i])) return nullptr;
    for (npy_intp i = 0; i < l; ++i)
        if (!(missed[i] < std::numeric_limits<double>::infinity())) return nullptr;
    Flat flat;
    bool enough = true;
    Py_BEGIN_ALLOW_THREADS;
    try {
        Growth growth(ends.data(), returns.data(), score, missed, l, begins, k, most, least);
        growth.run(cluster.data(), static_cast<const double*>(PyArray_DATA(weights)), starts.data(), leaves.data(), cluster.size(0));
        flat = std::move(growth.out);
    } catch (const std::bad_alloc&) {
        enough = false;
    }
    Py_END_ALLOW_THREADS;
    return enough ? flattened(call, flat, l * (1 + k) + 1 + k, true) : PyErr_NoMemory();
}

// Arguments: cluster (h,), weights (h,), starts (h+1,), leaves (m,), track (l,), alive (l,), tolerance.
inline PyObject* shed(Call& call, Args args) {
    const Integers cluster(args[0], 1), starts(args[2], 1), leaves(args[3], 1), track(args[4], 1);
    PyArrayObject* weights = call.as_doubles(args[1], 1);
    npy_intp l = 0;
    const npy_bool* alive = truths(args[5], l);
    const double tolerance = call.number(args[6]);
    if (!call.ok || alive == nullptr || !cluster.good() || !starts.good() || !leaves.good() || !track.good() ||
        track.size(0) != l || !are_flat(cluster, weights, starts, leaves, l))
        return nullptr;
    const auto* weight = static_cast<const double*>(PyArray_DATA(weights));
    const npy_intp h = cluster.size(0);
    Flat flat;
    bool enough = true;
    Py_BEGIN_ALLOW_THREADS;
    try {
        Held held;
        std::vector<int> number(static_cast<std::size_t>(l), -1);
        for (npy_intp i = 0; i < h; ++i) {
            for (npy_int64 at = starts.data()[i]; at < starts.data()[i + 1]; ++at)
                if (alive[leaves.data()[at]]) held.leaves.push_back(leaves.data()[at]);
            held.close(weight[i]);
            if (i + 1 < h && cluster.data()[i + 1] == cluster.data()[i]) continue;
            if (!held.leaves.empty()) {
                if (held.size() > 1) drop_repetitions(held);
                Factors(held, track.data(), tolerance, number).split(flat);
            }
            held.clear();
        }
    } catch (const std::bad_alloc&) {
        enough = false;
    }
    Py_END_ALLOW_THREADS;
    return enough ? flattened(call, flat, l, false) : PyErr_NoMemory();
}

// Arguments: weights (h,), starts (h+1,), leaves (m,), track (l,), own (l,), names (l,).
inline PyObject* target_existence(Call& call, Args args) {
    const Integers starts(args[1], 1), leaves(args[2], 1), track(args[3], 1), names(args[5], 1);
    PyArrayObject *weights = call.as_doubles(args[0], 1), *own = call.as_doubles(args[4], 1);
    if (!call.ok || !starts.good() || !leaves.good() || !track.good() || !names.good() || PyArray_NDIM(weights) != 1 ||
        PyArray_NDIM(own) != 1)
        return nullptr;
    npy_intp l = track.size(0);
    const npy_intp h = PyArray_DIM(weights, 0), m = leaves.size(0);
    if (PyArray_DIM(own, 0) != l || names.size(0) != l || starts.size(0) != h + 1 || starts.data()[0] != 0 ||
        !ascend(starts, 0, m) || starts.data()[h] != m || !within(leaves, l) || !within(track, l))
        return nullptr;
    const auto* weight = static_cast<const double*>(PyArray_DATA(weights));
    const auto* exists = static_cast<const double*>(PyArray_DATA(own));
    try {
        const std::size_t size = static_cast<std::size_t>(l);
        std::vector<std::pair<npy_int64, npy_int64>> by_name(size), wanted;
        for (npy_intp i = 0; i < l; ++i) by_name[i] = {names.data()[i], i};
        std::sort(by_name.begin(), by_name.end());
        std::vector<npy_int64> number(size), seen(size, -1);
        npy_int64 count = 0;
        for (std::size_t i = 0; i < size; ++i) {
            count += i > 0 && by_name[i].first != by_name[i - 1].first;
            number[by_name[i].second] = count;
        }
        std::vector<double> of_track(size, 0.0), of_name(size, 0.0), mass(static_cast<std::size_t>(m));
        for (npy_intp i = 0; i < h; ++i)
            for (npy_int64 at = starts.data()[i]; at < starts.data()[i + 1]; ++at) {
                const npy_int64 leaf = leaves.data()[at];
                of_track[track.data()[leaf]] += mass[at] = weight[i] * exists[leaf];
                of_name[number[leaf]] += mass[at];
            }
        // Only where it is doubtful which track is the target's, hypotheses without the track are asked.
        for (npy_intp i = 0; i < l; ++i)
            if (of_track[track.data()[i]] < 1.0 - 1e-12 && of_name[number[i]] > 0.0) wanted.emplace_back(number[i], track.data()[i]);
        std::sort(wanted.begin(), wanted.end());
        wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
        std::vector<std::size_t> begin(size + 2, 0);
        for (const auto& pair : wanted) ++begin[pair.first + 1];
        for (std::size_t i = 0; i <= size; ++i) begin[i + 1] += begin[i];
        std::vector<double> others(wanted.size(), 0.0);
        for (npy_intp i = 0; i < h; ++i) {
            for (npy_int64 at = starts.data()[i]; at < starts.data()[i + 1]; ++at) seen[track.data()[leaves.data()[at]]] = i;
            for (npy_int64 at = starts.data()[i]; at < starts.data()[i + 1]; ++at) {
                const npy_int64 name = number[leaves.data()[at]];
                for (std::size_t one = begin[name]; one < begin[name + 1]; ++one)
                    if (seen[wanted[one].second] != i) others[one] += mass[at];
            }
        }
        PyObject* found = PyArray_SimpleNew(1, &l, NPY_DOUBLE);
        if (found == nullptr) return nullptr;
        auto* to = static_cast<double*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(found)));
        for (npy_intp i = 0; i < l; ++i) {
            const std::pair<npy_int64, npy_int64> pair{number[i], track.data()[i]};
            const auto at = std::lower_bound(wanted.begin(), wanted.end(), pair);
            const double more = at != wanted.end() && *at == pair ? others[at - wanted.begin()] : 0.0;
            to[i] = std::min(of_track[pair.second] + more, 1.0);
        }
        return found;
    } catch (const std::bad_alloc&) {
        return PyErr_NoMemory();
    }
}

}  // namespace entries
}  // namespace vedette
