// Joint associations of many hypotheses: for each, the best ways for its leaves to share out a scan's returns.
#pragma once

#include <limits>
#include <new>

#include "arguments.hpp"
#include "ranking.hpp"

namespace vedette::entries {

constexpr double kFarthest = 3000.0;  // as `FARTHEST` of the reference

// What a hypothesis' tracks take, one row an association, and their scores.
struct Joint {
    std::vector<npy_int64> origin, choice;
    std::vector<double> total;
};

// Finds the best associations of each row of `leaves` (h, t) by `scores` (l, 1+k); false if memory does not suffice.
inline bool associate(const double* scores, npy_intp columns, const std::vector<double>& missed, const std::vector<char>& contested,
                      const npy_int64* leaves, npy_intp h, npy_intp t, const npy_int64* wanted, Joint& joint) try {
    constexpr double kNone = std::numeric_limits<double>::infinity();
    const npy_intp k = columns - 1;
    std::vector<double> cost;
    std::vector<npy_intp> open;
    for (npy_intp row = 0; row < h; ++row, leaves += t) {
        double rest = 0.0;
        open.clear();
        for (npy_intp i = 0; i < t; ++i) {
            if (leaves[i] < 0) continue;
            if (contested[leaves[i]])
                open.push_back(i);
            else
                rest += missed[leaves[i]];
        }
        const auto n = static_cast<npy_intp>(open.size()), width = k + n;
        cost.assign(static_cast<std::size_t>(n * width), kNone);
        for (npy_intp i = 0; i < n; ++i) {
            const npy_int64 leaf = leaves[open[i]];
            for (npy_intp j = 0; j < k; ++j) cost[i * width + j] = -scores[leaf * columns + 1 + j];
            cost[i * width + k + i] = -missed[leaf];
        }
        Ranking ranking(cost.data(), static_cast<int>(n), static_cast<int>(width));
        ranking.find(wanted[row]);
        for (const auto& [sum, node] : ranking.found) {
            joint.origin.push_back(row);
            joint.total.push_back(rest - sum);
            const auto at = joint.choice.size();
            joint.choice.resize(at + static_cast<std::size_t>(t), 0);
            for (npy_intp i = 0; i < n; ++i) {
                const int column = ranking.columns(node)[i];
                joint.choice[at + static_cast<std::size_t>(open[i])] = column < k ? column + 1 : 0;
            }
        }
    }
    return true;
} catch (const std::bad_alloc&) {
    return false;
}

// Whole numbers of so many axes, in rows; null if they are not.
class Integers {
  public:
    Integers(PyObject* given, int dims) {
        if (PyArray_CheckExact(given) && PyArray_TYPE(reinterpret_cast<PyArrayObject*>(given)) == NPY_INT64)
            array_ = reinterpret_cast<PyArrayObject*>(PyArray_FROM_OTF(given, NPY_INT64, NPY_ARRAY_CARRAY_RO));
        if (array_ != nullptr && PyArray_NDIM(array_) != dims) Py_CLEAR(array_);
    }
    ~Integers() { Py_XDECREF(array_); }
    Integers(const Integers&) = delete;

    bool good() const { return array_ != nullptr; }
    npy_intp size(int axis) const { return PyArray_DIM(array_, axis); }
    const npy_int64* data() const { return static_cast<const npy_int64*>(PyArray_DATA(array_)); }

  private:
    PyArrayObject* array_ = nullptr;
};

template <class Number>
PyObject* copied(const std::vector<Number>& numbers, int type, int dims, npy_intp* shape) {
    PyObject* array = PyArray_SimpleNew(dims, shape, type);
    if (array != nullptr && !numbers.empty())
        std::memcpy(PyArray_DATA(reinterpret_cast<PyArrayObject*>(array)), numbers.data(), numbers.size() * sizeof(Number));
    return array;
}

// Arguments: scores (l, 1+k), leaves (h, t) and wanted (h,).
inline PyObject* best_joint(Call& call, Args args) {
    PyArrayObject* scores = call.as_doubles(args[0], 2);
    const Integers leaves(args[1], 2), wanted(args[2], 1);
    if (!call.ok || !leaves.good() || !wanted.good() || PyArray_NDIM(scores) != 2 || PyArray_DIM(scores, 1) < 1 ||
        wanted.size(0) != leaves.size(0))
        return nullptr;
    const npy_intp l = PyArray_DIM(scores, 0), columns = PyArray_DIM(scores, 1), h = leaves.size(0), t = leaves.size(1);
    const auto* number = static_cast<const double*>(PyArray_DATA(scores));
    const npy_int64 *leaf = leaves.data(), *most = wanted.data();
    for (npy_intp i = 0; i < h * t; ++i)
        if (leaf[i] < -1 || leaf[i] >= l) return nullptr;
    std::vector<double> missed(static_cast<std::size_t>(l));
    std::vector<char> contested(static_cast<std::size_t>(l));
    for (npy_intp i = 0; i < l; ++i) {
        const double* row = number + i * columns;
        double largest = row[0];
        for (npy_intp j = 1; j < columns; ++j) {
            if (!(row[j] < std::numeric_limits<double>::infinity())) return nullptr;
            if (row[j] > -std::numeric_limits<double>::infinity()) contested[i] = 1;
            largest = row[j] > largest ? row[j] : largest;
        }
        missed[i] = columns > 1 && row[0] < largest - kFarthest ? largest - kFarthest : row[0];
        if (contested[i] && !(std::fabs(missed[i]) < std::numeric_limits<double>::infinity())) return nullptr;
    }
    Joint joint;
    bool enough;
    Py_BEGIN_ALLOW_THREADS;
    enough = associate(number, columns, missed, contested, leaf, h, t, most, joint);
    Py_END_ALLOW_THREADS;
    if (!enough) return PyErr_NoMemory();
    npy_intp shape[2] = {static_cast<npy_intp>(joint.total.size()), t};
    return call.pack(copied(joint.origin, NPY_INT64, 1, shape), copied(joint.choice, NPY_INT64, 2, shape),
                copied(joint.total, NPY_DOUBLE, 1, shape));
}

}  // namespace vedette::entries
