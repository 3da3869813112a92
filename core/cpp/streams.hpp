// Random numbers of many generators at once, by numpy's own functions: the lock is released once, not once for each.
#pragma once

#include "entries.hpp"

#ifdef VEDETTE_NUMPY
#include <vector>

extern "C" {
#include <numpy/random/distributions.h>
}
#endif

namespace vedette::entries {

#ifdef VEDETTE_NUMPY

using Fill = void (*)(bitgen_t*, npy_intp, double*);

// numpy.random.Generator if numpy is the one whose functions were linked, as another may draw other numbers; else none.
inline PyObject* find_generator_type() {
    PyObject* numpy = PyImport_ImportModule("numpy");
    PyObject* version = numpy == nullptr ? nullptr : PyObject_GetAttrString(numpy, "__version__");
    const char* text = version == nullptr ? nullptr : PyUnicode_AsUTF8(version);
    PyObject* type = nullptr;
    if (text != nullptr && std::strcmp(text, VEDETTE_NUMPY) == 0) {
        PyObject* random = PyImport_ImportModule("numpy.random");
        type = random == nullptr ? nullptr : PyObject_GetAttrString(random, "Generator");
        Py_XDECREF(random);
    }
    Py_XDECREF(version), Py_XDECREF(numpy);
    return type;
}

inline bitgen_t* bits_of(PyObject* generator) {
    PyObject* bits = PyObject_GetAttrString(generator, "bit_generator");
    PyObject* capsule = bits == nullptr ? nullptr : PyObject_GetAttrString(bits, "capsule");
    void* found = capsule == nullptr ? nullptr : PyCapsule_GetPointer(capsule, "BitGenerator");
    Py_XDECREF(capsule), Py_XDECREF(bits);  // the generator keeps them
    return static_cast<bitgen_t*>(found);
}

// Arguments: a list of generators, and the shape of what each gives.
inline PyObject* draw(Call& call, Args args, Fill fill) {
    static PyObject* const type = find_generator_type();
    PyObject* generators = call.as_tuple(args[0]);
    if (type == nullptr || !call.ok || !PyTuple_CheckExact(args[1]) || PyTuple_GET_SIZE(args[1]) >= kMostDims) return nullptr;
    const Py_ssize_t runs = PyTuple_GET_SIZE(generators);
    npy_intp shape[kMostDims] = {runs}, each = 1;
    int dims = 1;
    for (; dims <= PyTuple_GET_SIZE(args[1]); ++dims) {
        shape[dims] = PyLong_AsSsize_t(PyTuple_GET_ITEM(args[1], dims - 1));
        if (shape[dims] < 0) return nullptr;
        each *= shape[dims];
    }
    std::vector<bitgen_t*> bits(static_cast<std::size_t>(runs));
    for (Py_ssize_t i = 0; i < runs; ++i) {
        PyObject* generator = PyTuple_GET_ITEM(generators, i);
        if (reinterpret_cast<PyObject*>(Py_TYPE(generator)) != type || (bits[i] = bits_of(generator)) == nullptr) return nullptr;
    }
    PyObject* numbers = new_array(dims, shape);
    if (numbers == nullptr) return nullptr;
    auto* at = static_cast<double*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(numbers)));
    Py_BEGIN_ALLOW_THREADS;
    for (Py_ssize_t i = 0; i < runs; ++i) fill(bits[i], each, at + i * each);
    Py_END_ALLOW_THREADS;
    return numbers;
}

inline PyObject* normals(Call& call, Args args) { return draw(call, args, random_standard_normal_fill); }
inline PyObject* uniforms(Call& call, Args args) { return draw(call, args, random_standard_uniform_fill); }

#else

inline PyObject* normals(Call&, Args) { return nullptr; }
inline PyObject* uniforms(Call&, Args) { return nullptr; }

#endif

}  // namespace vedette::entries
