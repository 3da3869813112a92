// vedette_standard._compiled: the twins of sensors and motions, as capsules that the kernels of vedette call, inverses, lifecycles,
// and joint association of pairs.

#include "biased.hpp"
#include "inverses.hpp"
#include "lifecycles.hpp"
#include "mixed_roots.hpp"
#include "pairs.hpp"
#include "products.hpp"

#include "instruction_sets.hpp"
#include "twins.hpp"

namespace vedette {

namespace baseline {
extern const Twins twins;
}
#ifdef VEDETTE_AVX2
namespace avx2 {
extern const Twins twins;
}
#endif
#ifdef VEDETTE_AVX512
namespace avx512 {
extern const Twins twins;
}
#endif

namespace {

// What was built, best last.
const InstructionSet<Twins> kBuilt[] = {
    {"baseline", &baseline::twins, runs_baseline},
#ifdef VEDETTE_AVX2
    {"avx2", &avx2::twins, runs_avx2},
#endif
#ifdef VEDETTE_AVX512
    {"avx512", &avx512::twins, runs_avx512},
#endif
};

bool add(PyObject* table, const char* kind, PyObject* capsule) {
    const bool good = capsule != nullptr && PyDict_SetItemString(table, kind, capsule) == 0;
    Py_XDECREF(capsule);
    return good;
}

PyObject* functions_of(const Twins& twins) {
    PyObject* table = PyDict_New();
    bool good = table != nullptr;
#define VEDETTE_SENSOR(kind, Kind) \
    good = good && add(table, #kind, capsule_of(twins.kind, kSensor));
#define VEDETTE_MOTION(kind, Kind) \
    good = good && add(table, #kind, capsule_of(twins.kind, kMotion));
    VEDETTE_SENSORS(VEDETTE_SENSOR)
    VEDETTE_MOTIONS(VEDETTE_MOTION)
    if (!good) Py_CLEAR(table);
    return table;
}

// By instruction set, best last, the capsule of each kind.
PyObject* all_twins(PyObject*, PyObject*) {
    PyObject* all = PyDict_New();
    for (const InstructionSet<Twins>& set : kBuilt) {
        if (all == nullptr || !set.runs()) continue;
        PyObject* table = functions_of(*set.code);
        if (table == nullptr || PyDict_SetItemString(all, set.name, table) < 0) Py_CLEAR(all);
        Py_XDECREF(table);
    }
    return all;
}

#define VEDETTE_FAST(function) \
    {#function, reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(function)), METH_FASTCALL, nullptr},
PyMethodDef methods[] = {
    VEDETTE_FAST(biased) VEDETTE_FAST(block_diagonal) VEDETTE_FAST(by_existence) VEDETTE_FAST(by_score) VEDETTE_FAST(from_polar) VEDETTE_FAST(limited) VEDETTE_FAST(m_of_n) VEDETTE_FAST(mixed_roots)
    VEDETTE_FAST(product) VEDETTE_FAST(propagated) VEDETTE_FAST(summed)
    {"twins", all_twins, METH_NOARGS, nullptr},
    {nullptr, nullptr, 0, nullptr},
};
PyModuleDef module = {PyModuleDef_HEAD_INIT, "_compiled", nullptr, -1, methods, nullptr, nullptr, nullptr, nullptr};

}  // namespace
}  // namespace vedette

PyMODINIT_FUNC PyInit__compiled() {
    import_array();
    return PyModule_Create(&vedette::module);
}
