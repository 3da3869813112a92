// The nonlinear motions of this plugin, of eight states side by side: what their classes say in numpy, all of it at once.
#pragma once

#include "functions.hpp"

namespace vedette::VEDETTE_ISA {

struct Motion {
    double dt;
    const Eight *x, *p;
    Eight *moved, *F, *Q;
};

// A turn by an angle through its half, as turning.py has it.
struct Turn {
    Eight half, cos, sin, sinc, rho;

    VEDETTE_INLINE explicit Turn(Eight angle) : half(0.5 * angle) {
        sine_and_cosine(half, sin, cos);
        const Eight square = half * half;
        const Eight64 none = half == 0.0, small = magnitude(half) < 0.25;
        sinc = none ? 1.0 - Eight{} : sin / (none ? 1.0 - Eight{} : half);
        const Eight tail = 1.0 / 840 - square * (1.0 / 45360 - square * (1.0 / 3991680 - square / 518918400.0));
        const Eight series = -1.0 / 3 + square * (1.0 / 30 - square * tail);
        rho = small ? series : (cos - sinc) / (small ? 1.0 - Eight{} : square);
    }
};

// The arc over the state x, y, vx, vy, turn rate.
VEDETTE_INLINE void move_along_arc(const Motion& m) {
    const double dt = m.dt;
    const Turn turn(m.x[4] * dt);
    const Eight ux = turn.cos * m.x[2] - turn.sin * m.x[3], uy = turn.sin * m.x[2] + turn.cos * m.x[3];
    const Eight vx = turn.cos * ux - turn.sin * uy, vy = turn.sin * ux + turn.cos * uy;
    const Eight chord = dt * turn.sinc, stretch = turn.half * turn.rho;
    m.moved[0] = m.x[0] + chord * ux, m.moved[1] = m.x[1] + chord * uy, m.moved[2] = vx, m.moved[3] = vy, m.moved[4] = m.x[4];
    for (int i = 0; i < 25; ++i) m.F[i] = (i % 6 == 0 ? 1.0 : 0.0) - Eight{};
    m.F[2] = m.F[8] = dt * turn.sinc * turn.cos;
    m.F[7] = dt * turn.sinc * turn.sin, m.F[3] = -m.F[7];
    m.F[12] = m.F[18] = 1.0 - 2.0 * turn.sin * turn.sin;
    m.F[17] = 2.0 * turn.sin * turn.cos, m.F[13] = -m.F[17];
    m.F[4] = dt * dt / 2 * (stretch * ux - turn.sinc * uy), m.F[9] = dt * dt / 2 * (stretch * uy + turn.sinc * ux);
    m.F[14] = -dt * vy, m.F[19] = dt * vx;
}

// A covariance of position and velocity on each of `axes`, and of what turns, one number each; all independent.
VEDETTE_INLINE void disturb(const Motion& m, int axes, int rates, Eight position, Eight mixed, Eight velocity, Eight rate) {
    const int n = 2 * axes + rates;
    for (int i = 0; i < n * n; ++i) m.Q[i] = Eight{};
    for (int i = 0; i < axes; ++i) {
        m.Q[i * (n + 1)] = position;
        m.Q[(axes + i) * (n + 1)] = velocity;
        m.Q[i * n + axes + i] = m.Q[(axes + i) * n + i] = mixed;
    }
    for (int i = 2 * axes; i < n; ++i) m.Q[i * (n + 1)] = rate;
}
VEDETTE_INLINE void disturb_by_white_acceleration(const Motion& m, int axes, int rates) {
    const double dt = m.dt;
    const Eight q = m.p[0] * m.p[0];
    disturb(m, axes, rates, q * (dt * dt * dt) / 3.0, q * (dt * dt) / 2.0, q * dt, m.p[1] * m.p[1] * dt);
}

// sigma_accel, sigma_turn_rate
struct CoordinatedTurn {
    static constexpr int axes = 5, parameters = 2;
    VEDETTE_INLINE static void move(const Motion& m) {
        move_along_arc(m);
        disturb_by_white_acceleration(m, 2, 1);
    }
};

// sigma_accel, sigma_turn_accel
struct CoordinatedTurnPiecewise {
    static constexpr int axes = 5, parameters = 2;
    VEDETTE_INLINE static void move(const Motion& m) {
        move_along_arc(m);
        const Eight far = m.p[0] * (m.dt * m.dt / 2), fast = m.p[0] * m.dt, turned = m.p[1] * m.dt;
        disturb(m, 2, 1, far * far, far * fast, fast * fast, turned * turned);
    }
};

// The series of sin(A)/A, (1 - cos A)/A^2 and (A - sin A)/A^3 in A^2, and of their derivatives by A, over A.
struct Shares {
    static constexpr int kTerms = 13;
    Eight each[3], slope[3];

