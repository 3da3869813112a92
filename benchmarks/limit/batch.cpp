// Batches: eight tracks a vector, blocks of [state][8] (array of structures of arrays), one pass over memory a scan.
#include "modes.hpp"

namespace {
constexpr int r = 3;
struct Block { Belief<V8> mode[r]; V8 probability[r]; };

// The modes as seen from the first one's mean: there, moments of mixtures are sums without loss of digits.
struct Spread {
    V8 origin[n], apart[r][n], second[r][packed];
    explicit Spread(const Belief<V8>* mode) {
        for (int a = 0; a < n; a++) origin[a] = mode[0].x[a];
        for (int i = 0; i < r; i++)
            for (int a = 0; a < n; a++) {
                if (i) apart[i][a] = mode[i].x[a] - origin[a];
                for (int c = 0; c <= a; c++)
                    second[i][at(a, c)] = i ? mode[i].P[at(a, c)] + apart[i][a] * apart[i][c] : mode[i].P[at(a, c)];
            }
    }
    Belief<V8> mixed(const V8* weight) const {
        Belief<V8> all;
        V8 mean[n];
        for (int a = 0; a < n; a++) {
            mean[a] = weight[1] * apart[1][a];
            for (int i = 2; i < r; i++) mean[a] += weight[i] * apart[i][a];
            all.x[a] = origin[a] + mean[a];
            for (int c = 0; c <= a; c++) {
                V8 sum = weight[0] * second[0][at(a, c)];
                for (int i = 1; i < r; i++) sum += weight[i] * second[i][at(a, c)];
                all.P[at(a, c)] = sum - mean[a] * mean[c];
            }
        }
        return all;
    }
};

// `before` may be `after`.
template <bool pda>
inline void imm_block(const Block& before, Block& after, const double* transition, const Model<double>* models,
                      const Clutter& clutter, const V8 (*z)[m], int k, Belief<V8>& out, V8& loglik) {
    V8 predicted_probability[r], d[r][most_returns], inside[most_returns];
    Look<V8> seen[r];
    const Spread spread(before.mode);
    for (int j = 0; j < r; j++) {
        V8 weight[r], sum{};
        for (int i = 0; i < r; i++) sum += weight[i] = transition[i * r + j] * before.probability[i];
        V8 over = 1.0 / sum;
        for (int i = 0; i < r; i++) weight[i] *= over;
        predicted_probability[j] = sum;
        after.mode[j] = predicted(spread.mixed(weight), models[j]);
        seen[j] = look(after.mode[j], models[j]);
        for (int i = 0; i < k; i++) d[j][i] = seen[j].squared_distance(z[i][0] - seen[j].z[0], z[i][1] - seen[j].z[1]);
    }
    V8 joint[r], total{}, least{};
    if constexpr (pda) {
        for (int i = 0; i < k; i++) inside[i] = lesser(lesser(d[0][i], d[1][i]), d[2][i]) <= clutter.gate ? V8{} + 1.0 : V8{};
        for (int j = 0; j < r; j++) {
            V8 likelihood;
            after.mode[j] = associated(after.mode[j], seen[j], z, d[j], inside, k, clutter, likelihood);
            total += joint[j] = predicted_probability[j] * likelihood;
        }
    } else {
        least = lesser(lesser(d[0][0], d[1][0]), d[2][0]);
        for (int j = 0; j < r; j++) {
            total += joint[j] = predicted_probability[j] * exponential(0.5 * (least - d[j][0])) * root(seen[j].over_det);
            V8 u = z[0][0] - seen[j].z[0], v = z[0][1] - seen[j].z[1];
            after.mode[j] = absorbed(after.mode[j], seen[j], u, v, seen[j].cross);
        }
    }
    V8 over = 1.0 / total;
    for (int j = 0; j < r; j++) after.probability[j] = joint[j] * over;
    out = Spread(after.mode).mixed(after.probability);
    loglik = logarithm(total) - 0.5 * least - (pda ? 0.0 : log_2pi);
}

template <bool pda>
void imm(const double* transition, const Model<double>* models, const Clutter* clutter, const Block* start, const V8* z, int k,
         long blocks, long steps, Block* state, Belief<V8>* out, V8* loglik) {
    for (long step = 0; step < steps; step++)
        for (long b = 0; b < blocks; b++)
            imm_block<pda>(step ? state[b] : start[b], state[b], transition, models, *clutter,
                           reinterpret_cast<const V8(*)[m]>(z + (step * blocks + b) * k * m), k, out[b], loglik[b]);
}
}  // namespace

