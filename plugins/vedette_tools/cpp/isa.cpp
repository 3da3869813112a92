// The smoothing of paths compiled for one instruction set, which the build names: -DVEDETTE_ISA=baseline, avx2, avx512.

#include "lanes.hpp"
#include "paths.hpp"

namespace vedette::VEDETTE_ISA {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity(), kTau = 6.283185307179586;

VEDETTE_INLINE double sum_of(Eight a) {
    double sum = a[0];
    for (int l = 1; l < kLanes; ++l) sum += a[l];
    return sum;
}
VEDETTE_INLINE double least_of(Eight a) {
    double least = a[0];
    for (int l = 1; l < kLanes; ++l) least = a[l] < least ? a[l] : least;
    return least;
}

VEDETTE_INLINE bool all_finite(const double* at, int count) {
    for (int a = 0; a < count; ++a)
        if (!std::isfinite(at[a])) return false;
    return true;
}

// Of a squared distance: Gaussian, but for one report in many whose error is larger.
template <int axes>
VEDETTE_INLINE Eight log_density(Eight d2, Eight S, const Bank& bank) {
    const Eight near = -0.5 * d2, far = std::log(bank.rare / std::pow(bank.wide, axes)) - 0.5 * d2 / (bank.wide * bank.wide);
    const Eight high = near > far ? near : far, low = near > far ? far : near;
    const Eight both = 1.0 + Lane<Eight>::exp(low - high);
    if constexpr (axes == 2)
        return high + Lane<Eight>::log(both / (kTau * S));
    else
        return high + Lane<Eight>::log(both) - 0.5 * axes * Lane<Eight>::log(kTau * S);
}

// A bank of modes, eight side by side, of which those beyond `modes` have no share and lie infinitely far.
template <int axes>
void bank_of(const Bank& bank) {
    const int modes = static_cast<int>(bank.modes);
    Eight density{}, beyond{};
    for (int m = 0; m < kLanes; ++m) density[m] = m < modes ? bank.density[m] : 0.0, beyond[m] = m < modes ? 0.0 : kInfinity;
    const Eight none{};
    for (std::int64_t piece = 0; piece < bank.pieces; ++piece) {
        const double R = bank.noise[piece], R_pace = bank.noise_pace[piece], change = bank.change[piece];
        Eight x[axes], v[axes], p{}, c{}, w{}, mu{}, share{};
        for (int m = 0; m < modes; ++m) share[m] = bank.share[piece * modes + m];
        double missed = 0.0;
        for (std::int64_t row = bank.starts[piece]; row < bank.starts[piece + 1]; ++row) {
            const double *z = bank.spots + row * axes, *pace = bank.velocities + row * axes;
            const double spread = bank.speed[row] * bank.speed[row];
            const auto begin = [&] {
                for (int a = 0; a < axes; ++a) x[a] = none + z[a], v[a] = none;
                p = none + R, c = none, w = none + spread;
            };
            Eight like{}, prior = share;
            bool gross = false;
            if (row == bank.starts[piece]) {
                begin();
            } else {
                prior = (1.0 - change) * mu + change * share;
                Eight dx[axes], dv[axes], xx{}, xv{}, vv{};
                for (int a = 0; a < axes; ++a) {
                    dx[a] = x[a] - sum_of(mu * x[a]), dv[a] = v[a] - sum_of(mu * v[a]);
                    xx += dx[a] * dx[a] / axes, xv += dx[a] * dv[a] / axes, vv += dv[a] * dv[a] / axes;
                }
                const double all_p = sum_of(mu * (p + xx)), all_c = sum_of(mu * (c + xv)), all_w = sum_of(mu * (w + vv));
                const Eight f = change * share / (prior > 0.0 ? prior : 1.0 + none), own = 1.0 - f, g = f * own;
                p = own * p + f * all_p + g * xx, c = own * c + f * all_c + g * xv, w = own * w + f * all_w + g * vv;
                const double h = bank.waits[row];
                Eight off[axes], d2{};
                for (int a = 0; a < axes; ++a) {
                    v[a] -= f * dv[a];
                    x[a] += h * v[a] - f * dx[a];
                }
                p += h * (2.0 * c + h * w) + density * (h * h * h / 3.0), c += h * w + density * (h * h / 2.0), w += density * h;
                const Eight S = p + R;
                for (int a = 0; a < axes; ++a) off[a] = z[a] - x[a], d2 += off[a] * off[a];
                d2 = d2 / S;
                gross = least_of(d2 + beyond) > bank.gate;
                missed = gross ? missed + 1.0 : 0.0;
                like = log_density<axes>(d2, S, bank);
                if (!gross) {
                    const Eight gain = 1.0 / S, left = R * gain;
                    for (int a = 0; a < axes; ++a) x[a] += gain * p * off[a], v[a] += gain * c * off[a];
                    w = Lane<Eight>::maximum(w - gain * c * c, bank.rounding * w), p *= left, c *= left;
                } else if (missed >= bank.again) {
                    missed = 0.0;
                    begin();
                }
            }
            if (all_finite(pace, axes)) {
                const Eight S = w + R_pace;
                Eight off[axes], d2{};
                for (int a = 0; a < axes; ++a) off[a] = pace[a] - v[a], d2 += off[a] * off[a];
                d2 = d2 / S;
                like += log_density<axes>(d2, S, bank);
                if (least_of(d2 + beyond) <= bank.gate) {
                    const Eight gain = 1.0 / S, left = R_pace * gain;
                    for (int a = 0; a < axes; ++a) x[a] += gain * c * off[a], v[a] += gain * w * off[a];
                    p = Lane<Eight>::maximum(p - gain * c * c, bank.rounding * p), c *= left, w *= left;
                }
            }
            like -= beyond;
            const double top = -least_of(-like);
            const Eight joint = prior * Lane<Eight>::exp(like - top);
            const double total = sum_of(joint);
            mu = joint / total;
            bank.loglik[row] = std::log(total) + top;
            bank.gross[row] = gross;
            for (int m = 0; m < modes; ++m)
                bank.prob[row * modes + m] = static_cast<float>(mu[m]), bank.prior[row * modes + m] = static_cast<float>(prior[m]);
        }
        }
}

template <int axes>
void filter(const Smoothed& it, std::int64_t first, std::int64_t last) {
    double x[axes], v[axes], p = it.vague, c = 0.0, w = it.speed[first] * it.speed[first];
    for (std::int64_t row = first; row < last; ++row) {
        const double *z = it.spots + row * axes, *pace = it.velocities + row * axes;
        if (row == first) {
            for (int a = 0; a < axes; ++a) x[a] = z[a], v[a] = 0.0;
        } else {
            const double h = it.waits[row], q = it.density[row];
            for (int a = 0; a < axes; ++a) x[a] += h * v[a];
            p += h * (2.0 * c + h * w) + q * (h * h * h / 3.0), c += h * w + q * (h * h / 2.0), w += q * h;
        }
        double* ahead = it.ahead + 3 * row;
        ahead[0] = p, ahead[1] = c, ahead[2] = w;
        if (std::isfinite(it.noise[row])) {
            const double gain = 1.0 / (p + it.noise[row]), left = gain * it.noise[row];
            for (int a = 0; a < axes; ++a) {
                const double off = z[a] - x[a];
                x[a] += gain * p * off, v[a] += gain * c * off;
            }
            w = Lane<double>::maximum(w - gain * c * c, it.rounding * w), p *= left, c *= left;
        }
        if (std::isfinite(it.noise_pace[row])) {
            const double gain = 1.0 / (w + it.noise_pace[row]), left = gain * it.noise_pace[row];
            for (int a = 0; a < axes; ++a) {
                const double off = pace[a] - v[a];
                x[a] += gain * c * off, v[a] += gain * w * off;
            }
            p = Lane<double>::maximum(p - gain * c * c, it.rounding * p), c *= left, w *= left;
        }
        double *mean = it.mean + 2 * axes * row, *cov = it.cov + 3 * row;
        for (int a = 0; a < axes; ++a) mean[a] = x[a], mean[axes + a] = v[a];
        cov[0] = p, cov[1] = c, cov[2] = w;
    }
}

template <int axes>
void step_back(const Smoothed& it, std::int64_t row) {
    const std::int64_t later = row + 1;
    const double h = it.waits[later], *ahead = it.ahead + 3 * later;
    double *cov = it.cov + 3 * row, *mean = it.mean + 2 * axes * row;
    const double *cov_later = it.cov + 3 * later, *mean_later = it.mean + 2 * axes * later;
    const double p = cov[0], c = cov[1], w = cov[2], b0 = ahead[0], b1 = ahead[1], b2 = ahead[2];
    // G = P F' A^-1, with P F' = [[p + h c, c], [c + h w, w]]
    const double det = b0 * b2 - b1 * b1, scale = det > 0.0 ? 1.0 / det : 0.0;
    const double up = p + h * c, low = c + h * w;
    const double g00 = (up * b2 - c * b1) * scale, g01 = (c * b0 - up * b1) * scale;
    const double g10 = (low * b2 - w * b1) * scale, g11 = (w * b0 - low * b1) * scale;
    for (int a = 0; a < axes; ++a) {
        const double apart = mean_later[a] - (mean[a] + h * mean[axes + a]), faster = mean_later[axes + a] - mean[axes + a];
        mean[a] += g00 * apart + g01 * faster, mean[axes + a] += g10 * apart + g11 * faster;
    }
    const double a = cov_later[0] - b0, b = cov_later[1] - b1, d = cov_later[2] - b2;
    cov[0] = Lane<double>::maximum(p + g00 * g00 * a + 2.0 * g00 * g01 * b + g01 * g01 * d, it.rounding * p);
    cov[1] = c + g00 * g10 * a + (g00 * g11 + g01 * g10) * b + g01 * g11 * d;
    cov[2] = Lane<double>::maximum(w + g10 * g10 * a + 2.0 * g10 * g11 * b + g11 * g11 * d, it.rounding * w);
}

template <int axes>
void smoothed_of(const Smoothed& it) {
    for (std::int64_t piece = 0; piece < it.pieces; ++piece) {
        const std::int64_t first = it.starts[piece], last = it.starts[piece + 1];
        if (first == last) continue;
        filter<axes>(it, first, last);
        for (std::int64_t row = last - 2; row >= first; --row) step_back<axes>(it, row);
    }
}

void after_of(const After& it) {
    for (std::int64_t piece = 0; piece < it.pieces; ++piece) {
        const double *share = it.share + piece * it.modes, change = it.change[piece];
        for (std::int64_t row = it.starts[piece + 1] - 2; row >= it.starts[piece]; --row) {
            double ratio[kMostBankModes], shared = 0.0, total = 0.0;
            double *prob = it.prob + row * it.modes, *later = prob + it.modes;
            const double* prior = it.prior + (row + 1) * it.modes;
            for (int m = 0; m < it.modes; ++m) {
                ratio[m] = later[m] / (prior[m] > it.least ? prior[m] : it.least);
                shared += ratio[m] * share[m];
            }
            for (int m = 0; m < it.modes; ++m) {
                prob[m] *= (1.0 - change) * ratio[m] + change * shared;
                total += prob[m];
            }
            for (int m = 0; m < it.modes; ++m) prob[m] /= total;
        }
    }
}

}  // namespace

extern const Paths paths;
const Paths paths = {{bank_of<1>, bank_of<2>}, {smoothed_of<1>, smoothed_of<2>}, after_of};

}  // namespace vedette::VEDETTE_ISA
