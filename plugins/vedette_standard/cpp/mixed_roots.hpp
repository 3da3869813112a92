// The root of a mixture's covariance, as estimators/square_root.py has it in numpy.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "inverses.hpp"
#include "triangular.hpp"

namespace vedette {

// Arguments: roots L (*b, n, n), of each return the shift (*b, k, n) and the root (*b, 1|k, n, n), weights (*b, 1 + k). The mean's
// shift (*b, n), and a root (*b, n, n).
inline PyObject* mixed_roots(PyObject*, PyObject* const* args, Py_ssize_t count) {
    PyArrayObject* given[4];
    for (int i = 0; i < 4; ++i)
        if (count != 4 || (given[i] = dense_numbers(args[i])) == nullptr) Py_RETURN_NONE;
    const int b = PyArray_NDIM(given[3]) - 1, dims[] = {b + 2, b + 2, b + 3, b + 1};
    npy_intp problems = 1, shape[NPY_MAXDIMS];
    bool good = b >= 0 && b + 2 <= NPY_MAXDIMS;
    for (int i = 0; i < 4; ++i) good = good && PyArray_NDIM(given[i]) == dims[i];
    for (int d = 0; good && d < b; ++d) {
        problems *= shape[d] = PyArray_DIM(given[3], d);
        for (int i = 0; i < 3; ++i) good = good && PyArray_DIM(given[i], d) == shape[d];
    }
    if (!good) Py_RETURN_NONE;
    const npy_intp n = shape[b] = shape[b + 1] = PyArray_DIM(given[0], b), k = PyArray_DIM(given[1], b), s = PyArray_DIM(given[2], b);
    if (n < 1 || n > kMostStates || PyArray_DIM(given[0], b + 1) != n || PyArray_DIM(given[1], b + 1) != n || (s != 1 && s != k) ||
        PyArray_DIM(given[2], b + 1) != n || PyArray_DIM(given[2], b + 2) != n || PyArray_DIM(given[3], b) != 1 + k)
        Py_RETURN_NONE;
    PyObject *mean = PyArray_SimpleNew(b + 1, shape, NPY_DOUBLE), *root = PyArray_SimpleNew(b + 2, shape, NPY_DOUBLE);
    if (mean != nullptr && root != nullptr) {
        const double* in[4];
        for (int i = 0; i < 4; ++i) in[i] = static_cast<const double*>(PyArray_DATA(given[i]));
        auto* to = static_cast<double*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(mean)));
        auto* triangle = static_cast<double*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(root)));
        const npy_intp lines = n + s * n + k + 1;
        std::vector<double> rows(static_cast<std::size_t>(lines * n));
        for (npy_intp i = 0; i < problems; ++i, to += n, triangle += n * n) {
            const double *L = in[0] + i * n * n, *shift = in[1] + i * k * n, *post = in[2] + i * s * n * n, *w = in[3] + i * (1 + k);
            const double missed = std::sqrt(w[0]);
            double hit = 0.0, *row = rows.data();
            std::fill_n(to, n, 0.0);
            for (npy_intp h = 0; h < k; ++h, hit += w[h])
                for (npy_intp a = 0; a < n; ++a) to[a] += w[1 + h] * shift[h * n + a];
            const auto put = [&](double share, const double* of) {
                for (npy_intp c = 0; c < n; ++c, row += n)
                    for (npy_intp a = 0; a < n; ++a) row[a] = share * of[a * n + c];
            };
            put(missed, L);
            for (npy_intp h = 0; h < s; ++h) put(std::sqrt(s == 1 ? hit : w[1 + h]), post + h * n * n);
            for (npy_intp h = 0; h < k; ++h, row += n)
                for (npy_intp a = 0; a < n; ++a) row[a] = std::sqrt(w[1 + h]) * (shift[h * n + a] - to[a]);
            for (npy_intp a = 0; a < n; ++a) row[a] = missed * to[a];
            triangularise(rows.data(), static_cast<int>(lines), static_cast<int>(n), static_cast<int>(n));
            transpose_into(rows.data(), static_cast<int>(n), 0, static_cast<int>(n), triangle);
        }
    }
    PyObject* both = mean != nullptr && root != nullptr ? PyTuple_Pack(2, mean, root) : nullptr;
    Py_XDECREF(mean), Py_XDECREF(root);
    return both;
}

}  // namespace vedette
