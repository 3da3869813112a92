// What filters ask of twins, as functions of Python.
#pragma once

#include "twins.hpp"

namespace vedette::entries {

inline bool sized(npy_intp n, npy_intp m, npy_intp parameters) {
    return n >= 1 && n <= kMostStates && m >= 1 && m <= kMostMeasured && parameters <= kMostParameters;
}

inline npy_intp last_axis(PyObject* given) {
    auto* array = reinterpret_cast<PyArrayObject*>(given);
    return PyArray_CheckExact(given) && PyArray_NDIM(array) > 0 ? PyArray_DIM(array, PyArray_NDIM(array) - 1) : 0;
}

// Arguments: states x, function, parameters, how many axes are measured.
inline PyObject* measure_twin(Call& call, Args args) {
    Twin<SensorTwin> twin;
    const npy_intp *x = call.in(args[0], 1), *own = call.in(args[2], 1), m = PyNumber_AsSsize_t(args[3], PyExc_OverflowError);
    if (!call.ok || !twin.read(args[1], kSensor) || !sized(x[0], m, own[0]) || !call.broadcast()) return nullptr;
    const int n = static_cast<int>(x[0]);
    Axes all;
    for (all.count = 0; all.count < n; ++all.count) all.each[all.count] = all.count;
    PyObject *z = call.out(1, m), *H = call.out(2, m, n), *R = call.out(2, m, m), *detects = call.out(0);
    if (z && H && R && detects) look(call.batch, twin, all, n, static_cast<int>(m), static_cast<int>(own[0]));
    return call.pack(z, H, R, detects);
}

// Arguments: states x, dt, function, parameters, periods of the state.
inline PyObject* move_twin(Call& call, Args args) {
    Twin<MotionTwin> twin;
    Periods periods;
    if (!read_periods(args[4], periods) || !twin.read(args[2], kMotion)) return nullptr;
    const npy_intp *x = call.in(args[0], 1), *own = call.in(args[3], 1);
    const double dt = call.number(args[1]);
    if (!call.ok || !sized(x[0], 1, own[0]) || !are_among(periods, x[0]) || !call.broadcast()) return nullptr;
    PyObject *to = call.out(1, x[0]), *F = call.out(2, x[0], x[0]), *Q = call.out(2, x[0], x[0]);
    if (to && F && Q) move(call.batch, twin, dt, periods, static_cast<int>(x[0]), static_cast<int>(own[0]));
    return call.pack(to, F, Q);
}

// Arguments: x, P, returns z, their noises (*b, 1, k, m, m) or None, function, parameters, axes observed, P_G, periods of z.
inline PyObject* evaluate_twin(Call& call, Args args) {
    Call states(kPlain);
    Twin<SensorTwin> twin;
    Axes axes;
    const npy_intp *x = states.in(args[0], 1), *own = states.in(args[5], 1), m = last_axis(args[2]);
    if (!states.ok || !twin.read(args[4], kSensor) || !sized(x[0], m, own[0]) || !axes.read(args[6], x[0]) ||
        !states.broadcast())
        return nullptr;
    const int n = static_cast<int>(x[0]);
    const Seen seen(states, n, m);
    if (!seen) return nullptr;
    look(states.batch, twin, axes, n, static_cast<int>(m), static_cast<int>(own[0]));
    PyObject* const all[] = {args[1], args[2], seen.z, seen.slope, args[3] == Py_None ? seen.noise : args[3],
                             seen.detects, args[7], args[8]};
    return evaluate_returns(call, all);
}

// Arguments: x, P, F, Q, returns z, function, parameters, axes observed, P_G, limit, log density, best, periods of z.
inline PyObject* scan_step_twin(Call& call, Args args) {
    shapes::ScanStepTwin shape;
    Twin<SensorTwin> twin;
    Axes axes;
    if (!PyBool_Check(args[11]) || !read_periods(args[12], shape.periods) || !twin.read(args[5], kSensor)) return nullptr;
    const npy_intp *x = call.in(args[0], 1), *P = call.in(args[1], 2), *F = call.in(args[2], 2), *Q = call.in(args[3], 2),
                   *z = call.in(args[4], 2, true), *own = call.in(args[6], 1);
    shape.p_gate = call.number(args[8]), shape.limit = call.number(args[9]), shape.log_density = call.number(args[10]);
    if (!call.ok) return nullptr;
    const npy_intp n = x[0], m = z[1], k = z[0];
    if (!sized(n, m, own[0]) || k > kMostTaken || !square(P, n) || !square(F, n) || !square(Q, n) || !axes.read(args[7], n) ||
        !are_among(shape.periods, m) || !call.broadcast())
        return nullptr;
    shape.n = static_cast<int>(n), shape.m = static_cast<int>(m), shape.k = static_cast<int>(k);
    shape.best = args[11] == Py_True, shape.function = twin.function, shape.data = twin.data;
    shape.parameters = static_cast<int>(own[0]), shape.observed = axes.count;
    std::copy_n(axes.each, axes.count, shape.axes);
    std::fill_n(shape.column, kMostStates, -1);
    for (int a = 0; a < axes.count; ++a) shape.column[axes.each[a]] = a;
    PyObject *to = call.out(1, n), *cov = call.out(2, n, n), *weights = call.out(1, 1 + k), *distance = call.out(1, k);
    if (to && cov && weights && distance) call.run(table->scan_step_twin, shape);
    PyObject* after = call.pack_within(to, cov);
    return call.pack(after, weights, distance);
}

// Whether a variance in `cov` = F P F' + Q is so small a share of what its terms come to that their rounding shows.
inline bool cancels_in(const double* P, const double* F, const double* cov, int n) {
    constexpr double kCancelled = 1e-5;
    for (int i = 0; i < n; ++i) {
        double most = 0.0;
        for (int j = 0; j < n; ++j) most += std::fabs(F[i * n + j]) * std::sqrt(P[j * n + j]);
        if (cov[i * n + i] < kCancelled * most * most) return true;
    }
    return false;
}

// Arguments: P, F, and F P F' + Q.
inline PyObject* cancels(Call& call, Args args) {
    const npy_intp *P = call.in(args[0], 2), *F = call.in(args[1], 2), *cov = call.in(args[2], 2);
    if (!call.ok || P[0] > kMostStates || !square(P, P[0]) || !square(F, P[0]) || !square(cov, P[0]) || !call.broadcast())
        return nullptr;
    for (Problems each(call.batch); each.next();)
        if (cancels_in(each.in(0), each.in(1), each.in(2), static_cast<int>(P[0]))) Py_RETURN_TRUE;
    Py_RETURN_FALSE;
}

// Arguments: x, P, dt, function, parameters, periods of the state. Null if digits cancel, too.
inline PyObject* predict_twin(Call& call, Args args) {
    Call states(kPlain);
    Twin<MotionTwin> twin;
    Periods periods;
    if (!read_periods(args[5], periods) || !twin.read(args[3], kMotion)) return nullptr;
    const npy_intp *x = states.in(args[0], 1), *own = states.in(args[4], 1);
    const double dt = states.number(args[2]);
    if (!states.ok || !sized(x[0], 1, own[0]) || !are_among(periods, x[0]) || !states.broadcast()) return nullptr;
    const npy_intp n = x[0];
    PyObject *to = states.out(1, n), *F = states.out(2, n, n), *Q = states.out(2, n, n), *cov = nullptr;
    if (to && F && Q) {
        move(states.batch, twin, dt, periods, static_cast<int>(n), static_cast<int>(own[0]));
        PyObject* const all[] = {args[1], F, Q};
        Call after(kPlain);
        cov = propagate(after, all);
    }
    if (cov != nullptr) {
        Call check(kPlain);
        PyObject* const all[] = {args[1], F, cov};
        PyObject* lost = cancels(check, all);
        if (lost != Py_False) Py_CLEAR(cov);
        Py_XDECREF(lost);
    }
    Py_XDECREF(F), Py_XDECREF(Q);
    return call.pack(to, cov);
}

// The points x + dx, one block of a state's s after another, as `twin` is to take them.
struct Points {
    static constexpr int kMost = kMostPoints;
    double x[kMostStates * kMost], own[kMostParameters * kMost];

