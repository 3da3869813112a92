// The compiled twins of components: functions in C that say at once what a sensor's or a motion's methods say one by one. They are
// capsules named by their signature, as scipy.LowLevelCallable holds them, so a plugin's own, or a third party's, is called alike.
//
// States lie side by side: number `axis` of state i is at [axis * count + i], and so do parameters, values, derivatives (m, n)
// and noises (m, m), all row by row.
#pragma once

#include <cmath>
#include <utility>

#include "entries.hpp"

namespace vedette {

constexpr const char* kSensor = "void (int, double *, double *, double *, double *, double *, double *, void *)";

// The state `dt` s later, its derivative, and the noise.
using MotionTwin = void (*)(int count, double dt, const double* x, const double* parameters, double* moved, double* slope,
                            double* noise, void* data);
constexpr const char* kMotion = "void (int, double, double *, double *, double *, double *, double *, void *)";

constexpr int kBlock = 16;  // states that a twin is given at once, unless they are points

template <class Function>
struct Twin {
    Function function = nullptr;
    void* data = nullptr;

    // Takes a capsule, or a tuple that begins with one; false if it is named by another signature.
    bool read(PyObject* given, const char* signature) {
        PyObject* capsule = PyTuple_Check(given) && PyTuple_GET_SIZE(given) > 0 ? PyTuple_GET_ITEM(given, 0) : given;
        if (!PyCapsule_CheckExact(capsule)) return false;
        const char* name = PyCapsule_GetName(capsule);
        if (name == nullptr || std::strcmp(name, signature) != 0) return false;
        void* pointer = PyCapsule_GetPointer(capsule, name);
        std::memcpy(&function, &pointer, sizeof function);
        data = PyCapsule_GetContext(capsule);
        return function != nullptr;
    }
};

// The problems of a batch, one after another: where the operands of each are, and its place among the results.
class Problems {
  public:
    explicit Problems(const Batch& batch) : batch_(batch) {
        for (int d = 0; d < batch.dims; ++d) left_ *= batch.shape[d];
    }

    bool next() {
        if (left_-- <= 0) return false;
        if (begun_)
            for (int d = batch_.dims - 1; d >= 0; --d) {
                if (++index_[d] < batch_.shape[d]) break;
                index_[d] = 0;
            }
        begun_ = true;
        place_ = 0;
        for (int d = 0; d < batch_.dims; ++d) place_ += index_[d] * batch_.places[d];
        return true;
    }
    const double* in(int i) const {
        const double* at = batch_.in[i];
        for (int d = 0; d < batch_.dims; ++d) at += index_[d] * batch_.in_steps[i][d];
        return at;
    }
    double* out(int o) const { return batch_.out[o] + place_ * batch_.out_size[o]; }

  private:
    const Batch& batch_;
    std::ptrdiff_t left_ = 1, index_[kMostDims] = {}, place_ = 0;
    bool begun_ = false;
};

inline void put_aside(const double* from, int size, double* to, int count, int i) {
    for (int a = 0; a < size; ++a) to[a * count + i] = from[a];
}
inline void take_back(const double* from, int size, int count, int i, double* to) {
    for (int a = 0; a < size; ++a) to[a] = from[a * count + i];
}

inline double wrapped(double x, double period) {
    const double half = period / 2, near = x - period * std::nearbyint(x / period);
    return near >= half ? -half : near >= -half ? near : -half;
}
inline void wrap(double* x, const Periods& periods) {
    for (int i = 0; i < periods.count; ++i) {
        double& each = x[periods.each[i].axis];
        each = wrapped(each, periods.each[i].period);
    }
}

// Which axes of a state a sensor observes.
struct Axes {
    int count = 0, each[kMostStates];

    bool read(PyObject* given, npy_intp n) {
        if (!PyTuple_CheckExact(given) || PyTuple_GET_SIZE(given) > kMostStates || PyTuple_GET_SIZE(given) < 1) return false;
        count = static_cast<int>(PyTuple_GET_SIZE(given));
        for (int a = 0; a < count; ++a) {
            const long axis = PyLong_AsLong(PyTuple_GET_ITEM(given, a));
            if (axis < 0 || axis >= n) return false;
            each[a] = static_cast<int>(axis);
        }
        return true;
    }
};

// What a sensor's twin says of states, as new arrays; operands: states (n), parameters; slope over all axes, noise (1, m, m).
struct Seen {
    PyObject *z = nullptr, *slope = nullptr, *noise = nullptr, *detects = nullptr;

