// Joint association of pairs of a track and a return within its gate, as associators/of_pairs.py says it in numpy.
#pragma once

#define PY_SSIZE_T_CLEAN
#define NPY_NO_DEPRECATED_API NPY_2_0_API_VERSION
#include <Python.h>
#include <numpy/arrayobject.h>

#include <algorithm>
#include <climits>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <vector>

#include "joint.hpp"

namespace vedette {

// The arguments of a call: tracks (p,), in their order, returns (p,), scores (p,), misses (t,), and the number of returns.
struct GivenPairs {
    Meetings met;
    int k = 0;
    bool good = false;

    explicit GivenPairs(PyObject* const* args) {
        const auto* tracks = array<std::int64_t>(args[0], NPY_INT64, size_);
        const auto* returns = array<std::int64_t>(args[1], NPY_INT64, size_);
        const auto* scores = array<double>(args[2], NPY_DOUBLE, size_);
        npy_intp t = -1;
        const auto* misses = array<double>(args[3], NPY_DOUBLE, t);
        const Py_ssize_t count = PyNumber_AsSsize_t(args[4], PyExc_OverflowError);
        if (PyErr_Occurred() != nullptr) PyErr_Clear();
        if (!tracks || !returns || !scores || !misses || count < 0 || count > INT_MAX || size_ > INT_MAX || t > INT_MAX) return;
        k = static_cast<int>(count);
        npy_intp e = 0;
        for (npy_intp i = 0; i < t; ++i) {
            for (; e < size_ && tracks[e] == i; ++e) {
                if (returns[e] < 0 || returns[e] >= count || !(scores[e] > -std::numeric_limits<double>::infinity())) return;
                met.returns.push_back(static_cast<int>(returns[e])), met.scores.push_back(scores[e]);
            }
            met.close(misses[i]);
        }
        good = e == size_;
    }

    npy_intp size() const { return size_; }

  private:
    npy_intp size_ = -1;

    // The numbers of an array (size,), or null; a size below 0 is not known yet.
    template <class Number>
    static const Number* array(PyObject* given, int type, npy_intp& size) {
        auto* it = reinterpret_cast<PyArrayObject*>(given);
        if (!PyArray_CheckExact(given) || PyArray_TYPE(it) != type || PyArray_NDIM(it) != 1 || !PyArray_ISCARRAY_RO(it)) return nullptr;
        if (size >= 0 && PyArray_DIM(it, 0) != size) return nullptr;
        size = PyArray_DIM(it, 0);
        return static_cast<const Number*>(PyArray_DATA(it));
    }
};

// Messages between the tracks and returns of each cluster.
class Propagation {
  public:
    Propagation(const Meetings& met, int returns)
        : met_(met), t_(met.tracks()), p_(met.returns.size()), ends_(returns + 1, 0), by_return_(p_), track_(p_), ratio_(p_),
          to_track_(p_), to_return_(p_) {
        for (int j : met.returns) ++ends_[j + 1];
        for (int j = 0; j < returns; ++j) ends_[j + 1] += ends_[j];
        std::vector<int> next(ends_.begin(), ends_.end() - 1);
        for (int i = 0; i < t_; ++i)
            for (int e = met.starts[i]; e < met.starts[i + 1]; ++e) track_[e] = i, by_return_[next[met.returns[e]]++] = e;
    }

    void run(double tolerance, double sweeps, double messages, double* weights, double* misses) {
        for (int i = 0; i < t_; ++i) {
            double best = met_.miss[i];
            for (int e = met_.starts[i]; e < met_.starts[i + 1]; ++e) best = std::max(best, met_.scores[e]);
            const double miss = std::max(met_.miss[i], best - 3000.0);
            for (int e = met_.starts[i]; e < met_.starts[i + 1]; ++e) ratio_[e] = std::exp(std::min(met_.scores[e] - miss, 700.0));
        }
        std::vector<char> seen_track(t_, 0), seen_return(ends_.size(), 0);
        for (int first = 0; first < t_; ++first) {
            if (seen_track[first]) continue;
            tracks_.assign(1, first), returns_.clear(), seen_track[first] = 1;
            double size = 0.0;
            for (std::size_t a = 0; a < tracks_.size(); ++a)
                for (int e = met_.starts[tracks_[a]]; e < met_.starts[tracks_[a] + 1]; ++e, ++size) {
                    const int j = met_.returns[e];
                    if (seen_return[j]) continue;
                    seen_return[j] = 1, returns_.push_back(j);
                    for (int f = ends_[j]; f < ends_[j + 1]; ++f) {
                        const int i = track_[by_return_[f]];
                        if (!seen_track[i]) seen_track[i] = 1, tracks_.push_back(i);
                    }
                }
            settle(tolerance, std::min(sweeps, std::max(1.0, std::floor(messages / std::max(size, 1.0)))));
            share(weights, misses);
        }
    }

  private:
    const Meetings& met_;
    int t_;
    std::size_t p_;
    std::vector<int> ends_, by_return_, track_, tracks_, returns_;
    std::vector<double> ratio_, to_track_, to_return_, after_;

    // Calls each(pair, sum of the values of the owner's other pairs), `count` pairs at(0), at(1), ...; without the own term, as
    // total - own would lose small terms to rounding.
    template <class At, class Value, class Each>
    void others(int count, At at, Value value, Each each) {
        after_.resize(static_cast<std::size_t>(count) + 1);
        after_[count] = 0.0;
        for (int i = count - 1; i >= 0; --i) after_[i] = after_[i + 1] + value(at(i));
        double before = 0.0;
        for (int i = 0; i < count; ++i) {
            const int e = at(i);
            const double own = value(e);
            each(e, before + after_[i + 1]);
            before += own;
        }
    }

