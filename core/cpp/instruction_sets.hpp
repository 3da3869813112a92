// The instruction sets that code is built for, and whether this processor runs them.
#pragma once

namespace vedette {

template <class Code>
struct InstructionSet {
    const char* name;
    const Code* code;
    bool (*runs)();
};

inline bool runs_baseline() { return true; }

#ifdef VEDETTE_AVX2
inline bool runs_avx2() { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); }
#endif
#ifdef VEDETTE_AVX512
inline bool runs_avx512() {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
           __builtin_cpu_supports("avx512bw");
}
#endif

}  // namespace vedette
