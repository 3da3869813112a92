// What the smoothing of many paths computes row by row, one piece after another: smoothing/modes.py and smoothing/linear.py say the
// same in numpy. Arrays are dense, as they stand there; `starts` are where the `pieces` begin and the last ends.
#pragma once

#include <cstdint>

namespace vedette {

constexpr int kMostBankModes = 8;

struct Bank {
    std::int64_t pieces, modes;
    const std::int64_t* starts;
    const double *waits, *spots, *velocities, *speed;  // of rows; velocities NaN where none is reported
    const double* density;                             // of modes
    const double *share, *change, *noise, *noise_pace;  // of pieces: share also of modes, noises are variances
    double gate, again, wide, rare, rounding;
    double* loglik;
    float *prob, *prior;
    bool* gross;
};

struct Smoothed {
    std::int64_t pieces;
    const std::int64_t* starts;
    const double *waits, *spots, *velocities, *speed, *density, *noise, *noise_pace;  // noises inf where nothing is reported
    double vague, rounding;
    double *mean, *cov, *ahead;
};

struct After {
    std::int64_t pieces, modes;
    const std::int64_t* starts;
    const double *prior, *share, *change;  // share and change of pieces
    double least;
    double* prob;  // by the reports until each row, then by all
};

// By the number of axes, 1 or 2.
struct Paths {
    void (*bank[2])(const Bank&);
    void (*smoothed[2])(const Smoothed&);
    void (*after)(const After&);
};

}  // namespace vedette
