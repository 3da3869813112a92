// Instances of classes with __slots__ and a constructor that only stores its arguments: their slots are filled one by one, without
// that constructor, which sets one field at a time through object.__setattr__.
#pragma once

#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <structmember.h>

#include <cstddef>

namespace vedette {

constexpr Py_ssize_t kMostFields = 32;

// Whether no cycle of references can lead through an object: the collector of garbage does not follow it, or it is a tuple of such.
inline bool is_leaf(PyObject* given) {
    if (given == nullptr || !PyObject_IS_GC(given)) return true;
    if (!PyObject_GC_IsTracked(given)) return !PyDict_Check(given);  // a dictionary is followed from its first such entry on
    if (!PyTuple_CheckExact(given)) return false;
    for (Py_ssize_t i = 0; i < PyTuple_GET_SIZE(given); ++i)
        if (!is_leaf(PyTuple_GET_ITEM(given, i))) return false;
    return true;
}

struct Slots {
    PyTypeObject* type = nullptr;
    Py_ssize_t count = 0, offsets[kMostFields];

    // Finds the slots of these names; TypeError if one is none.
    bool find(PyTypeObject* given, PyObject* names) {
        const Py_ssize_t size = PyTuple_GET_SIZE(names);
        if (size > kMostFields || given->tp_itemsize != 0) {
            PyErr_Format(PyExc_TypeError, "%s cannot be made field by field", given->tp_name);
            return false;
        }
        for (Py_ssize_t i = 0; i < size; ++i) {
            PyObject* member = PyObject_GetAttr(reinterpret_cast<PyObject*>(given), PyTuple_GET_ITEM(names, i));
            if (member == nullptr) return false;
            const bool is_slot = Py_IS_TYPE(member, &PyMemberDescr_Type) &&
                                 reinterpret_cast<PyMemberDescrObject*>(member)->d_member->type == T_OBJECT_EX;
            if (is_slot) offsets[i] = reinterpret_cast<PyMemberDescrObject*>(member)->d_member->offset;
            Py_DECREF(member);
            if (!is_slot) {
                PyErr_Format(PyExc_TypeError, "%s.%U is no slot", given->tp_name, PyTuple_GET_ITEM(names, i));
                return false;
            }
        }
        Py_INCREF(given);
        Py_XSETREF(type, given);
        count = size;
        return true;
    }

    PyObject* new_value() const { return type->tp_alloc(type, 0); }
    PyObject*& of(PyObject* value, Py_ssize_t i) const {
        return *reinterpret_cast<PyObject**>(reinterpret_cast<char*>(value) + offsets[i]);
    }

    // The value, whose slots are filled for good. One of leaves is no part of a cycle, so the collector need not walk through it:
    // else it would, again and again, through all states that a long run keeps.
    PyObject* finished(PyObject* value) const {
        bool leaves = PyObject_IS_GC(value);
        for (Py_ssize_t i = 0; leaves && i < count; ++i) leaves = is_leaf(of(value, i));
        if (leaves) PyObject_GC_UnTrack(value);
        return value;
    }
};

}  // namespace vedette
