// What lifecycles make of a scan, as their files say it in numpy: a few numbers a track, in one pass.
#pragma once

#define PY_SSIZE_T_CLEAN
#define NPY_NO_DEPRECATED_API NPY_2_0_API_VERSION
#include <Python.h>
#include <numpy/arrayobject.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace vedette {

// The arguments of a call, arrays of one shape and then numbers, and its results. What is not as it should be makes `good` false:
// None then says that numpy is to do it.
class Tracks {
  public:
    bool good;

    Tracks(PyObject* const* args, Py_ssize_t given, Py_ssize_t wanted) : good(given == wanted), args_(args) {}
    ~Tracks() {
        for (int i = 0; i < made_; ++i) Py_XDECREF(results_[i]);
    }

    const double* numbers() { return static_cast<const double*>(take(NPY_DOUBLE)); }
    const std::int64_t* counts() { return static_cast<const std::int64_t*>(take(NPY_INT64)); }
    const bool* flags() { return static_cast<const bool*>(take(NPY_BOOL)); }
    double number() {
        if (!good) return 0.0;
        const double value = PyFloat_AsDouble(args_[next_++]);
        if (PyErr_Occurred()) PyErr_Clear(), good = false;
        return value;
    }
    double* new_numbers() { return static_cast<double*>(make(NPY_DOUBLE)); }
    std::int64_t* new_counts() { return static_cast<std::int64_t*>(make(NPY_INT64)); }
    bool* new_flags() { return static_cast<bool*>(make(NPY_BOOL)); }

    npy_intp size() const { return first_ == nullptr ? 0 : PyArray_SIZE(first_); }

    // The results as a tuple, or None.
    PyObject* done() {
        if (!good) return PyErr_Occurred() ? nullptr : Py_NewRef(Py_None);
        PyObject* all = PyTuple_New(made_);
        if (all == nullptr) return nullptr;
        for (int i = 0; i < made_; ++i) PyTuple_SET_ITEM(all, i, results_[i]);
        made_ = 0;
        return all;
    }

  private:
    PyObject* const* args_;
    int next_ = 0, made_ = 0;
    PyArrayObject* first_ = nullptr;
    PyObject* results_[8];

    void* take(int type) {
        PyObject* given = good ? args_[next_++] : nullptr;
        auto* array = reinterpret_cast<PyArrayObject*>(given);
        good = good && PyArray_CheckExact(given) && PyArray_TYPE(array) == type && PyArray_ISCARRAY_RO(array) &&
               (first_ == nullptr || (PyArray_NDIM(array) == PyArray_NDIM(first_) &&
                                      PyArray_CompareLists(PyArray_DIMS(array), PyArray_DIMS(first_), PyArray_NDIM(array))));
        if (!good) return nullptr;
        if (first_ == nullptr) first_ = array;
        return PyArray_DATA(array);
    }
    void* make(int type) {
        if (!good) return nullptr;
        PyObject* array = PyArray_SimpleNew(PyArray_NDIM(first_), PyArray_DIMS(first_), type);
        results_[made_++] = array;
        good = array != nullptr;
        return good ? PyArray_DATA(reinterpret_cast<PyArrayObject*>(array)) : nullptr;
    }
};

// Seconds out of coverage and without detection, and which of the tracks alive are within the limits of both.
inline PyObject* limited(PyObject*, PyObject* const* args, Py_ssize_t count) {
    Tracks it(args, count, 9);
    const double *covered = it.numbers(), *detected = it.numbers(), *hit = it.numbers(), *p_detect = it.numbers();
    const bool* alive = it.flags();
    const double least = it.number(), dt = it.number(), most_covered = it.number(), most_detected = it.number();
    double *out = it.new_numbers(), *unseen = it.new_numbers();
    bool* on = it.new_flags();
    for (npy_intp i = 0; it.good && i < it.size(); ++i) {
        const bool seen = hit[i] > 0.5;
        out[i] = seen || p_detect[i] >= least ? 0.0 : covered[i] + dt;
        unseen[i] = seen ? 0.0 : detected[i] + dt;
        on[i] = alive[i] && out[i] <= most_covered && unseen[i] <= most_detected;
    }
    return it.done();
}

// Hits as bits, looks, confirmed, alive.
inline PyObject* m_of_n(PyObject*, PyObject* const* args, Py_ssize_t count) {
    Tracks it(args, count, 9);
    const std::int64_t *bits = it.counts(), *looks = it.counts();
    const bool* sure = it.flags();
    const double *hit = it.numbers(), *p_detect = it.numbers();
    const double worth = it.number();
    const auto m = static_cast<int>(it.number()), n = static_cast<int>(it.number()), misses = static_cast<int>(it.number());
    std::int64_t *hits = it.new_counts(), *looked = it.new_counts();
    bool *confirmed = it.new_flags(), *alive = it.new_flags();
    const auto last = [](int k) { return (std::int64_t{1} << k) - 1; };
    for (npy_intp i = 0; it.good && i < it.size(); ++i) {
        const bool detected = hit[i] > 0.5, look = detected || p_detect[i] >= worth;
        hits[i] = look ? (static_cast<std::int64_t>(static_cast<std::uint64_t>(bits[i]) << 1) | detected) & last(60) : bits[i];
        looked[i] = looks[i] + look;
        const int recent = __builtin_popcountll(static_cast<unsigned long long>(hits[i] & last(n)));
        confirmed[i] = sure[i] || recent >= m;
        alive[i] = confirmed[i] ? !((hits[i] & last(misses)) == 0 && looked[i] >= misses) : !(looked[i] - recent > n - m);
    }
    return it.done();
}

// Ever confirmed, confirmed now, alive.
inline PyObject* by_existence(PyObject*, PyObject* const* args, Py_ssize_t count) {
    Tracks it(args, count, 5);
    const bool* before = it.flags();
    const double *exists = it.numbers(), confirm = it.number(), show = it.number(), end = it.number();
    bool *ever = it.new_flags(), *now = it.new_flags(), *alive = it.new_flags();
    for (npy_intp i = 0; it.good && i < it.size(); ++i) {
        ever[i] = before[i] || exists[i] >= confirm;
        now[i] = ever[i] && exists[i] >= show;
        alive[i] = exists[i] >= end;
    }
    return it.done();
}

// The own score, how far it is below its best, confirmed, alive.
inline PyObject* by_score(PyObject*, PyObject* const* args, Py_ssize_t count) {
    Tracks it(args, count, 11);
    const double *first = it.numbers(), *before = it.numbers(), *below = it.numbers();
    const bool* sure = it.flags();
    const double *exists = it.numbers(), *own = it.numbers(), *p_detect = it.numbers();
    const double most = it.number(), confirm = it.number(), end = it.number(), drop = it.number();
    double *last = it.new_numbers(), *fell = it.new_numbers();
    bool *confirmed = it.new_flags(), *alive = it.new_flags();
    for (npy_intp i = 0; it.good && i < it.size(); ++i) {
        const auto over = [&](double existence) {
            const double doubted = std::min(std::max(existence, 1.0 - most), most);
            return std::log(doubted) - std::log1p(-doubted) - first[i];
        };
        const double score = over(exists[i]), alone = own == exists ? score : over(own[i]);
        last[i] = alone;
        fell[i] = std::max(below[i] + std::min(before[i] - alone, -std::log1p(-std::min(p_detect[i], most))), 0.0);
        confirmed[i] = sure[i] || score >= confirm;
        alive[i] = confirmed[i] ? fell[i] < drop : std::min(score, alone) > end;
    }
    return it.done();
}

}  // namespace vedette