    VEDETTE_INLINE explicit Shares(Eight square) {
        const Eight64 small = square < 1.0;
        const Eight inside = small ? square : Eight{}, safe = small ? 1.0 - Eight{} : square, angle = root(safe);
        Eight sine, cosine, half, unused;
        sine_and_cosine(angle, sine, cosine);
        sine_and_cosine(0.5 * angle, half, unused);
        const Eight sinc = sine / angle, closed[3] = {sinc, 2.0 * (half / angle) * (half / angle), (1.0 - sinc) / safe};
        for (int i = 0; i < 3; ++i) {
            double factor = 1.0;  // of the last term: (-1)^k / (2 k + 1 + i)!
            for (int f = 2; f <= 2 * (kTerms - 1) + 1 + i; ++f) factor /= f;
            Eight sum{}, by{};
            for (int k = kTerms - 1; k >= 0; --k) {
                const double term = k % 2 == 0 ? factor : -factor;
                sum = sum * inside + term;
                if (k > 0) by = by * inside + 2.0 * k * term;
                factor *= (2 * k + i) * (2 * k + 1 + i);
            }
            each[i] = small ? sum : closed[i], slope[i] = by;
        }
        const Eight steep[3] = {1.0 - square * each[1] - each[0], each[0] - 2.0 * each[1], each[1] - 3.0 * each[2]};
        for (int i = 0; i < 3; ++i) slope[i] = small ? slope[i] : steep[i] / safe;
    }
};

VEDETTE_INLINE void cross(const Eight* a, const Eight* b, Eight* to) {
    to[0] = a[1] * b[2] - a[2] * b[1], to[1] = a[2] * b[0] - a[0] * b[2], to[2] = a[0] * b[1] - a[1] * b[0];
}

// sigma_accel, sigma_turn_rate
struct CoordinatedTurn3d {
    static constexpr int axes = 9, parameters = 2;
    VEDETTE_INLINE static void move(const Motion& m) {
        const double dt = m.dt;
        const Eight w[3] = {m.x[6] * dt, m.x[7] * dt, m.x[8] * dt}, *v = m.x + 3;
        const Eight square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
        const Shares shares(square);
        const Eight a = shares.each[0], b = shares.each[1], c = shares.each[2];
        Eight once[3], twice[3];
        cross(w, v, once), cross(w, once, twice);
        const Eight K[9] = {Eight{}, -w[2], w[1], w[2], Eight{}, -w[0], -w[1], w[0], Eight{}};
        const Eight V[9] = {Eight{}, -v[2], v[1], v[2], Eight{}, -v[0], -v[1], v[0], Eight{}};
        const Eight O[9] = {Eight{}, -once[2], once[1], once[2], Eight{}, -once[0], -once[1], once[0], Eight{}};
        for (int i = 0; i < 81; ++i) m.F[i] = (i % 10 == 0 ? 1.0 : 0.0) - Eight{};
        for (int i = 0; i < 3; ++i) {
            m.moved[i] = m.x[i] + dt * (v[i] + b * once[i] + c * twice[i]);
            m.moved[3 + i] = v[i] + a * once[i] + b * twice[i];
            m.moved[6 + i] = m.x[6 + i];
            for (int j = 0; j < 3; ++j) {
                const double same = i == j;
                Eight KK = Eight{}, KV = Eight{};
                for (int l = 0; l < 3; ++l) KK += K[3 * i + l] * K[3 * l + j], KV += K[3 * i + l] * V[3 * l + j];
                const Eight turned = -V[3 * i + j], turned_twice = -O[3 * i + j] - KV;
                m.F[9 * i + 3 + j] = dt * (same + b * K[3 * i + j] + c * KK);
                m.F[9 * (3 + i) + 3 + j] = same + (a * K[3 * i + j] + b * KK);
                m.F[9 * i + 6 + j] =
                    dt * dt * (b * turned + c * turned_twice + (shares.slope[1] * once[i] + shares.slope[2] * twice[i]) * w[j]);
                m.F[9 * (3 + i) + 6 + j] =
                    dt * (a * turned + b * turned_twice + (shares.slope[0] * once[i] + shares.slope[1] * twice[i]) * w[j]);
            }
        }
        disturb_by_white_acceleration(m, 3, 3);
    }
};

struct Complex {
    Eight re, im;
};
VEDETTE_INLINE Complex operator+(Complex a, Complex b) { return {a.re + b.re, a.im + b.im}; }
VEDETTE_INLINE Complex operator*(Complex a, Complex b) { return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re}; }
VEDETTE_INLINE Complex operator*(Eight a, Complex b) { return {a * b.re, a * b.im}; }
VEDETTE_INLINE Complex exponential(Complex w) {
    Eight sine, cosine;
    sine_and_cosine(w.im, sine, cosine);
    return exp_of(w.re) * Complex{cosine, sine};
}