    template <class Value>
    double answer(Value value) {
        double change = 0.0;
        for (int j : returns_) {
            const int* own = by_return_.data() + ends_[j];
            others(
                ends_[j + 1] - ends_[j], [&](int i) { return own[i]; }, value,
                [&](int e, double sum) {
                    const double now = 1.0 / (1.0 + sum);
                    change = std::max(change, std::abs(now / to_track_[e] - 1.0));
                    to_track_[e] = now;
                });
        }
        return change;
    }

    void settle(double tolerance, double sweeps) {
        for (int i : tracks_) std::fill(to_track_.begin() + met_.starts[i], to_track_.begin() + met_.starts[i + 1], 1.0);
        // From the scarcer side: all returns free to take, or all tracks.
        if (tracks_.size() > returns_.size()) answer([&](int e) { return ratio_[e]; });
        for (double sweep = 0.0; sweep < sweeps; ++sweep) {
            for (int i : tracks_)
                others(
                    met_.starts[i + 1] - met_.starts[i], [&](int n) { return met_.starts[i] + n; },
                    [&](int e) { return ratio_[e] * to_track_[e]; },
                    [&](int e, double sum) { to_return_[e] = ratio_[e] / (1.0 + sum); });
            if (answer([&](int e) { return to_return_[e]; }) <= tolerance) break;
        }
    }

    // A return that is still claimed more than once is shared out.
    void share(double* weights, double* misses) {
        for (int i : tracks_) {
            double total = 1.0;
            for (int e = met_.starts[i]; e < met_.starts[i + 1]; ++e) total += weights[e] = ratio_[e] * to_track_[e];
            misses[i] = 1.0 / total;
            for (int e = met_.starts[i]; e < met_.starts[i + 1]; ++e) weights[e] *= misses[i];
        }
        for (int j : returns_) {
            double claimed = 0.0;
            for (int f = ends_[j]; f < ends_[j + 1]; ++f) claimed += weights[by_return_[f]];
            if (claimed <= 1.0) continue;
            for (int f = ends_[j]; f < ends_[j + 1]; ++f) {
                const int e = by_return_[f];
                misses[track_[e]] += weights[e] - weights[e] / claimed;
                weights[e] /= claimed;
            }
        }
    }
};

// Weights of pairs and of misses, made by `work`; None where the arguments are not as they should be.
template <class Work>
PyObject* weights_of(const GivenPairs& given, PyObject* more, Work work) {
    npy_intp p = given.size(), t = given.met.tracks();
    PyObject *weights = PyArray_SimpleNew(1, &p, NPY_DOUBLE), *misses = PyArray_SimpleNew(1, &t, NPY_DOUBLE);
    bool enough = weights != nullptr && misses != nullptr;
    if (enough) {
        auto* to = static_cast<double*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(weights)));
        auto* missed = static_cast<double*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(misses)));
        Py_BEGIN_ALLOW_THREADS;
        try {
            work(to, missed);
        } catch (const std::bad_alloc&) {
            enough = false;
        }
        Py_END_ALLOW_THREADS;
        if (!enough) PyErr_NoMemory();
    }
    PyObject* all = !enough ? nullptr : more == nullptr ? PyTuple_Pack(2, weights, misses) : PyTuple_Pack(3, weights, misses, more);
    Py_XDECREF(weights), Py_XDECREF(misses), Py_XDECREF(more);
    return all;
}

// Arguments: as `GivenPairs`, and how many tracks or returns may be open at once. Weights, misses, the tracks that are too wide.
inline PyObject* summed(PyObject*, PyObject* const* args, Py_ssize_t count) try {
    if (count != 6) return Py_NewRef(Py_None);
    const GivenPairs given(args);
    const Py_ssize_t most = PyNumber_AsSsize_t(args[5], PyExc_OverflowError);
    if (PyErr_Occurred() != nullptr) return nullptr;
    if (!given.good || most > kMostOpen) return Py_NewRef(Py_None);
    npy_intp t = given.met.tracks();
    PyObject* wide = PyArray_SimpleNew(1, &t, NPY_BOOL);
    if (wide == nullptr) return nullptr;
    auto* flags = static_cast<bool*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(wide)));
    return weights_of(given, wide, [&](double* weights, double* misses) {
        Joint(given.k, static_cast<int>(most)).run(given.met, weights, misses, flags);
    });
} catch (const std::bad_alloc&) {
    return PyErr_NoMemory();
}

// Arguments: as `GivenPairs`, the tolerance, the most sweeps, and the most messages of a cluster. Weights, misses.
inline PyObject* propagated(PyObject*, PyObject* const* args, Py_ssize_t count) try {
    if (count != 8) return Py_NewRef(Py_None);
    const GivenPairs given(args);
    const double tolerance = PyFloat_AsDouble(args[5]), sweeps = PyFloat_AsDouble(args[6]), messages = PyFloat_AsDouble(args[7]);
    if (PyErr_Occurred() != nullptr) return nullptr;
    if (!given.good) return Py_NewRef(Py_None);
    return weights_of(given, nullptr, [&](double* weights, double* misses) {
        Propagation(given.met, given.k).run(tolerance, sweeps, messages, weights, misses);
    });
} catch (const std::bad_alloc&) {
    return PyErr_NoMemory();
}

}  // namespace vedette
