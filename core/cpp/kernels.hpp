// The list of kernels, the sizes that a kernel's problems share, and where a batch of them lies in memory.
#pragma once

#include <cstddef>

namespace vedette {

constexpr int kLanes = 8;
constexpr int kMostStates = 12, kMostMeasured = 6, kMostModes = 6, kMostReturns = 64, kMostPoints = 2 * kMostStates + 1;
constexpr int kStates2 = kMostStates * kMostStates, kMeasured2 = kMostMeasured * kMostMeasured;
constexpr int kMostParticles = 1 << 20;
constexpr int kMostTaken = 4, kMostParameters = 128;  // returns of `scan_step`, numbers of a twin
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

// Of the axes that a sensor observes: what it measures, derivative, noise, and probability of detection (twins.hpp).
using SensorTwin = void (*)(int count, const double* x, const double* parameters, double* z, double* slope, double* noise,
                            double* detects, void* data);

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
struct ScanStep {
    int n, m, k;
    bool best;
    double log_miss, log_detect, limit;  // log_detect less the clutter's log density
    Periods periods;
};
struct ScanStepTwin {
    int n, m, k;
    bool best;
    double p_gate, log_density, limit;
    Periods periods;
    SensorTwin function;
    void* data;
    int parameters, observed, axes[kMostStates], column[kMostStates];  // column: of each state's axis among those observed, or -1
};
struct EvaluateReturns {
    int n, m, k, noises;
    double p_gate;
    Periods periods;
};
struct WeightedUpdate {
    int n, k;
    bool shared;
    Periods periods;
};
struct Whiten {
    int n;
};
struct SmoothLinear {
    int n;
    Periods periods;
};
struct SigmaPoints {
    int n;
    double scale;
};
struct EvaluatePoints {
    int n, m, k, s, noises;
};
struct EvaluateParticles {
    int p, m, k, noises, detected;
    double p_gate;
    Periods periods;
};
struct ReweighParticles {
    int p, k;
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
struct MixModes {
    bool same;  // all modes have all axes, in order
    int n, r, sizes[kMostModes], own[kMostModes][kMostStates];
    double absent[2 * kMostStates];
    Periods periods;
};
struct MixtureMoments {
    MixModes bank;
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
    bool evidence, per_return, valid, sure;
};
struct SampleDensity {
    int k;
    double limit, log_ball;
    bool valid;
};
struct AssociationWeights {
    int k;
    bool hard;
};
struct Existence {
    int t, k;
    double p_gate;
    bool exclusive;
};

}  // namespace shapes

// The list of kernels: the name that Python calls each by, how many arguments it takes, and its shape, whose name its struct has.
#define VEDETTE_KERNELS(kernel)                    \
    kernel(predict, 4, Predict)                    \
    kernel(propagate, 3, Propagate)                \
    kernel(update, 5, Update)                      \
    kernel(filter_step, 7, Update)                 \
    kernel(scan_step, 13, ScanStep)                \
    kernel(scan_step_twin, 13, ScanStepTwin)       \
    kernel(evaluate_returns, 8, EvaluateReturns)   \
    kernel(weighted_update, 6, WeightedUpdate)     \
    kernel(whiten, 2, Whiten)                      \
    kernel(smooth_linear, 7, SmoothLinear)         \
    kernel(sigma_points, 2, SigmaPoints)           \
    kernel(evaluate_points, 5, EvaluatePoints)     \
    kernel(evaluate_particles, 7, EvaluateParticles) \
    kernel(reweigh_particles, 4, ReweighParticles) \
    kernel(pda_update, 9, PdaUpdate)               \
    kernel(imm_mix, 4, ImmMix)                     \
    kernel(imm_combine, 4, ImmCombine)             \
    kernel(mix_modes, 7, MixModes)                 \
    kernel(mixture_moments, 6, MixtureMoments)     \
    kernel(weigh_modes, 2, WeighModes)             \
    kernel(split_weights, 2, SplitWeights)         \
    kernel(gate_scores, 8, GateScores)             \
    kernel(sample_density, 5, SampleDensity)       \
    kernel(softmax, 1, AssociationWeights)         \
    kernel(one_hot, 1, AssociationWeights)         \
    kernel(existence, 6, Existence)

// Those that are no loop over problems: the module does them itself.
#define VEDETTE_FUNCTIONS(kernel) \
    kernel(best_joint, 3) kernel(cancels, 3) kernel(claimed, 2) kernel(evaluate_points_twin, 11) \
    kernel(evaluate_root_twin, 9) kernel(evaluate_twin, 9) kernel(given_existence, 4) kernel(grow, 11) kernel(if_existing, 3) kernel(is_plain, 4) \
    kernel(iterate_twin, 11) kernel(predict_root_twin, 6) kernel(lower_triangular, 1) \
    kernel(joint_weights, 2) kernel(k_best, 2) kernel(linked_clusters, 4) kernel(measure_twin, 4) kernel(move_twin, 5) \
    kernel(normals, 2) kernel(over_axes, 2) kernel(pairs_in_boxes, 5) kernel(predict_points_twin, 7) \
    kernel(predict_twin, 6) kernel(root, 1) kernel(shed, 7) kernel(target_existence, 6) kernel(uniforms, 2) kernel(wide_clusters, 2)

// The kernels of one instruction set.
struct Table {
#define VEDETTE_POINTER(name, arguments, Shape) void (*name)(const Batch&, const shapes::Shape&);
    VEDETTE_KERNELS(VEDETTE_POINTER)
#undef VEDETTE_POINTER
};

}  // namespace vedette
