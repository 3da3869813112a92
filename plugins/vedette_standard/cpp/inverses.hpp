// What returns say of where targets are, as the sensors' files say it in numpy: a few numbers a return, in one pass.
#pragma once

#define PY_SSIZE_T_CLEAN
#define NPY_NO_DEPRECATED_API NPY_2_0_API_VERSION
#include <Python.h>
#include <numpy/arrayobject.h>

#include <cmath>

namespace vedette {

inline PyArrayObject* dense_numbers(PyObject* given) {
    auto* array = reinterpret_cast<PyArrayObject*>(given);
    const bool good = PyArray_CheckExact(given) && PyArray_TYPE(array) == NPY_DOUBLE && PyArray_ISCARRAY_RO(array);
    return good ? array : nullptr;
}

// Arguments: ranges and bearings (k, 2), their noise (k, 2, 2), x, y and heading of the sensor. Positions (k, 2), covariances.
inline PyObject* from_polar(PyObject*, PyObject* const* args, Py_ssize_t count) {
    PyArrayObject *z = count == 5 ? dense_numbers(args[0]) : nullptr, *R = count == 5 ? dense_numbers(args[1]) : nullptr;
    if (z == nullptr || R == nullptr || PyArray_NDIM(z) != 2 || PyArray_NDIM(R) != 3 || PyArray_DIM(z, 1) != 2 ||
        PyArray_DIM(R, 0) != PyArray_DIM(z, 0) || PyArray_DIM(R, 1) != 2 || PyArray_DIM(R, 2) != 2)
        Py_RETURN_NONE;
    double place[3];
    for (int i = 0; i < 3; ++i) {
        auto* of_runs = reinterpret_cast<PyArrayObject*>(args[2 + i]);
        if (PyArray_Check(args[2 + i]) && PyArray_NDIM(of_runs) > 0) Py_RETURN_NONE;
        place[i] = PyFloat_AsDouble(args[2 + i]);
        if (PyErr_Occurred()) {
            PyErr_Clear();
            Py_RETURN_NONE;
        }
    }
    PyObject *mean = PyArray_SimpleNew(2, PyArray_DIMS(z), NPY_DOUBLE), *cov = PyArray_SimpleNew(3, PyArray_DIMS(R), NPY_DOUBLE);
    if (mean != nullptr && cov != nullptr) {
        const auto *polar = static_cast<const double*>(PyArray_DATA(z)), *noise = static_cast<const double*>(PyArray_DATA(R));
        auto* x = static_cast<double*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(mean)));
        auto* P = static_cast<double*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(cov)));
        for (npy_intp i = 0; i < PyArray_DIM(z, 0); ++i, polar += 2, noise += 4, x += 2, P += 4) {
            const double r = polar[0], angle = polar[1] + place[2], s = noise[3], c = std::cos(angle), d = std::sin(angle);
            const double half = std::sinh(s / 2), longer = r * std::exp(s / 2), across = (r * r + noise[0]) * std::sinh(s);
            const double along = noise[0] * std::cosh(s) + r * r * 2 * half * half, mixed = r * noise[1];
            x[0] = place[0] + longer * c, x[1] = place[1] + longer * d;
            P[0] = along * c * c + across * d * d - 2 * mixed * d * c;
            P[3] = along * d * d + across * c * c + 2 * mixed * d * c;
            P[1] = P[2] = (along - across) * d * c + mixed * (c * c - d * d);
        }
    }
    PyObject* both = mean != nullptr && cov != nullptr ? PyTuple_Pack(2, mean, cov) : nullptr;
    Py_XDECREF(mean), Py_XDECREF(cov);
    return both;
}

}  // namespace vedette
