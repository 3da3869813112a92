// The sizes that a kernel's problems share, and where a batch of them lies in memory.
#pragma once

#include <cstddef>

namespace vedette {

constexpr int kLanes = 8;
constexpr int kMostStates = 12, kMostMeasured = 6, kMostModes = 6, kMostReturns = 64, kMostPoints = 2 * kMostStates + 1;
constexpr int kStates2 = kMostStates * kMostStates, kMeasured2 = kMostMeasured * kMostMeasured;
constexpr int kMostDims = 8, kMostOperands = 2 + 4 * kMostModes;

// Arrays of a batch: the address of one problem's, and the distance in doubles to the next problem's.
struct In {
    const double* at;
    std::ptrdiff_t next;
};
struct Out {
    double* at;
    std::ptrdiff_t next;
};

// The batch's axes, and each operand's address and distances along them, in doubles; 0 where it is shared.
struct Batch {
    int dims = 0, ins = 0, outs = 0;
    std::ptrdiff_t shape[kMostDims];
    const double* in[kMostOperands];
    std::ptrdiff_t in_steps[kMostOperands][kMostDims];
    double* out[kMostOperands];
    std::ptrdiff_t out_size[kMostOperands];  // outputs are new, so one after another
    std::ptrdiff_t places[kMostDims];        // how many problems apart two are that are neighbours along an axis
};

struct Period {
    int axis;
    double period;
};
struct Periods {
    int count = 0;
    Period each[kMostStates];
};

namespace shapes {

struct Predict {
    int n;
};
struct Propagate {
    int n;
};
struct Update {
    int n, m;
    bool step;
};
struct InnovateReturns {
    int n, m, k, noises;
    double p_gate;
    Periods periods;
};
struct Absorb {
    int n, k;
    bool shared;
    Periods periods;
};
struct Whiten {
    int n;
};
struct SigmaPoints {
    int n;
    double scale;
};
struct InnovatePoints {
    int n, m, k, s, noises;
};
struct PdaUpdate {
    int n, m, k, r;
    double p_detect, p_gate, limit, log_density;
};
struct ImmMix {
    int n, r;
};
struct ImmCombine {
    int n, r;
};
struct Interact {
    bool same;  // all modes have all axes, in order
    int n, r, sizes[kMostModes], own[kMostModes][kMostStates];
    double absent[2 * kMostStates];
    Periods periods;
};
struct Together {
    Interact bank;
};
struct WeighModes {
    int k, r;
};
struct SplitWeights {
    int k, r;
};
struct GateScores {
    int k;
    double limit;
    bool evidence, per_return, valid;
};
struct SampleDensity {
    int k;
    double limit, log_ball;
    bool valid;
};
struct Choose {
    int k;
    bool hard;
};
struct Existence {
    int t, k;
    double p_gate;
    bool exclusive;
};

}  // namespace shapes

// The kernels of one instruction set.
struct Table {
    void (*predict)(const Batch&, const shapes::Predict&);
    void (*propagate)(const Batch&, const shapes::Propagate&);
    void (*update)(const Batch&, const shapes::Update&);
    void (*evaluate_returns)(const Batch&, const shapes::InnovateReturns&);
    void (*weighted_update)(const Batch&, const shapes::Absorb&);
    void (*whiten)(const Batch&, const shapes::Whiten&);
    void (*sigma_points)(const Batch&, const shapes::SigmaPoints&);
    void (*evaluate_points)(const Batch&, const shapes::InnovatePoints&);
    void (*pda_update)(const Batch&, const shapes::PdaUpdate&);
    void (*imm_mix)(const Batch&, const shapes::ImmMix&);
    void (*imm_combine)(const Batch&, const shapes::ImmCombine&);
    void (*interact)(const Batch&, const shapes::Interact&);
    void (*together)(const Batch&, const shapes::Together&);
    void (*weigh_modes)(const Batch&, const shapes::WeighModes&);
    void (*split_weights)(const Batch&, const shapes::SplitWeights&);
    void (*gate_scores)(const Batch&, const shapes::GateScores&);
    void (*sample_density)(const Batch&, const shapes::SampleDensity&);
    void (*choose)(const Batch&, const shapes::Choose&);
    void (*existence)(const Batch&, const shapes::Existence&);
};

}  // namespace vedette
