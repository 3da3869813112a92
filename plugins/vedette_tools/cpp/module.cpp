// vedette_tools._compiled: the smoothing of many paths. Arrays come as `smoothing/compiled.py` makes them, and are filled.

#define PY_SSIZE_T_CLEAN
#define NPY_NO_DEPRECATED_API NPY_2_0_API_VERSION
#include <Python.h>
#include <numpy/arrayobject.h>

#include "instruction_sets.hpp"
#include "paths.hpp"

namespace vedette {

namespace baseline {
extern const Paths paths;
}
#ifdef VEDETTE_AVX2
namespace avx2 {
extern const Paths paths;
}
#endif
#ifdef VEDETTE_AVX512
namespace avx512 {
extern const Paths paths;
}
#endif

namespace {

// What was built, best last.
const InstructionSet<Paths> kBuilt[] = {
    {"baseline", &baseline::paths, runs_baseline},
#ifdef VEDETTE_AVX2
    {"avx2", &avx2::paths, runs_avx2},
#endif
#ifdef VEDETTE_AVX512
    {"avx512", &avx512::paths, runs_avx512},
#endif
};
const Paths* chosen = nullptr;

// The arguments of a call one after another. What is not as it should be makes `good` false, with TypeError.
class Arguments {
  public:
    bool good = true;

    Arguments(PyObject* const* args, Py_ssize_t count) : args_(args), left_(count) {}

    template <class T>
    T* array(int type, std::int64_t size) {
        auto* given = reinterpret_cast<PyArrayObject*>(next());
        good = good && PyArray_Check(reinterpret_cast<PyObject*>(given)) && PyArray_TYPE(given) == type &&
               PyArray_IS_C_CONTIGUOUS(given) && PyArray_ISALIGNED(given) && PyArray_SIZE(given) == size;
        return good ? static_cast<T*>(PyArray_DATA(given)) : nullptr;
    }
    double* numbers(std::int64_t size) { return array<double>(NPY_DOUBLE, size); }
    double number() {
        PyObject* given = next();
        const double value = good ? PyFloat_AsDouble(given) : 0.0;
        good = good && !PyErr_Occurred();
        return value;
    }
    // Where pieces begin, from 0, and the last one ends: the number of rows.
    const std::int64_t* starts(std::int64_t& pieces, std::int64_t& rows) {
        const bool any = left_ > 0 && PyArray_Check(*args_);
        const std::int64_t size = any ? PyArray_SIZE(reinterpret_cast<PyArrayObject*>(*args_)) : 0;
        const auto* at = array<std::int64_t>(NPY_INT64, size);
        good = good && size > 0 && at[0] == 0;
        pieces = good ? size - 1 : 0;
        for (std::int64_t i = 0; good && i < pieces; ++i) good = at[i] <= at[i + 1];
        rows = good ? at[pieces] : 0;
        return at;
    }
    bool done() {
        good = good && left_ == 0;
        if (!good && !PyErr_Occurred()) PyErr_SetString(PyExc_TypeError, "arrays are not as compiled.py makes them");
        return good;
    }

  private:
    PyObject* const* args_;
    Py_ssize_t left_;

    PyObject* next() {
        good = good && left_-- > 0;
        return good ? *args_++ : nullptr;
    }
};

// What the paths' two functions are told of the fixes first: how many axes they have, where pieces begin, the fixes themselves.
template <class Fixes>
int read_fixes(Arguments& given, Fixes& it, std::int64_t& rows) {
    const int axes = static_cast<int>(given.number());
    given.good = given.good && (axes == 1 || axes == 2);
    it.starts = given.starts(it.pieces, rows);
    it.waits = given.numbers(rows), it.spots = given.numbers(rows * axes), it.velocities = given.numbers(rows * axes);
    it.speed = given.numbers(rows);
    return axes;
}

PyObject* bank(PyObject*, PyObject* const* args, Py_ssize_t count) {
    Arguments given(args, count);
    Bank it;
    std::int64_t rows;
    const int axes = read_fixes(given, it, rows);
    it.modes = static_cast<std::int64_t>(given.number());
    given.good = given.good && it.modes >= 1 && it.modes <= kMostBankModes;
    it.density = given.numbers(it.modes), it.share = given.numbers(it.pieces * it.modes), it.change = given.numbers(it.pieces);
    it.noise = given.numbers(it.pieces), it.noise_pace = given.numbers(it.pieces);
    it.gate = given.number(), it.again = given.number(), it.wide = given.number();
    it.rare = given.number(), it.rounding = given.number();
    it.loglik = given.numbers(rows);
    it.prob = given.array<float>(NPY_FLOAT, rows * it.modes);
    it.prior = given.array<float>(NPY_FLOAT, rows * it.modes);
    it.gross = given.array<bool>(NPY_BOOL, rows);
    if (!given.done()) return nullptr;
    Py_BEGIN_ALLOW_THREADS;
    chosen->bank[axes - 1](it);
    Py_END_ALLOW_THREADS;
    Py_RETURN_NONE;
}

PyObject* smoothed(PyObject*, PyObject* const* args, Py_ssize_t count) {
    Arguments given(args, count);
    Smoothed it;
    std::int64_t rows;
    const int axes = read_fixes(given, it, rows);
    it.density = given.numbers(rows);
    it.noise = given.numbers(rows), it.noise_pace = given.numbers(rows);
    it.vague = given.number(), it.rounding = given.number();
    it.mean = given.numbers(2 * rows * axes), it.cov = given.numbers(3 * rows), it.ahead = given.numbers(3 * rows);
    if (!given.done()) return nullptr;
    Py_BEGIN_ALLOW_THREADS;
    chosen->smoothed[axes - 1](it);
    Py_END_ALLOW_THREADS;
    Py_RETURN_NONE;
}

PyObject* smoothed_modes(PyObject*, PyObject* const* args, Py_ssize_t count) {
    Arguments given(args, count);
    After it;
    std::int64_t rows;
    it.modes = static_cast<std::int64_t>(given.number());
    given.good = given.good && it.modes >= 1 && it.modes <= kMostBankModes;
    it.starts = given.starts(it.pieces, rows);
    it.prior = given.numbers(rows * it.modes), it.share = given.numbers(it.pieces * it.modes);
    it.change = given.numbers(it.pieces), it.least = given.number();
    it.prob = given.numbers(rows * it.modes);
    if (!given.done()) return nullptr;
    Py_BEGIN_ALLOW_THREADS;
    chosen->after(it);
    Py_END_ALLOW_THREADS;
    Py_RETURN_NONE;
}

#define VEDETTE_FAST(function) \
    {#function, reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(function)), METH_FASTCALL, nullptr},
PyMethodDef methods[] = {VEDETTE_FAST(bank) VEDETTE_FAST(smoothed) VEDETTE_FAST(smoothed_modes){nullptr, nullptr, 0, nullptr}};
PyModuleDef module = {PyModuleDef_HEAD_INIT, "_compiled", nullptr, -1, methods, nullptr, nullptr, nullptr, nullptr};

}  // namespace
}  // namespace vedette

PyMODINIT_FUNC PyInit__compiled() {
    import_array();
    for (const vedette::InstructionSet<vedette::Paths>& set : vedette::kBuilt)
        if (set.runs()) vedette::chosen = set.code;
    return PyModule_Create(&vedette::module);
}
