// The twin of a sensor whose registration errors are part of the state, around the twin of the sensor itself: sensors/biased.py.
#pragma once

#include <algorithm>
#include <cmath>

#include "capsules.hpp"

namespace vedette {

// z = h(x + o - l (v - u)) + a: which state axis is each measured axis' a, and each own axis' o and v; -1 where there is none.
// The platform's velocity u (n,) stands behind the own twin's parameters, of which there are `before`.
struct Biased {
    Inner<SensorTwin> own;
    int states, lag, before;
    std::vector<int> added, offset, speed;
    std::vector<double> period;  // of measured axes, 0 if they do not wrap

    void look(int count, const double* x, const double* parameters, double* z, double* slope, double* noise, double* detects) const {
        const int n = static_cast<int>(offset.size()), m = static_cast<int>(added.size());
        Room room((n + m * n) * count);
        double *seen = room.at(), *inner = seen + n * count;
        const double* carried = parameters + before * count;
        for (int a = 0; a < n; ++a)
            for (int i = 0; i < count; ++i) {
                double at = x[a * count + i];
                if (offset[a] >= 0) at += x[offset[a] * count + i];
                if (speed[a] >= 0) at -= x[lag * count + i] * (x[speed[a] * count + i] - carried[a * count + i]);
                seen[a * count + i] = at;
            }
        own.call(count, seen, parameters, z, inner, noise, detects, own.data);
        std::fill_n(slope, m * states * count, 0.0);
        for (int j = 0; j < m; ++j) {
            for (int a = 0; a < n; ++a)
                for (int i = 0; i < count; ++i) {
                    const double by = inner[(j * n + a) * count + i];
                    double* row = slope + j * states * count + i;
                    row[a * count] += by;
                    if (offset[a] >= 0) row[offset[a] * count] += by;
                    if (speed[a] < 0) continue;
                    row[speed[a] * count] -= x[lag * count + i] * by;
                    row[lag * count] -= by * (x[speed[a] * count + i] - carried[a * count + i]);
                }
            for (int i = 0; i < count && added[j] >= 0; ++i) {
                z[j * count + i] = wrapped(z[j * count + i] + x[added[j] * count + i], period[j]);
                slope[(j * states + added[j]) * count + i] = 1.0;
            }
        }
    }

  private:
    static double wrapped(double x, double period) {
        if (period == 0.0) return x;
        const double half = period / 2, near = x - period * std::nearbyint(x / period);
        return near >= half ? -half : near >= -half ? near : -half;
    }
};

inline void look_biased(int count, const double* x, const double* parameters, double* z, double* slope, double* noise,
                        double* detects, void* data) {
    static_cast<const Biased*>(data)->look(count, x, parameters, z, slope, noise, detects);
}

// biased(function of the sensor's own twin, states, lag, added, offset, speed, period, parameters of the own twin): the function around it.
inline PyObject* biased(PyObject*, PyObject* const* args, Py_ssize_t count) {
    if (count != 8) return PyErr_Format(PyExc_TypeError, "biased takes 8 arguments, got %zd", count);
    auto data = std::make_unique<Biased>();
    if (!data->own.read(args[0], kSensor)) return nullptr;
    data->states = static_cast<int>(PyLong_AsLong(args[1])), data->lag = static_cast<int>(PyLong_AsLong(args[2]));
    data->before = static_cast<int>(PyLong_AsLong(args[7]));
    if (!read_each(args[3], data->added, PyLong_AsLong) || !read_each(args[4], data->offset, PyLong_AsLong) ||
        !read_each(args[5], data->speed, PyLong_AsLong) || !read_each(args[6], data->period, PyFloat_AsDouble))
        return nullptr;
    return capsule_around(std::move(data), look_biased, kSensor);
}

}  // namespace vedette
