// What a kernel returns that is more than one array: a value or a named tuple, of the type that Python has bound for it.
#pragma once

#include "slots.hpp"

namespace vedette {

class Result {
  public:
    // Takes the type of results: a subclass of tuple, or a class with slots; TypeError if it is neither.
    bool take(PyObject* given) {
        if (!PyType_Check(given)) return PyErr_Format(PyExc_TypeError, "%R is no type", given), false;
        auto* type = reinterpret_cast<PyTypeObject*>(given);
        if (PyType_IsSubtype(type, &PyTuple_Type)) {
            Py_INCREF(given);
            Py_XSETREF(tuple_, type);
            return true;
        }
        PyObject* names = PyObject_GetAttrString(given, "__match_args__");
        const bool good = names != nullptr && PyTuple_CheckExact(names) && slots_.find(type, names);
        Py_XDECREF(names);
        return good || (PyErr_Occurred() == nullptr && PyErr_Format(PyExc_TypeError, "%R has no fields", given) != nullptr);
    }

    // The result of these parts, whose references it takes; null if any is.
    template <class... Parts>
    PyObject* make(Parts... parts) const {
        PyObject* all[] = {parts...};
        constexpr Py_ssize_t count = sizeof...(parts);
        bool good = true;
        for (PyObject* part : all) good = good && part != nullptr;
        const bool slotted = slots_.count == count;
        PyObject* result = !good              ? nullptr
                           : slotted          ? slots_.new_value()
                           : tuple_ != nullptr ? tuple_->tp_alloc(tuple_, count)
                                               : PyTuple_New(count);
        if (result == nullptr) {
            for (PyObject* part : all) Py_XDECREF(part);
            return nullptr;
        }
        for (Py_ssize_t i = 0; i < count; ++i)
            if (slotted)
                slots_.of(result, i) = all[i];
            else
                PyTuple_SET_ITEM(result, i, all[i]);
        return slotted ? slots_.finished(result) : result;
    }

  private:
    PyTypeObject* tuple_ = nullptr;
    Slots slots_;
};

constexpr int kMostResults = 2;  // a result, and one within it

inline const Result kPlain[kMostResults] = {};  // plain tuples, for calls within a call

}  // namespace vedette