    void take(const double* mean, const double* dx, const double* parameters, int s, int n, int numbers, const Periods& periods,
              const Axes* axes) {
        for (int p = 0; p < s; ++p) {
            double point[kMostStates];
            for (int a = 0; a < n; ++a) point[a] = mean[a] + dx[p * n + a];
            wrap(point, periods);
            if (axes == nullptr)
                put_aside(point, n, x, s, p);
            else
                for (int a = 0; a < axes->count; ++a) x[a * s + p] = point[axes->each[a]];
            put_aside(parameters, numbers, own, s, p);
        }
    }
};

// Arguments: x, points' offsets dx (s, n), weights (s), dt, function, parameters, periods of the state.
inline PyObject* predict_points_twin(Call& call, Args args) {
    Twin<MotionTwin> twin;
    Periods periods;
    if (!read_periods(args[6], periods) || !twin.read(args[4], kMotion)) return nullptr;
    const npy_intp *x = call.in(args[0], 1), *dx = call.in(args[1], 2), *weights = call.in(args[2], 1),
                   *own = call.in(args[5], 1);
    const double dt = call.number(args[3]);
    if (!call.ok || !sized(x[0], 1, own[0]) || dx[0] < 1 || dx[0] > kMostPoints || dx[1] != x[0] || weights[0] != dx[0] ||
        !are_among(periods, x[0]) || !call.broadcast())
        return nullptr;
    const int n = static_cast<int>(x[0]), s = static_cast<int>(dx[0]), numbers = static_cast<int>(own[0]);
    PyObject *to = call.out(1, n), *cov = call.out(2, n, n);
    if (to == nullptr || cov == nullptr) return call.pack(to, cov);
    for (Problems each(call.batch); each.next();) {
        Points points;
        double moved[kMostStates * kMostPoints], F[kStates2 * kMostPoints], Q[kStates2 * kMostPoints];
        double apart[kMostPoints * kMostStates];
        points.take(each.in(0), each.in(1), each.in(3), s, n, numbers, periods, nullptr);
        twin.function(s, dt, points.x, points.own, moved, F, Q, twin.data);
        for (int p = 0; p < s; ++p) take_back(moved, n, s, p, apart + p * n);
        for (int p = 0; p < s; ++p) wrap(apart + p * n, periods);
        const double* w = each.in(2);
        double* P = each.out(1);
        centre(apart, w, s, n, periods, each.out(0));
        for (int i = 0; i < n; ++i)
            for (int j = i; j < n; ++j) {
                double sum = 0.0;
                for (int p = 0; p < s; ++p) sum += w[p] * apart[p * n + i] * apart[p * n + j];
                P[i * n + j] = P[j * n + i] = sum + Q[(i * n + j) * s];
            }
    }
    return call.pack(to, cov);
}

// Arguments: x, points' offsets dx (s, n), weights (s), returns z, their noises (*b, 1, k, m, m) or None, function, parameters,
// axes observed, P_G, periods of the state and of z.
inline PyObject* evaluate_points_twin(Call& call, Args args) {
    Call states(kPlain);
    Twin<SensorTwin> twin;
    Axes axes;
    Periods periods, measured;
    if (!read_periods(args[9], periods) || !read_periods(args[10], measured) || !twin.read(args[5], kSensor)) return nullptr;
    const npy_intp *x = states.in(args[0], 1), *dx = states.in(args[1], 2), *own = states.in(args[6], 1), m = last_axis(args[3]);
    const double p_gate = states.number(args[8]);
    if (!states.ok || !sized(x[0], m, own[0]) || dx[0] < 1 || dx[0] > kMostPoints || dx[1] != x[0] ||
        last_axis(args[2]) != dx[0] || !axes.read(args[7], x[0]) || !are_among(periods, x[0]) || !are_among(measured, m) ||
        PyArray_NDIM(reinterpret_cast<PyArrayObject*>(args[2])) != 1 || !states.broadcast())
        return nullptr;
    PyArrayObject* given = states.as_doubles(args[2], 1);
    if (given == nullptr) return nullptr;
    const auto* weights = static_cast<const double*>(PyArray_DATA(given));
    const int n = static_cast<int>(x[0]), s = static_cast<int>(dx[0]), d = static_cast<int>(m), numbers = static_cast<int>(own[0]);
    PyObject *expected = states.out(1, m), *apart = states.out(2, s, m), *noise = states.out(3, 1, m, m),
             *detects = states.out(0), *result = nullptr;
    if (expected && apart && noise && detects) {
        for (Problems each(states.batch); each.next();) {
            Points points;
            double z[kMostMeasured * kMostPoints], H[kMostMeasured * kMostStates * kMostPoints], R[kMeasured2 * kMostPoints];
            double found[kMostPoints];
            points.take(each.in(0), each.in(1), each.in(2), s, n, numbers, periods, &axes);
            twin.function(s, points.x, points.own, z, H, R, found, twin.data);
            for (int p = 0; p < s; ++p) take_back(z, d, s, p, each.out(1) + p * d);
            centre(each.out(1), weights, s, d, measured, each.out(0));
            take_back(R, d * d, s, 0, each.out(2));  // the first point is the mean
            *each.out(3) = found[0];
        }
        Call residuals(kPlain);
        residuals.in(args[3], 2, true), residuals.in(expected, 1);
        PyObject* nu = nullptr;
        npy_intp k = 0;
        if (residuals.ok && residuals.broadcast()) {
            k = PyArray_DIM(reinterpret_cast<PyArrayObject*>(args[3]), PyArray_NDIM(reinterpret_cast<PyArrayObject*>(args[3])) - 2);
            nu = residuals.out(2, k, m);
        }
        if (nu != nullptr) {
            for (Problems each(residuals.batch); each.next();)
                for (npy_intp h = 0; h < k; ++h) {
                    for (int i = 0; i < d; ++i) each.out(0)[h * d + i] = each.in(0)[h * d + i] - each.in(1)[i];
                    wrap(each.out(0) + h * d, measured);
                }
            Call points(kPlain);
            PyObject* const all[] = {args[1], apart, args[2], nu, args[4] == Py_None ? noise : args[4]};
            if (PyObject* seen = evaluate_points(points, all)) {
                // What every estimator's innovation says of the returns, in front of them of the miss.
                Call columns(kPlain);
                const npy_intp *likely = columns.in(PyTuple_GET_ITEM(seen, 0), 1), *volume = columns.in(PyTuple_GET_ITEM(seen, 2), 1);
                columns.in(detects, 0);
                if (columns.ok && columns.broadcast()) {
                    PyObject *loglik = columns.out(1, 1 + likely[0]), *largest = columns.out(0);
                    if (loglik && largest)
                        for (Problems each(columns.batch); each.next();) {
                            constexpr double tiny = std::numeric_limits<double>::min();
                            const double p = *each.in(2), hit = std::log(p > tiny ? p : tiny), miss = 1.0 - p * p_gate;
                            double most = -std::numeric_limits<double>::infinity();
                            each.out(0)[0] = std::log(miss > tiny ? miss : tiny);
                            for (npy_intp h = 0; h < likely[0]; ++h) each.out(0)[1 + h] = each.in(0)[h] + hit;
                            for (npy_intp h = 0; h < volume[0]; ++h) most = each.in(1)[h] > most ? each.in(1)[h] : most;
                            *each.out(1) = most;
                        }
                    PyObject* distance = Py_NewRef(PyTuple_GET_ITEM(seen, 1));
                    PyObject* detail = call.pack_within(Py_NewRef(PyTuple_GET_ITEM(seen, 3)), Py_NewRef(PyTuple_GET_ITEM(seen, 4)));
                    result = call.pack(loglik, distance, largest, Py_NewRef(distance), detail);
                }
                Py_DECREF(seen);
            }
            Py_DECREF(nu);
        }
    }
    Py_XDECREF(expected), Py_XDECREF(apart), Py_XDECREF(noise), Py_XDECREF(detects);
    return result;
}

}  // namespace vedette::entries
