// Makes instances of frozen values without calling their __init__, which sets one field at a time through object.__setattr__.
//
//     maker = Maker(cls, names)     # cls has __slots__, and an __init__ that only stores its arguments
//     maker(a, b, c)                # == cls(a, b, c), in a fifth of the time

#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <structmember.h>

#include <cstddef>

namespace {

constexpr Py_ssize_t kMost = 32;

struct Maker {
    PyObject_HEAD
    vectorcallfunc call;
    PyTypeObject* type;
    Py_ssize_t count;
    Py_ssize_t offsets[kMost];
};

PyObject* make(PyObject* self, PyObject* const* args, size_t flagged, PyObject* keywords) {
    auto* maker = reinterpret_cast<Maker*>(self);
    const Py_ssize_t given = PyVectorcall_NARGS(flagged);
    if (given != maker->count || (keywords != nullptr && PyTuple_GET_SIZE(keywords) > 0)) {
        PyErr_Format(PyExc_TypeError, "%s takes its %zd fields in order, got %zd", maker->type->tp_name, maker->count, given);
        return nullptr;
    }
    PyObject* value = maker->type->tp_alloc(maker->type, 0);
    if (value == nullptr) return nullptr;
    char* base = reinterpret_cast<char*>(value);
    for (Py_ssize_t i = 0; i < given; ++i) {
        Py_INCREF(args[i]);
        *reinterpret_cast<PyObject**>(base + maker->offsets[i]) = args[i];
    }
    return value;
}

int initialise(PyObject* self, PyObject* args, PyObject*) {
    auto* maker = reinterpret_cast<Maker*>(self);
    PyTypeObject* type;
    PyObject* names;
    if (!PyArg_ParseTuple(args, "O!O!", &PyType_Type, &type, &PyTuple_Type, &names)) return -1;
    const Py_ssize_t count = PyTuple_GET_SIZE(names);
    if (count > kMost || type->tp_itemsize != 0) {
        PyErr_Format(PyExc_TypeError, "%s cannot be made field by field", type->tp_name);
        return -1;
    }
    for (Py_ssize_t i = 0; i < count; ++i) {
        PyObject* member = PyObject_GetAttr(reinterpret_cast<PyObject*>(type), PyTuple_GET_ITEM(names, i));
        if (member == nullptr) return -1;
        const bool is_slot = Py_IS_TYPE(member, &PyMemberDescr_Type) &&
                             reinterpret_cast<PyMemberDescrObject*>(member)->d_member->type == T_OBJECT_EX;
        if (is_slot) maker->offsets[i] = reinterpret_cast<PyMemberDescrObject*>(member)->d_member->offset;
        Py_DECREF(member);
        if (!is_slot) {
            PyErr_Format(PyExc_TypeError, "%s.%U is no slot", type->tp_name, PyTuple_GET_ITEM(names, i));
            return -1;
        }
    }
    Py_INCREF(type);
    Py_XSETREF(maker->type, type);
    maker->count = count;
    maker->call = make;
    return 0;
}

void discard(PyObject* self) {
    PyTypeObject* own = Py_TYPE(self);
    Py_XDECREF(reinterpret_cast<Maker*>(self)->type);
    own->tp_free(self);
    Py_DECREF(own);
}

PyMemberDef members[] = {
    {"__vectorcalloffset__", T_PYSSIZET, offsetof(Maker, call), READONLY, nullptr},
    {nullptr, 0, 0, 0, nullptr},
};

PyType_Slot slots[] = {
    {Py_tp_new, reinterpret_cast<void*>(PyType_GenericNew)},
    {Py_tp_init, reinterpret_cast<void*>(initialise)},
    {Py_tp_dealloc, reinterpret_cast<void*>(discard)},
    {Py_tp_call, reinterpret_cast<void*>(PyVectorcall_Call)},
    {Py_tp_members, members},
    {0, nullptr},
};

PyType_Spec spec = {
    "vedette._values.Maker", sizeof(Maker), 0, Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_VECTORCALL, slots,
};

int add(PyObject* module) {
    PyObject* type = PyType_FromSpec(&spec);
    if (type == nullptr) return -1;
    return PyModule_AddObject(module, "Maker", type);
}

PyModuleDef_Slot stages[] = {{Py_mod_exec, reinterpret_cast<void*>(add)}, {0, nullptr}};
PyModuleDef module = {PyModuleDef_HEAD_INIT, "_values", nullptr, 0, nullptr, stages, nullptr, nullptr, nullptr};

}  // namespace

PyMODINIT_FUNC PyInit__values() { return PyModuleDef_Init(&module); }