    Seen(Call& call, npy_intp n, npy_intp m)
        : z(call.out(1, m)), slope(call.out(2, m, n)), noise(call.out(3, 1, m, m)), detects(call.out(0)) {}
    Seen(const Seen&) = delete;
    ~Seen() { Py_XDECREF(z), Py_XDECREF(slope), Py_XDECREF(noise), Py_XDECREF(detects); }
    explicit operator bool() const { return z && slope && noise && detects; }
};

inline void look(const Batch& batch, const Twin<SensorTwin>& twin, const Axes& axes, int n, int m, int parameters) {
    double x[kMostStates * kBlock], own[kMostParameters * kBlock], z[kMostMeasured * kBlock], R[kMeasured2 * kBlock];
    double H[kMostMeasured * kMostStates * kBlock], detects[kBlock];
    Problems problems(batch);
    for (bool more = problems.next(); more;) {
        double* out[kBlock][4];
        const double *states[kBlock], *numbers[kBlock];
        int count = 0;
        for (; more && count < kBlock; more = problems.next(), ++count) {
            states[count] = problems.in(0), numbers[count] = problems.in(1);
            for (int o = 0; o < 4; ++o) out[count][o] = problems.out(o);
        }
        for (int i = 0; i < count; ++i) {
            for (int a = 0; a < axes.count; ++a) x[a * count + i] = states[i][axes.each[a]];
            put_aside(numbers[i], parameters, own, count, i);
        }
        twin.function(count, x, own, z, H, R, detects, twin.data);
        for (int i = 0; i < count; ++i) {
            take_back(z, m, count, i, out[i][0]), take_back(R, m * m, count, i, out[i][2]);
            if (axes.count < n) std::fill_n(out[i][1], m * n, 0.0);
            for (int j = 0; j < m; ++j)
                for (int a = 0; a < axes.count; ++a)
                    out[i][1][j * n + axes.each[a]] = H[(j * axes.count + a) * count + i];
            *out[i][3] = detects[i];
        }
    }
}

inline void move(const Batch& batch, const Twin<MotionTwin>& twin, double dt, const Periods& periods, int n, int parameters) {
    double x[kMostStates * kBlock], own[kMostParameters * kBlock], moved[kMostStates * kBlock];
    double F[kStates2 * kBlock], Q[kStates2 * kBlock];
    Problems problems(batch);
    for (bool more = problems.next(); more;) {
        double* out[kBlock][3];
        const double *states[kBlock], *numbers[kBlock];
        int count = 0;
        for (; more && count < kBlock; more = problems.next(), ++count) {
            states[count] = problems.in(0), numbers[count] = problems.in(1);
            for (int o = 0; o < 3; ++o) out[count][o] = problems.out(o);
        }
        for (int i = 0; i < count; ++i) {
            put_aside(states[i], n, x, count, i);
            put_aside(numbers[i], parameters, own, count, i);
        }
        twin.function(count, dt, x, own, moved, F, Q, twin.data);
        for (int i = 0; i < count; ++i) {
            take_back(moved, n, count, i, out[i][0]);
            take_back(F, n * n, count, i, out[i][1]), take_back(Q, n * n, count, i, out[i][2]);
            wrap(out[i][0], periods);
        }
    }
}

// Mean of points (s, d) around the first, and each one's difference from it, in their place.
inline void centre(double* points, const double* weights, int s, int d, const Periods& periods, double* mean) {
    double origin[kMostStates] = {};
    for (int i = 0; i < periods.count; ++i) origin[periods.each[i].axis] = points[periods.each[i].axis];
    std::fill_n(mean, d, 0.0);
    for (int p = 0; p < s; ++p) {
        double apart[kMostStates];
        for (int a = 0; a < d; ++a) apart[a] = points[p * d + a] - origin[a];
        wrap(apart, periods);
        for (int a = 0; a < d; ++a) mean[a] += weights[p] * apart[a];
    }
    for (int a = 0; a < d; ++a) mean[a] += origin[a];
    wrap(mean, periods);
    for (int p = 0; p < s; ++p) {
        for (int a = 0; a < d; ++a) points[p * d + a] -= mean[a];
        wrap(points + p * d, periods);
    }
}
}  // namespace vedette
