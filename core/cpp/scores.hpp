// The kernels of a scan, as association.py says them: they branch on what they see, so they take one problem at a time.
#pragma once

#include "modes.hpp"

namespace vedette::VEDETTE_ISA {

// 0 where exp would be below the smallest normal number.
VEDETTE_INLINE double exp_or_zero(double x) { return x < kLeastExponent ? 0.0 : std::exp(x); }

// in: loglik (1+k), distance (k), existence, log density (1|k), [evidence (k)], [sure], [valid (k)]; out: scores (1+k)
struct GateScores : shapes::GateScores {
    static constexpr bool kOneByOne = true;

    void run(const In* in, const Out* out) const {
        const double *loglik = in[0].at, *distance = in[1].at, *density = in[3].at;
        const double *likelier = evidence ? in[4].at : nullptr, *counts = valid ? in[4 + evidence + sure].at : nullptr;
        const double exists = *in[2].at, log_exists = safe_log(exists);
        const bool beyond = sure && *in[4 + evidence].at != 0.0;
        double* scores = out[0].at;
        scores[0] = safe_log(1.0 - exists + exists * std::exp(loglik[0]));
        for (int h = 0; h < k; ++h) {
            double score = loglik[1 + h] - density[per_return ? h : 0] + log_exists;
            if (likelier != nullptr) score += likelier[h];
            const bool met = counts == nullptr || counts[h] != 0.0;
            const bool inside = met && (distance[h] <= limit || (beyond && score > scores[0]));
            scores[1 + h] = inside ? score : -std::numeric_limits<double>::infinity();
        }
    }
};

// in: distance (k), log volume, [valid (k)]; out: log density
struct SampleDensity : shapes::SampleDensity {
    static constexpr bool kOneByOne = true;

    void run(const In* in, const Out* out) const {
        int count = 0;
        for (int h = 0; h < k; ++h) count += in[0].at[h] <= limit && (!valid || in[2].at[h] != 0.0);
        *out[0].at = std::log(count > 1 ? count : 1) - log_ball - *in[1].at;
    }
};

// in: scores (1+k); out: weights (1+k), 1 for the first of the best or each by its probability
struct AssociationWeights : shapes::AssociationWeights {
    static constexpr bool kOneByOne = true;

    void run(const In* in, const Out* out) const {
        const double* scores = in[0].at;
        double* weights = out[0].at;
        int best = 0;
        for (int h = 1; h <= k; ++h)
            if (scores[h] > scores[best]) best = h;
        if (hard) {
            for (int h = 0; h <= k; ++h) weights[h] = h == best;
            return;
        }
        double sum = 0.0;
        const double top = scores[best];
        for (int h = 0; h <= k; ++h) sum += weights[h] = exp_or_zero(scores[h] - top);
        for (int h = 0; h <= k; ++h) weights[h] = normal_or_zero(weights[h] / sum);
    }
};

// in: scores (t, 1+k), weights (t, 1+k), prior (t), loglik (t, 1+k); out: hit (t), existence (t), P_D (t), room (k)
struct Existence : shapes::Existence {
    static constexpr bool kOneByOne = true;

    void run(const In* in, const Out* out) const {
        double* free = out[3].at;
        for (int h = 0; h < k; ++h) free[h] = 1.0;
        for (int i = 0; i < t; ++i) {
            const double *scores = in[0].at + i * (1 + k), *weights = in[1].at + i * (1 + k);
            const double prior = in[2].at[i], miss = exp_or_zero(in[3].at[i * (1 + k)]);
            const double missed = normal_or_zero(prior * miss), absent = 1.0 - prior + missed;
            const double unseen = absent > 0.0 ? missed / absent : 0.0;
            double hit = 0.0, odds = 0.0;
            for (int h = 0; h < k; ++h) {
                const double weight = weights[1 + h];
                if (weight == 0.0) continue;
                hit += exclusive ? weight : weight * free[h];
                const double ratio = scores[1 + h] - scores[0];
                odds += std::exp(ratio < 600.0 ? ratio : 600.0);
                free[h] *= 1.0 - weight;
            }
            const double seen = std::min(hit, odds / (1.0 + odds));
            out[0].at[i] = normal_or_zero(hit);
            out[1].at[i] = normal_or_zero(seen + (1.0 - seen) * unseen);
            out[2].at[i] = (1.0 - miss) / p_gate;
        }
    }
};

}  // namespace vedette::VEDETTE_ISA
