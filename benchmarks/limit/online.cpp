// One target, one scan a call: the Kalman filter with a matrix row a vector, the IMM with a mode a lane.
#include <cmath>
#include "modes.hpp"

namespace {
constexpr int r = 3;
typedef Belief<V4> Modes;  // a mode a lane; the fourth lane repeats the third, with probability 0

struct Rows { V4 x, P[n]; };
// F (n n), H (m n) by entries; Q by rows; R packed
struct RowModel { double F[n * n]; V4 Q[n]; double H[m * n], R[3]; };

inline void transpose(V4* a) {
    typedef int64_t I4 __attribute__((vector_size(32)));
    V4 p = __builtin_shuffle(a[0], a[1], I4{0, 4, 2, 6}), q = __builtin_shuffle(a[0], a[1], I4{1, 5, 3, 7});
    V4 s = __builtin_shuffle(a[2], a[3], I4{0, 4, 2, 6}), t = __builtin_shuffle(a[2], a[3], I4{1, 5, 3, 7});
    a[0] = __builtin_shuffle(p, s, I4{0, 1, 4, 5}), a[1] = __builtin_shuffle(q, t, I4{0, 1, 4, 5});
    a[2] = __builtin_shuffle(p, s, I4{2, 3, 6, 7}), a[3] = __builtin_shuffle(q, t, I4{2, 3, 6, 7});
}

__attribute__((noinline)) double kf(Rows& state, const RowModel& model, const double* z) {
    V4 FP[n], x{};
    for (int i = 0; i < n; i++) {
        V4 row = model.F[i * n] * state.P[0];
        for (int k = 1; k < n; k++) row += model.F[i * n + k] * state.P[k];
        FP[i] = row;
    }
    for (int k = 0; k < n; k++) x += V4{model.F[k], model.F[n + k], model.F[2 * n + k], model.F[3 * n + k]} * state.x[k];
    transpose(FP);  // (F P)' = P F', whose product with F from the left is symmetric
    V4 P[n], cross[m];
    for (int i = 0; i < n; i++) {
        V4 row = model.Q[i];
        for (int k = 0; k < n; k++) row += model.F[i * n + k] * FP[k];
        P[i] = row;
    }
    double nu[m], S[3];
    for (int a = 0; a < m; a++) {
        cross[a] = model.H[a * n] * P[0];
        for (int k = 1; k < n; k++) cross[a] += model.H[a * n + k] * P[k];
        nu[a] = z[a];
        for (int k = 0; k < n; k++) nu[a] -= model.H[a * n + k] * x[k];
    }
    for (int a = 0; a < m; a++)
        for (int c = 0; c <= a; c++) {
            double sum = model.R[at(a, c)];
            for (int k = 0; k < n; k++) sum += cross[a][k] * model.H[c * n + k];
            S[at(a, c)] = sum;
        }
    double det = S[0] * S[2] - S[1] * S[1], over = 1.0 / det, i0 = S[2] * over, i1 = -S[1] * over, i2 = S[0] * over;
    V4 gain[m] = {cross[0] * i0 + cross[1] * i1, cross[0] * i1 + cross[1] * i2};
    state.x = x + gain[0] * nu[0] + gain[1] * nu[1];
    for (int i = 0; i < n; i++) state.P[i] = P[i] - gain[0] * cross[0][i] - gain[1] * cross[1][i];
    double d = nu[0] * (nu[0] * i0 + 2.0 * nu[1] * i1) + nu[1] * nu[1] * i2;
    return -0.5 * (d + std::log(det)) - log_2pi;
}

// Sums over the modes of four vectors: lane i of the result is the sum of a[i].
inline V4 sums(V4 a, V4 b, V4 c, V4 d) {
    V4 all[4] = {a, b, c, d};
    transpose(all);
    return (all[0] + all[1]) + (all[2] + all[3]);
}

// Mean and covariance of the modes under weights, whose lanes are the modes: entries x 0-3, P 4-13.
inline void combine(V4 weight, const Modes& modes, double* out) {
    V4 x = sums(weight * modes.x[0], weight * modes.x[1], weight * modes.x[2], weight * modes.x[3]);
    V4 apart[n], entry[12] = {};
    for (int a = 0; a < n; a++) apart[a] = modes.x[a] - x[a];
    for (int a = 0; a < n; a++)
        for (int c = 0; c <= a; c++) entry[at(a, c)] = weight * (modes.P[at(a, c)] + apart[a] * apart[c]);
    std::memcpy(out, &x, sizeof x);
    for (int i = 0; i < 8; i += 4) {
        V4 four = sums(entry[i], entry[i + 1], entry[i + 2], entry[i + 3]);
        std::memcpy(out + n + i, &four, sizeof four);
    }
    V4 rest = sums(entry[8], entry[9], entry[10], entry[11]);
    std::memcpy(out + n + 8, &rest, 2 * sizeof(double));
}

// `transition` by rows: lane j of row i is the probability of mode j after mode i.
template <bool pda>
__attribute__((noinline)) double imm(Modes& state, V4& probability, const V4* transition, const Model<V4>& models,
                                     const Clutter& clutter, const double* returns, int k, double* out) {
    V4 weight[r], reached{}, d[most_returns], inside[most_returns], z[most_returns][m];
    for (int i = 0; i < r; i++) reached += weight[i] = transition[i] * probability[i];
    V4 over = 1.0 / reached;
    Modes mixed{};
    for (int i = 0; i < r; i++) {
        weight[i] *= over;
        for (int a = 0; a < n; a++) mixed.x[a] += weight[i] * state.x[a][i];
    }
    for (int i = 0; i < r; i++) {
        V4 apart[n];
        for (int a = 0; a < n; a++) apart[a] = state.x[a][i] - mixed.x[a];
        for (int a = 0; a < n; a++) {
            V4 weighted = weight[i] * apart[a];
            for (int c = 0; c <= a; c++) mixed.P[at(a, c)] += weight[i] * state.P[at(a, c)][i] + weighted * apart[c];
        }
    }
    Modes ahead = predicted(mixed, models);
    Look<V4> seen = look(ahead, models);
    for (int i = 0; i < k; i++) {
        z[i][0] = V4{} + returns[m * i], z[i][1] = V4{} + returns[m * i + 1];
        d[i] = seen.squared_distance(z[i][0] - seen.z[0], z[i][1] - seen.z[1]);
    }
    V4 joint;
    double least = 0.0;
    if constexpr (pda) {
        for (int i = 0; i < k; i++) {
            double nearest = d[i][0] < d[i][1] ? d[i][0] : d[i][1];
            nearest = nearest < d[i][2] ? nearest : d[i][2];
            inside[i] = V4{} + (nearest <= clutter.gate ? 1.0 : 0.0);
        }
        V4 likelihood;
        state = associated(ahead, seen, z, d, inside, k, clutter, likelihood);
        joint = reached * likelihood;
    } else {
        least = d[0][0] < d[0][1] ? d[0][0] : d[0][1];
        least = least < d[0][2] ? least : d[0][2];
        joint = reached * exponential(0.5 * (least - d[0])) * root(seen.over_det);
        state = absorbed(ahead, seen, z[0][0] - seen.z[0], z[0][1] - seen.z[1], seen.cross);
    }
    joint[3] = 0.0;
    double total = joint[0] + joint[1] + joint[2];
    probability = joint / total;
    combine(probability, state, out);
    return std::log(total) - 0.5 * least - (pda ? 0.0 : log_2pi);
}

template <bool pda>
void run(const Modes* start, const V4* probability, const V4* transition, const Model<V4>* models, const Clutter* clutter,
         const double* z, int k, long steps, long repeats, double* out, double* loglik) {
    for (long i = 0; i < repeats; i++) {
        Modes state = *start;
        V4 now = *probability;
        for (long s = 0; s < steps; s++) *loglik = imm<pda>(state, now, transition, *models, *clutter, z + s * k * m, k, out);
    }
}
}  // namespace

extern "C" void online_kf(const Rows* start, const RowModel* model, const double* z, long steps, long repeats, Rows* out,
                          double* loglik) {
    for (long i = 0; i < repeats; i++) {
        Rows state = *start;
        for (long s = 0; s < steps; s++) *loglik = kf(state, *model, z + s * m);
        *out = state;
    }
}

extern "C" void online_imm(const Modes* start, const V4* probability, const V4* transition, const Model<V4>* models,
                           const Clutter* clutter, const double* z, int k, long steps, long repeats, double* out,
                           double* loglik) {
    run<false>(start, probability, transition, models, clutter, z, k, steps, repeats, out, loglik);
}

extern "C" void online_imm_pda(const Modes* start, const V4* probability, const V4* transition, const Model<V4>* models,
                               const Clutter* clutter, const double* z, int k, long steps, long repeats, double* out,
                               double* loglik) {
    run<true>(start, probability, transition, models, clutter, z, k, steps, repeats, out, loglik);
}