// log(1 + g) / g and its derivative; near 0 by their series.
struct LogShare {
    static constexpr int kTerms = 18;
    static constexpr double kSmall = 0.1;
    Eight value, slope;

    VEDETTE_INLINE explicit LogShare(Eight g) {
        const Eight64 small = magnitude(g) < kSmall;
        const Eight inside = small ? g : Eight{}, safe = small ? 1.0 - Eight{} : g;
        Eight sum{}, by{};
        for (int k = kTerms - 1; k >= 0; --k) {
            const double term = (k % 2 == 0 ? 1.0 : -1.0) / (k + 1);
            sum = sum * inside + term;
            if (k > 0) by = by * inside + k * term;
        }
        const Eight closed = log_of_normal(1.0 + safe) / safe;
        value = small ? sum : closed, slope = small ? by : (1.0 / (1.0 + safe) - closed) / safe;
    }
};

// (exp(w) - 1) / w and its derivative; near 0 by their series.
struct Chord {
    static constexpr int kTerms = 20;
    Complex value, slope;

    VEDETTE_INLINE Chord(Complex w, Complex exponential_of_w) {
        const Eight square = w.re * w.re + w.im * w.im;
        const Eight64 small = square < 1.0;
        const Complex inside{small ? w.re : Eight{}, small ? w.im : Eight{}};
        const Eight over = 1.0 / (small ? 1.0 - Eight{} : square);
        const Complex inverse{w.re * over, -w.im * over};
        Complex sum{Eight{}, Eight{}}, by = sum;
        double term = 1.0;
        for (int f = 2; f <= kTerms; ++f) term /= f;
        for (int k = kTerms - 1; k >= 0; term *= k + 1, --k) {  // 1 / (k + 1)!
            sum = sum * inside, sum.re += term;
            if (k > 0) by = by * inside, by.re += k * term;
        }
        Complex closed = inverse * Complex{exponential_of_w.re - 1.0, exponential_of_w.im};
        Complex steep = inverse * Complex{exponential_of_w.re - closed.re, exponential_of_w.im - closed.im};
        value = {small ? sum.re : closed.re, small ? sum.im : closed.im};
        slope = {small ? by.re : steep.re, small ? by.im : steep.im};
    }
};

// sigma_tangential, sigma_normal
struct Curvilinear {
    static constexpr int axes = 6, parameters = 2;
    static constexpr double kSlow = 1e-2, kStand = -0.999;  // m/s, and a part of the speed: as the class has them

