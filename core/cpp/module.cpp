// vedette.kernels._compiled: the reference's kernels under the same names. A call that a compiled kernel is not made for,
// by its sizes, types or number of axes, goes to the reference.

#include <cstring>

#include "association_entries.hpp"
#include "clusters.hpp"
#include "entries.hpp"
#include "existing.hpp"
#include "hypotheses.hpp"
#include "instruction_sets.hpp"
#include "iterated.hpp"
#include "mode_entries.hpp"
#include "roots.hpp"
#include "streams.hpp"
#include "twin_entries.hpp"

namespace vedette {

namespace baseline {
extern const Table table;
}
#ifdef VEDETTE_AVX2
namespace avx2 {
extern const Table table;
}
#endif
#ifdef VEDETTE_AVX512
namespace avx512 {
extern const Table table;
}
#endif

namespace {

#define VEDETTE_NAME(name, ...) name,
#define VEDETTE_TEXT(name, ...) #name,
enum class Name { VEDETTE_KERNELS(VEDETTE_NAME) VEDETTE_FUNCTIONS(VEDETTE_NAME) kNames };
constexpr int kNames = static_cast<int>(Name::kNames);
const char* const kText[kNames] = {VEDETTE_KERNELS(VEDETTE_TEXT) VEDETTE_FUNCTIONS(VEDETTE_TEXT)};

PyObject* reference[kNames];
Result results[kNames][kMostResults];
const char* chosen = "baseline";

PyObject* call_reference(Name name, Args args, Py_ssize_t count) {
    const int which = static_cast<int>(name);
    if (reference[which] == nullptr)
        return PyErr_Format(PyExc_RuntimeError, "no reference is bound for %s", kText[which]);
    return PyObject_Vectorcall(reference[which], args, static_cast<size_t>(count), nullptr);
}

// A call from Python: the kernel's, or the reference's if the kernel does not take it, be it for an argument that is no array.
template <Name name, Py_ssize_t count, PyObject* (*kernel)(Call&, Args)>
PyObject* call_kernel(PyObject*, Args args, Py_ssize_t given) {
    if (given == count) {
        Call call(results[static_cast<int>(name)]);
        if (PyObject* result = kernel(call, args)) return result;
        if (PyErr_Occurred()) {
            if (PyErr_ExceptionMatches(PyExc_MemoryError) || !PyErr_ExceptionMatches(PyExc_Exception)) return nullptr;
            PyErr_Clear();
        }
    }
    return call_reference(name, args, given);
}

// bind(name, function, type, ..): where the calls go that the kernel of that name does not take, and the types of its result.
PyObject* bind(PyObject*, Args args, Py_ssize_t count) {
    const char* name = count >= 2 && count <= 2 + kMostResults ? PyUnicode_AsUTF8(args[0]) : nullptr;
    for (int i = 0; name != nullptr && i < kNames; ++i)
        if (std::strcmp(name, kText[i]) == 0) {
            for (Py_ssize_t given = 2; given < count; ++given)
                if (!results[i][given - 2].take(args[given])) return nullptr;
            Py_INCREF(args[1]);
            Py_XSETREF(reference[i], args[1]);
            Py_RETURN_NONE;
        }
    return PyErr_Occurred() ? nullptr : PyErr_Format(PyExc_KeyError, "bind takes the name of a kernel, a function and types");
}

// What was built, best last.
const InstructionSet<Table> kBuilt[] = {
    {"baseline", &baseline::table, runs_baseline},
#ifdef VEDETTE_AVX2
    {"avx2", &avx2::table, runs_avx2},
#endif
#ifdef VEDETTE_AVX512
    {"avx512", &avx512::table, runs_avx512},
#endif
};

void take(const InstructionSet<Table>& set) { table = set.code, chosen = set.name; }

// Takes the named instruction set; ValueError if this processor or this build has it not. For tests.
PyObject* use(PyObject*, PyObject* given) {
    const char* name = PyUnicode_AsUTF8(given);
    if (name == nullptr) return nullptr;
    for (const InstructionSet<Table>& set : kBuilt)
        if (std::strcmp(name, set.name) == 0 && set.runs()) {
            take(set);
            Py_RETURN_NONE;
        }
    return PyErr_Format(PyExc_ValueError, "this processor or build has no kernels for %R", given);
}

PyObject* instruction_set(PyObject*, PyObject*) { return PyUnicode_FromString(chosen); }

PyObject* instruction_sets(PyObject*, PyObject*) {
    PyObject* all = PyList_New(0);
    for (const InstructionSet<Table>& set : kBuilt) {
        if (all == nullptr || !set.runs()) continue;
        PyObject* text = PyUnicode_FromString(set.name);
        if (text == nullptr || PyList_Append(all, text) < 0) Py_CLEAR(all);
        Py_XDECREF(text);
    }
    return all;
}

// What this was built from: a hash of sources, compiler and flags, so that two builds of one source are one code.
PyObject* build(PyObject*, PyObject*) { return PyUnicode_FromString(VEDETTE_BUILD); }

#define VEDETTE_FAST(name, function) \
    {name, reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(function)), METH_FASTCALL, nullptr},
#define VEDETTE_ENTRY(name, arguments, ...) VEDETTE_FAST(#name, (call_kernel<Name::name, arguments, entries::name>))
PyMethodDef methods[] = {
    VEDETTE_KERNELS(VEDETTE_ENTRY) VEDETTE_FUNCTIONS(VEDETTE_ENTRY) VEDETTE_FAST("bind", bind)
    {"use", use, METH_O, nullptr},
    {"build", build, METH_NOARGS, nullptr},
    {"instruction_set", instruction_set, METH_NOARGS, nullptr},
    {"instruction_sets", instruction_sets, METH_NOARGS, nullptr},
    {nullptr, nullptr, 0, nullptr},
};

PyModuleDef module = {PyModuleDef_HEAD_INIT, "_compiled", nullptr, -1, methods, nullptr, nullptr, nullptr, nullptr};

}  // namespace
}  // namespace vedette

PyMODINIT_FUNC PyInit__compiled() {
    import_array();
    for (const vedette::InstructionSet<vedette::Table>& set : vedette::kBuilt)
        if (set.runs()) vedette::take(set);
    return PyModule_Create(&vedette::module);
}
