// Makes instances of frozen values without calling their __init__.
//
//     maker = Maker(cls, names)         # cls has __slots__, and an __init__ that only stores its arguments
//     maker(a, b, c)                    # == cls(a, b, c), in a fifth of the time
//     evolver = Evolver(cls, names)
//     evolver(value, b=1)               # == attrs.evolve(value, b=1), in a tenth of the time

#include "slots.hpp"

namespace {

using vedette::Slots;

struct Made {
    PyObject_HEAD
    vectorcallfunc call;
    Slots slots;
    PyObject* names;  // a tuple of interned names
};

PyObject* make(PyObject* self, PyObject* const* args, size_t flagged, PyObject* keywords) {
    const Slots& slots = reinterpret_cast<Made*>(self)->slots;
    const Py_ssize_t given = PyVectorcall_NARGS(flagged);
    if (given != slots.count || (keywords != nullptr && PyTuple_GET_SIZE(keywords) > 0)) {
        PyErr_Format(PyExc_TypeError, "%s takes its %zd fields in order, got %zd", slots.type->tp_name, slots.count, given);
        return nullptr;
    }
    PyObject* value = slots.new_value();
    if (value == nullptr) return nullptr;
    for (Py_ssize_t i = 0; i < given; ++i) slots.of(value, i) = Py_NewRef(args[i]);
    return slots.finished(value);
}

// The place of a field, from `expected` on as callers name them in order; -1 if there is none.
Py_ssize_t find(PyObject* names, Py_ssize_t count, PyObject* name, Py_ssize_t expected) {
    for (Py_ssize_t i = 0; i < count; ++i) {
        const Py_ssize_t at = expected + i < count ? expected + i : expected + i - count;
        if (PyTuple_GET_ITEM(names, at) == name) return at;
    }
    for (Py_ssize_t i = 0; i < count; ++i)  // a name that is not interned
        if (PyUnicode_Compare(PyTuple_GET_ITEM(names, i), name) == 0) return i;
    return -1;
}

PyObject* evolve(PyObject* self, PyObject* const* args, size_t flagged, PyObject* keywords) {
    auto* made = reinterpret_cast<Made*>(self);
    const Slots& slots = made->slots;
    if (PyVectorcall_NARGS(flagged) != 1 || !Py_IS_TYPE(args[0], slots.type))
        return PyErr_Format(PyExc_TypeError, "a %s is changed, and fields by name", slots.type->tp_name);
    PyObject* value = slots.new_value();
    if (value == nullptr) return nullptr;
    const Py_ssize_t changes = keywords == nullptr ? 0 : PyTuple_GET_SIZE(keywords);
    for (Py_ssize_t i = 0, at = 0; i < changes; ++i, ++at) {
        PyObject* name = PyTuple_GET_ITEM(keywords, i);
        at = find(made->names, slots.count, name, at);
        if (at < 0) {
            Py_DECREF(value);
            return PyErr_Format(PyExc_TypeError, "%s has no field %R", slots.type->tp_name, name);
        }
        slots.of(value, at) = Py_NewRef(args[1 + i]);
    }
    for (Py_ssize_t i = 0; i < slots.count; ++i)
        if (slots.of(value, i) == nullptr) slots.of(value, i) = Py_XNewRef(slots.of(args[0], i));
    return slots.finished(value);
}

template <vectorcallfunc call>
int initialise(PyObject* self, PyObject* args, PyObject*) {
    auto* made = reinterpret_cast<Made*>(self);
    PyTypeObject* type;
    PyObject* names;
    if (!PyArg_ParseTuple(args, "O!O!", &PyType_Type, &type, &PyTuple_Type, &names) || !made->slots.find(type, names)) return -1;
    PyObject* interned = PyTuple_New(PyTuple_GET_SIZE(names));
    if (interned == nullptr) return -1;
    for (Py_ssize_t i = 0; i < PyTuple_GET_SIZE(names); ++i) {
        PyObject* name = Py_NewRef(PyTuple_GET_ITEM(names, i));
        PyUnicode_InternInPlace(&name);
        PyTuple_SET_ITEM(interned, i, name);
    }
    Py_XSETREF(made->names, interned);
    made->call = call;
    return 0;
}

void discard(PyObject* self) {
    PyTypeObject* type = Py_TYPE(self);
    Py_XDECREF(reinterpret_cast<Made*>(self)->slots.type);
    Py_XDECREF(reinterpret_cast<Made*>(self)->names);
    type->tp_free(self);
    Py_DECREF(type);
}

PyMemberDef members[] = {
    {"__vectorcalloffset__", T_PYSSIZET, offsetof(Made, call), READONLY, nullptr},
    {nullptr, 0, 0, 0, nullptr},
};

template <vectorcallfunc call>
int add(PyObject* module, const char* full_name, const char* name) {
    PyType_Slot slots[] = {
        {Py_tp_new, reinterpret_cast<void*>(PyType_GenericNew)},
        {Py_tp_init, reinterpret_cast<void*>(initialise<call>)},
        {Py_tp_dealloc, reinterpret_cast<void*>(discard)},
        {Py_tp_call, reinterpret_cast<void*>(PyVectorcall_Call)},
        {Py_tp_members, members},
        {0, nullptr},
    };
    PyType_Spec spec = {full_name, sizeof(Made), 0, Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_VECTORCALL, slots};
    PyObject* type = PyType_FromSpec(&spec);
    return type == nullptr ? -1 : PyModule_AddObject(module, name, type);
}

int add_all(PyObject* module) {
    return add<make>(module, "vedette._values.Maker", "Maker") < 0 ? -1 : add<evolve>(module, "vedette._values.Evolver", "Evolver");
}

PyModuleDef_Slot stages[] = {{Py_mod_exec, reinterpret_cast<void*>(add_all)}, {0, nullptr}};
PyModuleDef module = {PyModuleDef_HEAD_INIT, "_values", nullptr, 0, nullptr, stages, nullptr, nullptr, nullptr};

}  // namespace

PyMODINIT_FUNC PyInit__values() { return PyModuleDef_Init(&module); }
