// The stages of a Kalman filter with 4 states and 2 measured axes, on lanes: each lane is another track or another mode.
// Coefficients C are doubles where the lanes share a model, or vectors where each lane has its own. F, H are dense.
#pragma once
#include "lanes.hpp"

// A stage that stands apart keeps its registers; inlined into a long function it spills them, and is a tenth slower.
#define APART __attribute__((noinline)) inline

constexpr int n = 4, m = 2, packed = 10;
constexpr double log_2pi = 1.8378770664093453;

constexpr int at(int i, int j) { return i >= j ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i; }

template <class V> struct Belief { V x[n], P[packed]; };

// F (n n), Q (packed), H (m n), R (packed)
template <class C> struct Model { C F[n * n], Q[packed], H[m * n], R[3]; };

// x = F x, P = F P F' + Q
template <class V, class C> APART Belief<V> predicted(const Belief<V>& b, const Model<C>& model) {
    Belief<V> after;
    V FP[n][n];
    for (int i = 0; i < n; i++) {
        V sum = model.F[i * n] * b.x[0];
        for (int k = 1; k < n; k++) sum += model.F[i * n + k] * b.x[k];
        after.x[i] = sum;
        for (int j = 0; j < n; j++) {
            V entry = model.F[i * n] * b.P[at(0, j)];
            for (int k = 1; k < n; k++) entry += model.F[i * n + k] * b.P[at(k, j)];
            FP[i][j] = entry;
        }
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            V entry = V{} + model.Q[at(i, j)];
            for (int k = 0; k < n; k++) entry += FP[i][k] * model.F[j * n + k];
            after.P[at(i, j)] = entry;
        }
    return after;
}

// What is expected to be seen: z, S, its inverse and the inverse of its determinant, and the gain.
template <class V> struct Look {
    V z[m], S[3], inverse[3], over_det, cross[n][m], gain[n][m];  // cross = P H' = K S
    V squared_distance(V a, V b) const { return a * (a * inverse[0] + 2.0 * b * inverse[1]) + b * b * inverse[2]; }
};

template <class V, class C> APART Look<V> look(const Belief<V>& b, const Model<C>& model) {
    Look<V> seen;
    V(&cross)[n][m] = seen.cross;
    for (int a = 0; a < m; a++) {
        V sum = model.H[a * n] * b.x[0];
        for (int k = 1; k < n; k++) sum += model.H[a * n + k] * b.x[k];
        seen.z[a] = sum;
        for (int i = 0; i < n; i++) {
            V entry = model.H[a * n] * b.P[at(i, 0)];
            for (int k = 1; k < n; k++) entry += model.H[a * n + k] * b.P[at(i, k)];
            cross[i][a] = entry;
        }
    }
    for (int a = 0; a < m; a++)
        for (int c = 0; c <= a; c++) {
            V entry = V{} + model.R[at(a, c)];
            for (int k = 0; k < n; k++) entry += model.H[a * n + k] * cross[k][c];
            seen.S[at(a, c)] = entry;
        }
    V over = seen.over_det = 1.0 / (seen.S[0] * seen.S[2] - seen.S[1] * seen.S[1]);
    seen.inverse[0] = seen.S[2] * over;
    seen.inverse[1] = -seen.S[1] * over;
    seen.inverse[2] = seen.S[0] * over;
    for (int i = 0; i < n; i++)
        for (int a = 0; a < m; a++) seen.gain[i][a] = cross[i][0] * seen.inverse[at(0, a)] + cross[i][1] * seen.inverse[at(1, a)];
    return seen;
}

// x + K (first, second)', P - K L' with L = K A: cross for one return, K ((1 - beta_0) S - spread) under PDA
template <class V> inline Belief<V> absorbed(const Belief<V>& b, const Look<V>& seen, V first, V second, const V (*L)[m]) {
    Belief<V> after;
    for (int i = 0; i < n; i++) {
        after.x[i] = b.x[i] + seen.gain[i][0] * first + seen.gain[i][1] * second;
        for (int j = 0; j <= i; j++) after.P[at(i, j)] = b.P[at(i, j)] - seen.gain[i][0] * L[j][0] - seen.gain[i][1] * L[j][1];
    }
    return after;
}

// Clutter of uniform density, one target seen with probability `detect`, a gate on the squared distance.
struct Clutter { double detect, missed, density, gate; };
