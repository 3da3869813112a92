// New small arrays, without the cost of new ones: an array that nobody but the shelf still holds is handed out again.
#pragma once

#define PY_SSIZE_T_CLEAN
#define NPY_NO_DEPRECATED_API NPY_2_0_API_VERSION
#include <Python.h>
#include <numpy/arrayobject.h>

#include <cstddef>
#include <cstdint>

namespace vedette {

constexpr int kMostPooledDims = 4;
constexpr npy_intp kMostPooled = 128;  // numbers: beyond, an array's own cost is small beside its contents'

// Arrays of one shape. A slot's array is free while its one reference is the shelf's: then no name, view or buffer of it
// exists, and it may have no weak one. What Python can change in place (shape, type, flags, memory) is looked at again.
class Shelf {
  public:
    bool is_for(int dims, const npy_intp* shape) const {
        if (dims != dims_) return false;
        for (int d = 0; d < dims; ++d)
            if (shape[d] != shape_[d]) return false;
        return true;
    }

    void become(int dims, const npy_intp* shape) {
        dims_ = dims;
        for (int d = 0; d < dims; ++d) shape_[d] = shape[d];
        for (PyArrayObject*& slot : slots_) Py_CLEAR(slot);
    }

    // The first that is free, as it was used last and still lies in the cache; a new one takes the place of one in use.
    PyObject* take() {
        for (PyArrayObject* array : slots_)
            if (array != nullptr && is_free(array)) {
                Py_INCREF(array);
                return reinterpret_cast<PyObject*>(array);
            }
        PyObject* array = PyArray_SimpleNew(dims_, shape_, NPY_DOUBLE);
        if (array == nullptr) return nullptr;
        next_ = (next_ + 1) % kSlots;
        Py_INCREF(array);
        Py_XSETREF(slots_[next_], reinterpret_cast<PyArrayObject*>(array));
        return array;
    }

  private:
    static constexpr int kSlots = 8;
    static constexpr int kFlags =
        NPY_ARRAY_C_CONTIGUOUS | NPY_ARRAY_OWNDATA | NPY_ARRAY_ALIGNED | NPY_ARRAY_WRITEABLE;
    int dims_ = -1;
    unsigned next_ = 0;
    npy_intp shape_[kMostPooledDims] = {};
    PyArrayObject* slots_[kSlots] = {};

    bool is_free(PyArrayObject* array) const {
        if (Py_REFCNT(array) != 1) return false;
        const char* weak = reinterpret_cast<const char*>(array) + Py_TYPE(array)->tp_weaklistoffset;
        return *reinterpret_cast<PyObject* const*>(weak) == nullptr && PyArray_CHKFLAGS(array, kFlags) &&
               PyArray_TYPE(array) == NPY_DOUBLE && PyArray_ISNOTSWAPPED(array) && PyArray_BASE(array) == nullptr &&
               is_for(PyArray_NDIM(array), PyArray_DIMS(array));
    }
};

// An uninitialised array of doubles. The interpreter's lock guards the shelves.
inline PyObject* new_array(int dims, npy_intp* shape) {
    static Shelf shelves[256];
    npy_intp size = 1;
    std::uint32_t hash = static_cast<std::uint32_t>(dims);
    for (int d = 0; d < dims; ++d) {
        size *= shape[d];
        hash = hash * 31 + static_cast<std::uint32_t>(shape[d]);
    }
    if (dims > kMostPooledDims || size > kMostPooled) return PyArray_SimpleNew(dims, shape, NPY_DOUBLE);
    Shelf& shelf = shelves[(hash ^ (hash >> 8)) % 256];
    if (!shelf.is_for(dims, shape)) shelf.become(dims, shape);
    return shelf.take();
}

}  // namespace vedette
