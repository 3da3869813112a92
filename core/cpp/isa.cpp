// The kernels compiled for one instruction set, which the build names: -DVEDETTE_ISA=baseline, avx2, avx512.

#include "imm.hpp"
#include "particles.hpp"
#include "points.hpp"
#include "scan_step.hpp"
#include "scores.hpp"

#include <cstdint>
#ifdef __SSE2__
#include <immintrin.h>
#endif

namespace vedette::VEDETTE_ISA {

namespace {

// Problems that are taken along the last axis before those beside them on the other axes, which often lie in the same places of
// the cache: the modes of a track.
constexpr std::ptrdiff_t kTile = 512;

// A kernel that says so takes one problem at a time, others eight as well.
template <class Kernel, class = void>
constexpr bool one_by_one = false;
template <class Kernel>
constexpr bool one_by_one<Kernel, std::enable_if_t<Kernel::kOneByOne>> = true;

// A function of its own: inlined wherever it is called, it would be compiled twice.
template <class Kernel>
__attribute__((noinline)) void run_large(const Kernel& kernel, const In* in, const Out* out) {
    kernel.template run<double>(in, out);
}
template <class Kernel>
VEDETTE_INLINE void run_one(const Kernel& kernel, const In* in, const Out* out) {
    if constexpr (one_by_one<Kernel>)
        kernel.run(in, out);
    else
        run_large(kernel, in, out);
}

// Where eight problems' results are made when those of the whole batch fit into no cache: from here they go to memory in whole
// lines, which the processor then need not read before it writes them.
struct Streamed {
    static constexpr std::ptrdiff_t kLeast = std::ptrdiff_t(1) << 20, kMost = 1 << 11, kLine = 64;  // numbers, numbers, bytes
    alignas(kLine) double room[kMost];
    bool wanted = false;

    explicit Streamed(const Batch& batch, std::ptrdiff_t problems) {
#ifdef __SSE2__
        std::ptrdiff_t size = 0;
        for (int o = 0; o < batch.outs; ++o) size += batch.out_size[o];
        wanted = problems * size >= kLeast && kLanes * size <= kMost;
#endif
    }

    // Whether the outputs lie one after another, in whole lines.
    bool fits(const Batch& batch, const Out* out) const {
        bool good = wanted;
        for (int o = 0; o < batch.outs; ++o)
            good = good && out[o].next == batch.out_size[o] && reinterpret_cast<std::uintptr_t>(out[o].at) % kLine == 0;
        return good;
    }

    // Sends what was made for `out` on, and gives the place of the next output's.
    VEDETTE_INLINE static const double* send(const double* made, const Out& out, std::ptrdiff_t size) {
#ifdef __AVX__
        for (std::ptrdiff_t i = 0; i < kLanes * size; i += 4) _mm256_stream_pd(out.at + i, _mm256_load_pd(made + i));
#elif defined(__SSE2__)
        for (std::ptrdiff_t i = 0; i < kLanes * size; i += 2) _mm_stream_pd(out.at + i, _mm_load_pd(made + i));
#endif
        return made + kLanes * size;
    }
};

// One problem after another along the batch; eight at a time along its last axis, which is the longest.
template <class Kernel, class Shape>
void run_batch(const Batch& batch, const Shape& shape) {
    const Kernel kernel{shape};
    In in[kMostOperands];
    Out out[kMostOperands];
    if (batch.dims == 0) {
        for (int i = 0; i < batch.ins; ++i) in[i] = {batch.in[i], 0};
        for (int o = 0; o < batch.outs; ++o) out[o] = {batch.out[o], 0};
        return run_one(kernel, in, out);
    }
    const int last = batch.dims - 1;
    const std::ptrdiff_t length = batch.shape[last];
    std::ptrdiff_t rows = 1, index[kMostDims] = {};
    for (int d = 0; d < last; ++d) rows *= batch.shape[d];
    Streamed streamed(batch, rows * length);
    for (std::ptrdiff_t from = 0; from < length; from += kTile) {
        const std::ptrdiff_t count = length - from < kTile ? length - from : kTile;
        for (std::ptrdiff_t row = 0; row < rows; ++row) {
            for (int i = 0; i < batch.ins; ++i) {
                const std::ptrdiff_t next = batch.in_steps[i][last];
                std::ptrdiff_t offset = from * next;
                for (int d = 0; d < last; ++d) offset += index[d] * batch.in_steps[i][d];
                in[i] = {batch.in[i] + offset, next};
            }
            std::ptrdiff_t place = from * batch.places[last];
            for (int d = 0; d < last; ++d) place += index[d] * batch.places[d];
            for (int o = 0; o < batch.outs; ++o)
                out[o] = {batch.out[o] + place * batch.out_size[o], batch.places[last] * batch.out_size[o]};
            std::ptrdiff_t i = 0;
            const bool streams = streamed.fits(batch, out);
            if (streams || !one_by_one<Kernel>)
                for (; i + kLanes <= count; i += kLanes) {
                    Out made[kMostOperands], *to = streams ? made : out;
                    for (int o = 0, size = 0; streams && o < batch.outs; size += batch.out_size[o++])
                        made[o] = {streamed.room + kLanes * size, batch.out_size[o]};
                    if constexpr (one_by_one<Kernel>)
                        for (int l = 0; l < kLanes; ++l) {
                            kernel.run(in, to);
                            for (int j = 0; j < batch.ins; ++j) in[j].at += in[j].next;
                            for (int j = 0; j < batch.outs; ++j) to[j].at += to[j].next;
                        }
                    else {
                        kernel.template run<Eight>(in, to);
                        for (int j = 0; j < batch.ins; ++j) in[j].at += kLanes * in[j].next;
                    }
                    const double* from = streamed.room;
                    for (int o = 0; streams && o < batch.outs; ++o) from = Streamed::send(from, out[o], batch.out_size[o]);
                    for (int o = 0; o < batch.outs; ++o) out[o].at += kLanes * out[o].next;
                }
            for (; i < count; ++i) {
                run_one(kernel, in, out);
                for (int j = 0; j < batch.ins; ++j) in[j].at += in[j].next;
                for (int j = 0; j < batch.outs; ++j) out[j].at += out[j].next;
            }
            for (int d = last - 1; d >= 0 && ++index[d] == batch.shape[d]; --d) index[d] = 0;
        }
    }
}

}  // namespace

extern const Table table;
const Table table = {
#define VEDETTE_BATCHED(name, arguments, Shape) run_batch<Shape, shapes::Shape>,
    VEDETTE_KERNELS(VEDETTE_BATCHED)
#undef VEDETTE_BATCHED
};

}  // namespace vedette::VEDETTE_ISA