    VEDETTE_INLINE static void move(const Motion& m) {
        const Eight dt = m.dt - Eight{}, none{}, along = m.x[4];
        const Complex v{m.x[2], m.x[3]}, bend{2.0 * along, m.x[5]};
        const Eight speed = root(v.re * v.re + v.im * v.im + kSlow * kSlow), asked = along * dt / speed;
        const Eight64 braking = asked < kStand;
        const Eight gained = braking ? kStand - Eight{} : asked, over = 1.0 / (braking ? along : 1.0 - Eight{});
        const Eight elapsed = braking ? gained * speed * over : dt;
        const LogShare share(gained);
        const Eight reach = elapsed * share.value, time = reach / speed;
        const Complex w = time * bend, turned = exponential(w);
        const Chord chord(w, turned);
        const Eight slower = 1.0 / (1.0 + gained);
        const Complex after = v * (slower * turned), step = v * (reach * chord.value);
        m.moved[0] = m.x[0] + step.re, m.moved[1] = m.x[1] + step.im, m.moved[2] = after.re, m.moved[3] = after.im;
        m.moved[4] = along, m.moved[5] = m.x[5];
        for (int i = 0; i < 36; ++i) m.F[i] = (i % 7 == 0 ? 1.0 : 0.0) - none;
        // By the velocity and by the accelerations, the speed's derivative being `faster`.
        const Eight faster[4] = {v.re / speed, v.im / speed, none, none};
        for (int c = 0; c < 4; ++c) {
            const Eight more = c == 2 ? 1.0 - none : none;
            const Eight gain = braking ? none : (more * dt - gained * faster[c]) / speed;
            const Eight longer = braking ? (gained * faster[c] - more * elapsed) * over : none;
            const Eight farther = longer * share.value + elapsed * share.slope * gain;
            const Complex sharper{2.0 * more, c == 3 ? 1.0 - none : none};
            const Complex dw = time * sharper + ((farther - time * faster[c]) / speed) * bend;
            const Complex own{c == 0 ? 1.0 - none : none, c == 1 ? 1.0 - none : none};
            const Complex by_step = own * (reach * chord.value) + v * (farther * chord.value + reach * (chord.slope * dw));
            const Complex by_after = own * (slower * turned) + after * Complex{dw.re - gain * slower, dw.im};
            m.F[2 + c] = by_step.re, m.F[8 + c] = by_step.im;
            m.F[14 + c] = by_after.re, m.F[20 + c] = by_after.im;
        }
        scatter(m, v);
    }

    // White jerk along the path and across it.
    VEDETTE_INLINE static void scatter(const Motion& m, Complex v) {
        const double dt = m.dt, cube = dt * dt * dt;
        const double jerk[3][3] = {{cube * dt * dt / 20, cube * dt / 8, cube / 6}, {cube * dt / 8, cube / 3, dt * dt / 2},
                                   {cube / 6, dt * dt / 2, dt}};
        const Eight r = root(v.re * v.re + v.im * v.im), over = 1.0 / (r > 0.0 ? r : 1.0 - Eight{});
        const Eight c = r > 0.0 ? v.re * over : 1.0 - Eight{}, s = v.im * over;
        const Eight t = m.p[0] * m.p[0], n = m.p[1] * m.p[1], mixed = c * s * (t - n);
        const Eight xx = c * c * t + s * s * n, yy = s * s * t + c * c * n;
        for (int i = 0; i < 36; ++i) m.Q[i] = Eight{};
        for (int i = 0; i < 2; ++i) {
            for (int j = 0; j < 2; ++j) {
                const double q = jerk[i][j];
                m.Q[12 * i + 2 * j] = q * xx, m.Q[12 * i + 6 + 2 * j + 1] = q * yy;
                m.Q[12 * i + 2 * j + 1] = m.Q[12 * i + 6 + 2 * j] = q * mixed;
            }
            const double q = jerk[i][2];
            m.Q[12 * i + 4] = m.Q[24 + 2 * i] = q * t * c, m.Q[12 * i + 5] = m.Q[30 + 2 * i] = -q * n * s;
            m.Q[12 * i + 10] = m.Q[24 + 2 * i + 1] = q * t * s, m.Q[12 * i + 11] = m.Q[30 + 2 * i + 1] = q * n * c;
        }
        m.Q[28] = dt * t, m.Q[35] = dt * n;
    }
};

}  // namespace vedette::VEDETTE_ISA
