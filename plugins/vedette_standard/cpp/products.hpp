// Independent motions over disjoint axes, as motion/product.py has them: their twin, around those of the motions, and their matrices.
#pragma once

#include <algorithm>

#include "capsules.hpp"
#include "inverses.hpp"

namespace vedette {

struct Product {
    std::vector<Inner<MotionTwin>> parts;  // without a function: F and Q of the step, among the parameters
    std::vector<int> axes, parameters;
    int states = 0;

    void move(int count, double dt, const double* x, const double* p, double* moved, double* slope, double* noise) const {
        Room room(2 * states * states * count);
        std::fill_n(slope, states * states * count, 0.0), std::fill_n(noise, states * states * count, 0.0);
        for (std::size_t part = 0, first = 0; part < parts.size(); ++part) {
            const int n = axes[part], size = n * n * count;
            double *F = room.at(), *Q = F + size;
            if (parts[part].call != nullptr)
                parts[part].call(count, dt, x, p, moved, F, Q, parts[part].data);
            else
                by_matrices(count, n, x, p, moved), std::copy_n(p, size, F), std::copy_n(p + size, size, Q);
            for (int i = 0; i < n; ++i, F += n * count, Q += n * count) {
                const std::size_t row = ((first + i) * states + first) * count;
                std::copy_n(F, n * count, slope + row), std::copy_n(Q, n * count, noise + row);
            }
            first += n, x += n * count, moved += n * count, p += parameters[part] * count;
        }
    }

  private:
    static void by_matrices(int count, int n, const double* x, const double* F, double* moved) {
        for (int i = 0; i < n; ++i)
            for (int l = 0; l < count; ++l) {
                double sum = 0.0;
                for (int j = 0; j < n; ++j) sum += F[(i * n + j) * count + l] * x[j * count + l];
                moved[i * count + l] = sum;
            }
    }
};

inline void move_product(int count, double dt, const double* x, const double* parameters, double* moved, double* slope,
                         double* noise, void* data) {
    static_cast<const Product*>(data)->move(count, dt, x, parameters, moved, slope, noise);
}

// product(functions of the parts' twins, None of a linear one, their numbers of axes, of parameters): the function around them.
inline PyObject* product(PyObject*, PyObject* const* args, Py_ssize_t count) {
    if (count != 3) return PyErr_Format(PyExc_TypeError, "product takes 3 arguments, got %zd", count);
    auto data = std::make_unique<Product>();
    const auto inner = [](PyObject* given) {
        Inner<MotionTwin> part;
        if (given != Py_None) part.read(given, kMotion);
        return part;
    };
    if (!read_each(args[0], data->parts, inner) || !read_each(args[1], data->axes, PyLong_AsLong) ||
        !read_each(args[2], data->parameters, PyLong_AsLong))
        return nullptr;
    if (data->axes.size() != data->parts.size() || data->parameters.size() != data->parts.size())
        return PyErr_Format(PyExc_ValueError, "product takes as many of each as there are parts");
    for (int n : data->axes) data->states += n;
    return capsule_around(std::move(data), move_product, kMotion);
}

// Square blocks (p, p): the matrix (n, n) with them along its diagonal. None for batches of them.
inline PyObject* block_diagonal(PyObject*, PyObject* const* args, Py_ssize_t count) {
    npy_intp shape[2] = {0, 0};
    for (Py_ssize_t i = 0; i < count; ++i) {
        PyArrayObject* block = dense_numbers(args[i]);
        if (block == nullptr || PyArray_NDIM(block) != 2 || PyArray_DIM(block, 0) != PyArray_DIM(block, 1)) Py_RETURN_NONE;
        shape[0] = shape[1] += PyArray_DIM(block, 0);
    }
    PyObject* whole = PyArray_ZEROS(2, shape, NPY_DOUBLE, 0);
    if (whole == nullptr) return nullptr;
    auto* to = static_cast<double*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(whole)));
    for (Py_ssize_t i = 0; i < count; ++i) {
        PyArrayObject* block = dense_numbers(args[i]);
        const npy_intp p = PyArray_DIM(block, 0);
        const auto* from = static_cast<const double*>(PyArray_DATA(block));
        for (npy_intp row = 0; row < p; ++row, from += p, to += shape[0]) std::copy_n(from, p, to);
        to += p;
    }
    return whole;
}

}  // namespace vedette
