// From Python's arrays to a batch of problems: what numpy's broadcasting does, without its iterator's cost.
#pragma once

#include <utility>

#include "arrays.hpp"
#include "kernels.hpp"
#include "results.hpp"

namespace vedette {

using Args = PyObject* const*;

// While it lives, numbers below the smallest normal one are 0: covariances between axes that have nothing to do with one another
// decay to such, and arithmetic on them is up to twenty times slower.
class WithoutSubnormals {
#ifdef __SSE2__
  public:
    WithoutSubnormals() { __builtin_ia32_ldmxcsr(before_ | kToZero); }
    ~WithoutSubnormals() { __builtin_ia32_ldmxcsr(before_); }
    WithoutSubnormals(const WithoutSubnormals&) = delete;

  private:
    static constexpr unsigned kToZero = 0x8040;  // of results, and of operands
    unsigned before_ = __builtin_ia32_stmxcsr();
#endif
};

// The arguments of one call. Anything that is not as a kernel wants it makes `ok` false: the reference then takes the call.
class Call {
  public:
    Batch batch;
    bool ok = true;

    explicit Call(const Result* results) : results_(results) {}
    ~Call() {
        for (int i = 0; i < owned_; ++i) Py_DECREF(keep_[i]);
    }

    // Takes an array whose last `core` axes are the problem's own; `apart` has an axis of 1 before them for the tracks.
    // Gives the sizes of the core axes.
    const npy_intp* in(PyObject* given, int core, bool over_tracks = false) {
        if (!ok) return nullptr;
        const int i = batch.ins;
        if (i == kMostOperands) return refuse();
        if (!PyArray_CheckExact(given) && PyFloat_Check(given)) {
            if (core > 0) return refuse();
            numbers_[i] = PyFloat_AS_DOUBLE(given);
            batch.in[i] = &numbers_[i];
            dims_[i] = 0;
            ++batch.ins;
            return &numbers_size_;
        }
        PyArrayObject* array = as_doubles(given, core);
        if (array == nullptr) return nullptr;
        if (!take_axes(array, core, over_tracks)) return refuse();
        batch.in[i] = static_cast<const double*>(PyArray_DATA(array));
        const int all = PyArray_NDIM(array) - core;
        for (int d = 0; d < all; ++d)
            batch.in_steps[i][d] = PyArray_STRIDE(array, d) / static_cast<npy_intp>(sizeof(double));
        if (over_tracks) batch.in_steps[i][all] = 0;
        return PyArray_DIMS(array) + all;
    }

    // The batch's axes from those of all inputs.
    bool broadcast() { return ok && (whole_ == 0 || broadcast_axes()); }

