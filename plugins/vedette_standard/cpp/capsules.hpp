// Twins around other twins: their functions come as capsules, and the one around them keeps in its own capsule what it reads.
#pragma once

#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include <cstring>
#include <memory>
#include <utility>
#include <vector>

namespace vedette {

using SensorTwin = void (*)(int, const double*, const double*, double*, double*, double*, double*, void*);
using MotionTwin = void (*)(int, double, const double*, const double*, double*, double*, double*, void*);
constexpr const char* kSensor = "void (int, double *, double *, double *, double *, double *, double *, void *)";
constexpr const char* kMotion = "void (int, double, double *, double *, double *, double *, double *, void *)";

// The function of a twin, a capsule or a tuple that begins with one.
template <class Function>
struct Inner {
    Function call = nullptr;
    void* data = nullptr;
    PyObject* keep = nullptr;

    Inner() = default;
    Inner(const Inner&) = delete;
    Inner(Inner&& other) noexcept : call(other.call), data(other.data), keep(std::exchange(other.keep, nullptr)) {}
    ~Inner() { Py_XDECREF(keep); }

    bool read(PyObject* given, const char* signature) {
        PyObject* capsule = PyTuple_Check(given) && PyTuple_GET_SIZE(given) > 0 ? PyTuple_GET_ITEM(given, 0) : given;
        void* pointer = PyCapsule_GetPointer(capsule, signature);
        if (pointer == nullptr) return false;
        std::memcpy(&call, &pointer, sizeof pointer);
        data = PyCapsule_GetContext(capsule);
        keep = Py_NewRef(given);
        return true;
    }
};

template <class Function>
PyObject* capsule_of(Function function, const char* signature, PyCapsule_Destructor drop = nullptr) {
    void* pointer;
    static_assert(sizeof pointer == sizeof function);
    std::memcpy(&pointer, &function, sizeof pointer);
    return PyCapsule_New(pointer, signature, drop);
}

// The capsule of a function around others, which reads `data`.
template <class Data, class Function>
PyObject* capsule_around(std::unique_ptr<Data> data, Function function, const char* signature) {
    PyObject* capsule = capsule_of(function, signature, [](PyObject* gone) { delete static_cast<Data*>(PyCapsule_GetContext(gone)); });
    if (capsule != nullptr) PyCapsule_SetContext(capsule, data.release());
    return capsule;
}

template <class T, class F>
bool read_each(PyObject* given, std::vector<T>& to, const F& as) {
    if (!PyTuple_CheckExact(given)) return PyErr_Format(PyExc_TypeError, "must be a tuple, got %R", given) != nullptr;
    for (Py_ssize_t i = 0; i < PyTuple_GET_SIZE(given); ++i) to.push_back(static_cast<T>(as(PyTuple_GET_ITEM(given, i))));
    return PyErr_Occurred() == nullptr;
}

// Room for numbers: a few on the stack.
class Room {
  public:
    explicit Room(int size) : many_(size > kFew ? static_cast<std::size_t>(size) : 0) {}
    double* at() { return many_.empty() ? few_ : many_.data(); }

  private:
    static constexpr int kFew = 2048;
    double few_[kFew];
    std::vector<double> many_;
};

}  // namespace vedette
