// The kernels' results on seeded numbers, eight problems at a time and one, a line each: `nox -s arm64` compares those of two
// processors.
#include <cstdint>
#include <cstdio>
#include <vector>

#include "imm.hpp"
#include "points.hpp"
#include "scores.hpp"

using namespace vedette;
using namespace vedette::VEDETTE_ISA;

namespace {

// Between -1 and 1.
double drawn() {
    static std::uint64_t state = 88172645463325252u;
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return static_cast<double>(state >> 11) * 0x1p-52 - 1.0;
}

// `size` numbers for each of eight problems, or for all of them.
struct Numbers {
    int size;
    bool shared;
    std::vector<double> all;

    explicit Numbers(int size_, bool shared_ = false) : size(size_), shared(shared_), all(size_ * (shared_ ? 1 : kLanes)) {
        for (double& number : all) number = drawn();
    }
    operator In() const { return {all.data(), shared ? 0 : size}; }
};

// `count` positive definite matrices for each of eight problems, or for all of them.
Numbers covariances(int n, int count = 1, bool shared = false) {
    Numbers made(count * n * n, shared);
    for (std::size_t from = 0; from < made.all.size(); from += n * n) {
        const std::vector<double> root(made.all.begin() + from, made.all.begin() + from + n * n);
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j) {
                double sum = i == j ? 0.5 : 0.0;
                for (int l = 0; l < n; ++l) sum += root[i * n + l] * root[j * n + l];
                made.all[from + i * n + j] = sum;
            }
    }
    return made;
}

template <class Kernel, class Shape>
void show(const char* name, Shape shape, std::vector<In> in, std::vector<int> sizes) {
    const Kernel kernel{shape};
    for (int lanes : {kLanes, 1}) {
        std::vector<std::vector<double>> found;
        std::vector<Out> out;
        for (int size : sizes) {
            found.emplace_back(lanes * size);
            out.push_back({found.back().data(), size});
        }
        if (lanes == kLanes)
            kernel.template run<Eight>(in.data(), out.data());
        else
            kernel.template run<double>(in.data(), out.data());
        for (const auto& numbers : found)
            for (double number : numbers) std::printf("%s %.17g\n", name, number);
    }
}

void show_all(int n, int m) {
    const int k = 4, r = 3, s = 2 * n + 1;
    const Numbers x(n), F(n * n, true), H(m * n, true), z(m), returns(k * m), xs(r * n), log_prob(r), loglik(r);
    const Numbers switching(r * r, true), dx(s * n), dz(s * m), P = covariances(n), Q = covariances(n, 1, true);
    const Numbers R = covariances(m, 1, true), Ps = covariances(n, r);
    Numbers weights(s, true);
    for (double& weight : weights.all) weight = 0.1 + weight * weight;
    show<Predict>("predict", shapes::Predict{n}, {x, P, F, Q}, {n, n * n});
    show<Update>("update", shapes::Update{n, m, false}, {x, P, z, H, R}, {n, n * n, 1});
    show<Update>("filter_step", shapes::Update{n, m, true}, {x, P, F, Q, z, H, R}, {n, n * n, 1});
    show<PdaUpdate>("pda_update", shapes::PdaUpdate{n, m, k, r, 0.9, 0.99, 9.0, -2.0}, {xs, Ps, returns, H, R},
                    {r * n, r * n * n, r});
    show<ImmMix>("imm_mix", shapes::ImmMix{n, r}, {log_prob, switching, xs, Ps}, {r, r * n, r * n * n});
    show<ImmCombine>("imm_combine", shapes::ImmCombine{n, r}, {log_prob, loglik, xs, Ps}, {r, n, n * n, 1});
    show<SigmaPoints>("sigma_points", shapes::SigmaPoints{n, n + 1.0}, {P}, {s * n});
    show<EvaluatePoints>("evaluate_points", shapes::EvaluatePoints{n, m, k, s, 1}, {dx, dz, weights, returns, R},
                         {k, k, 1, k * n, n * n});
    show<Whiten>("whiten", shapes::Whiten{n}, {x, P}, {n});
}

}  // namespace

int main() {
    const int sizes[][2] = {{4, 2}, {5, 2}, {6, 2}, {2, 1}, {3, 2}, {7, 3}, {12, 6}};
    for (const auto& size : sizes) show_all(size[0], size[1]);
}