    // A new array of the batch's axes and the problem's own.
    PyObject* out(int core, npy_intp a = 1, npy_intp b = 1, npy_intp c = 1) {
        npy_intp shape[kMostDims + 3];
        for (int d = 0; d < whole_; ++d) shape[d] = full_[d];
        shape[whole_] = a, shape[whole_ + 1] = b, shape[whole_ + 2] = c;
        PyObject* array = new_array(whole_ + core, shape);
        if (array == nullptr) return nullptr;
        const int o = batch.outs++;
        batch.out[o] = static_cast<double*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(array)));
        batch.out_size[o] = (core > 0 ? a : 1) * (core > 1 ? b : 1) * (core > 2 ? c : 1);
        return array;
    }

    // The kernel's result of these parts, or the one within it.
    template <class... Parts>
    PyObject* pack(Parts... parts) const {
        return results_[0].make(parts...);
    }
    template <class... Parts>
    PyObject* pack_within(Parts... parts) const {
        return results_[1].make(parts...);
    }

    template <class Shape>
    void run(void (*kernel)(const Batch&, const Shape&), const Shape& shape) const {
        if (size_ == 0) return;
        const WithoutSubnormals guard;
        if (size_ < 64) {
            kernel(batch, shape);
            return;
        }
        Py_BEGIN_ALLOW_THREADS;
        kernel(batch, shape);
        Py_END_ALLOW_THREADS;
    }

    const npy_intp* refuse() {
        ok = false;
        return nullptr;
    }

    double number(PyObject* given) {
        const double value = PyFloat_AsDouble(given);
        if (value == -1.0 && PyErr_Occurred()) refuse();
        return value;
    }

    // Axes that the batch has, without numbers that a kernel would read.
    const npy_intp* shape_of(PyArrayObject* array, int core, bool over_tracks = false) {
        const int i = batch.ins;
        if (!take_axes(array, core, over_tracks)) return refuse();
        batch.in[i] = &numbers_[i];
        for (int d = 0; d < dims_[i]; ++d) batch.in_steps[i][d] = 0;
        return PyArray_DIMS(array) + PyArray_NDIM(array) - core;
    }

    // A list or tuple as one whose items stay, whatever becomes of it meanwhile.
    PyObject* as_tuple(PyObject* given) {
        if (!ok || PyTuple_CheckExact(given)) return given;
        PyObject* tuple = PyList_CheckExact(given) ? PyList_AsTuple(given) : nullptr;
        if (tuple == nullptr) return refuse(), nullptr;
        return keep_[owned_++] = tuple;
    }

    // An array whose parts the kernels can read in place, or a copy that they can.
    PyArrayObject* as_doubles(PyObject* given, int core) {
        if (PyArray_CheckExact(given)) {
            auto* array = reinterpret_cast<PyArrayObject*>(given);
            if (PyArray_TYPE(array) == NPY_DOUBLE && PyArray_ISBEHAVED_RO(array) && is_dense(array, core)) return array;
        }
        PyObject* copy = PyArray_FROM_OTF(given, NPY_DOUBLE, NPY_ARRAY_CARRAY_RO);
        if (copy == nullptr) return refuse(), nullptr;
        return reinterpret_cast<PyArrayObject*>(keep_[owned_++] = copy);
    }

  private:
    const Result* results_;
    PyObject* keep_[kMostOperands + 4];  // copies of operands, lists held, and an array of two rows
    int owned_ = 0, whole_ = 0;
    npy_intp full_[kMostDims], size_ = 1, numbers_size_ = 0;
    int dims_[kMostOperands];
    npy_intp shape_[kMostOperands][kMostDims];
    double numbers_[kMostOperands];

    // The batch's axes of one more operand.
    bool take_axes(PyArrayObject* array, int core, bool over_tracks) {
        const int i = batch.ins, all = PyArray_NDIM(array) - core, extra = over_tracks ? 1 : 0;
        if (i == kMostOperands || all < 0 || all + extra > kMostDims) return false;
        dims_[i] = all + extra;
        if (dims_[i] > whole_) whole_ = dims_[i];
        for (int d = 0; d < all; ++d) shape_[i][d] = PyArray_DIM(array, d);
        if (over_tracks) shape_[i][all] = 1;
        ++batch.ins;
        return true;
    }

    __attribute__((noinline)) bool broadcast_axes() {
        for (int d = 0; d < whole_; ++d) {
            npy_intp size = 1;
            for (int i = 0; i < batch.ins; ++i) {
                const int own = d - (whole_ - dims_[i]);
                if (own < 0 || shape_[i][own] == 1) continue;
                if (size != 1 && size != shape_[i][own]) return refuse(), false;
                size = shape_[i][own];
            }
            full_[d] = size;
        }
        size_ = 1;
        for (int d = 0; d < whole_; ++d) size_ *= full_[d];
        if (size_ != 1) merge_axes();
        return true;
    }

    // Whether the last `core` axes lie one after another.
    static bool is_dense(PyArrayObject* array, int core) {
        npy_intp step = sizeof(double);
        for (int d = PyArray_NDIM(array) - 1, left = core; d >= 0 && left > 0; --d, --left) {
            if (PyArray_DIM(array, d) != 1 && PyArray_STRIDE(array, d) != step) return false;
            step *= PyArray_DIM(array, d);
        }
        return true;
    }

    // The fewest axes to walk: those of size 1 go, and neighbours that every input steps through evenly become one.
    // The longest comes last, as eight problems side by side are taken along it.
    void merge_axes() {
        int used = 0;
        std::ptrdiff_t steps[kMostOperands][kMostDims];
        for (int d = 0; d < whole_; ++d) {
            if (full_[d] == 1) continue;
            bool even = used > 0;
            for (int i = 0; i < batch.ins; ++i) {
                const int own = d - (whole_ - dims_[i]);
                const std::ptrdiff_t step = own < 0 || shape_[i][own] == 1 ? 0 : batch.in_steps[i][own];
                steps[i][used] = step;
                even = even && steps[i][used - 1] == step * full_[d];
            }
            if (even) {
                for (int i = 0; i < batch.ins; ++i) steps[i][used - 1] = steps[i][used];
                batch.shape[used - 1] *= full_[d];
            } else {
                batch.shape[used++] = full_[d];
            }
        }
        batch.dims = used;
        int longest = used - 1;
        std::ptrdiff_t place = 1;
        for (int d = used - 1; d >= 0; --d) {
            if (batch.shape[d] > batch.shape[longest]) longest = d;
            batch.places[d] = place;
            place *= batch.shape[d];
        }
        for (int i = 0; i < batch.ins; ++i)
            for (int d = 0; d < used; ++d) batch.in_steps[i][d] = steps[i][d];
        if (longest == used - 1) return;
        std::swap(batch.shape[longest], batch.shape[used - 1]);
        std::swap(batch.places[longest], batch.places[used - 1]);
        for (int i = 0; i < batch.ins; ++i) std::swap(batch.in_steps[i][longest], batch.in_steps[i][used - 1]);
    }
};

inline bool read_periods(PyObject* given, Periods& periods) {
    if (!PyTuple_CheckExact(given)) return false;
    periods.count = 0;
    const Py_ssize_t count = PyTuple_GET_SIZE(given);
    if (count > kMostStates) return false;
    for (Py_ssize_t i = 0; i < count; ++i) {
        PyObject* one = PyTuple_GET_ITEM(given, i);
        if (!PyTuple_CheckExact(one) || PyTuple_GET_SIZE(one) != 2) return false;
        const long axis = PyLong_AsLong(PyTuple_GET_ITEM(one, 0));
        const double period = PyFloat_AsDouble(PyTuple_GET_ITEM(one, 1));
        if (PyErr_Occurred() || axis < 0 || axis >= kMostStates) return false;
        periods.each[periods.count++] = {static_cast<int>(axis), period};
    }
    return true;
}

// Whether all of them are among `count` axes.
inline bool are_among(const Periods& periods, npy_intp count) {
    for (int i = 0; i < periods.count; ++i)
        if (periods.each[i].axis >= count) return false;
    return true;
}

}  // namespace vedette