extern "C" void batch_kf(const Model<double>* model, const Belief<V8>* start, const V8* z, long blocks, long steps,
                         Belief<V8>* state, V8* loglik) {
    for (long step = 0; step < steps; step++)
        for (long b = 0; b < blocks; b++) {
            Belief<V8> ahead = predicted(step ? state[b] : start[b], *model);
            Look<V8> seen = look(ahead, *model);
            const V8* own = z + (step * blocks + b) * m;
            V8 u = own[0] - seen.z[0], v = own[1] - seen.z[1];
            state[b] = absorbed(ahead, seen, u, v, seen.cross);
            loglik[b] = -0.5 * (seen.squared_distance(u, v) - logarithm(seen.over_det)) - log_2pi;
        }
}

namespace {
// Range and bearing from the origin, by their derivative at the mean: R holds their variances, H has its zeros left out.
APART Look<V8> look_at_polar(const Belief<V8>& b, const Model<double>& model) {
    Look<V8> seen;
    V8 range = root(b.x[0] * b.x[0] + b.x[1] * b.x[1]), over = 1.0 / range, east = b.x[0] * over, north = b.x[1] * over;
    V8 H[m][2] = {{east, north}, {-north * over, east * over}};
    seen.z[0] = range, seen.z[1] = angle(b.x[1], b.x[0]);
    for (int a = 0; a < m; a++)
        for (int i = 0; i < n; i++) seen.cross[i][a] = H[a][0] * b.P[at(i, 0)] + H[a][1] * b.P[at(i, 1)];
    for (int a = 0; a < m; a++)
        for (int c = 0; c <= a; c++)
            seen.S[at(a, c)] = H[a][0] * seen.cross[0][c] + H[a][1] * seen.cross[1][c] + model.R[at(a, c)];
    V8 over_det = seen.over_det = 1.0 / (seen.S[0] * seen.S[2] - seen.S[1] * seen.S[1]);
    seen.inverse[0] = seen.S[2] * over_det, seen.inverse[1] = -seen.S[1] * over_det, seen.inverse[2] = seen.S[0] * over_det;
    for (int i = 0; i < n; i++)
        for (int a = 0; a < m; a++)
            seen.gain[i][a] = seen.cross[i][0] * seen.inverse[at(0, a)] + seen.cross[i][1] * seen.inverse[at(1, a)];
    return seen;
}
}  // namespace

extern "C" void batch_ekf(const Model<double>* model, const Belief<V8>* start, const V8* z, long blocks, long steps,
                          Belief<V8>* state, V8* loglik) {
    const double turn = 6.283185307179586, shifter = 6755399441055744.0;
    for (long step = 0; step < steps; step++)
        for (long b = 0; b < blocks; b++) {
            Belief<V8> ahead = predicted(step ? state[b] : start[b], *model);
            Look<V8> seen = look_at_polar(ahead, *model);
            const V8* own = z + (step * blocks + b) * m;
            V8 u = own[0] - seen.z[0], v = own[1] - seen.z[1];
            v -= turn * ((v * (1.0 / turn) + shifter) - shifter);
            state[b] = absorbed(ahead, seen, u, v, seen.cross);
            loglik[b] = -0.5 * (seen.squared_distance(u, v) - logarithm(seen.over_det)) - log_2pi;
        }
}

// What `batch_ekf` spends on its angles and ranges alone.
extern "C" void batch_polar(const V8* x, long blocks, long times, V8* out) {
    for (long time = 0; time < times; time++)
        for (long b = 0; b < blocks; b++) {
            out[2 * b] = root(x[2 * b] * x[2 * b] + x[2 * b + 1] * x[2 * b + 1]);
            out[2 * b + 1] = angle(x[2 * b + 1], x[2 * b]);
        }
}

extern "C" void batch_imm(const double* transition, const Model<double>* models, const Clutter* clutter, const Block* start,
                          const V8* z, int k, long blocks, long steps, Block* state, Belief<V8>* out, V8* loglik) {
    imm<false>(transition, models, clutter, start, z, k, blocks, steps, state, out, loglik);
}

extern "C" void batch_imm_pda(const double* transition, const Model<double>* models, const Clutter* clutter, const Block* start,
                              const V8* z, int k, long blocks, long steps, Block* state, Belief<V8>* out, V8* loglik) {
    imm<true>(transition, models, clutter, start, z, k, blocks, steps, state, out, loglik);
}
