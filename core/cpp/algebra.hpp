// Small matrices, of one problem or of eight side by side. Row-major. Of symmetric ones the upper triangle is read. One problem's
// come out symmetric to the last bit; eight problems' have no lower triangle if sizes are constants, as they do not fit into the
// registers, and each number that is not needed saves a way to memory and back.
#pragma once

#include <initializer_list>
#include <type_traits>

#include "lanes.hpp"

namespace vedette::VEDETTE_ISA {

// Whether common sizes have their loops unrolled: not where a better instruction set is all but always at hand.
#ifdef VEDETTE_ROLLED
constexpr bool kUnrolls = false;
#else
constexpr bool kUnrolls = true;
#endif

// Calls f with the sizes as constants where they are common, so that the compiler unrolls; else as they are.
template <class F>
VEDETTE_INLINE void with_sizes(int n, const F& f) {
    if constexpr (!kUnrolls) return f(n);
    switch (n) {
        case 2: return f(std::integral_constant<int, 2>());
        case 4: return f(std::integral_constant<int, 4>());
        case 5: return f(std::integral_constant<int, 5>());
        case 6: return f(std::integral_constant<int, 6>());
        default: return f(n);
    }
}
template <class F>
VEDETTE_INLINE void with_sizes(int n, int m, const F& f) {
    if constexpr (!kUnrolls) return f(n, m);
    if (m == 2 && n == 4) return f(std::integral_constant<int, 4>(), std::integral_constant<int, 2>());
    if (m == 2 && n == 5) return f(std::integral_constant<int, 5>(), std::integral_constant<int, 2>());
    if (m == 2 && n == 6) return f(std::integral_constant<int, 6>(), std::integral_constant<int, 2>());
    if (m == 3 && n == 6) return f(std::integral_constant<int, 6>(), std::integral_constant<int, 3>());
    if (m == 1 && n == 2) return f(std::integral_constant<int, 2>(), std::integral_constant<int, 1>());
    f(n, m);
}

// Whether all eight problems share each of these inputs.
VEDETTE_INLINE bool are_shared(const In* in, std::initializer_list<int> which) {
    bool all = true;
    for (const int i : which) all = all && in[i].next == 0;
    return all;
}

// Calls f with the sizes, and with a number of the type that a model's matrices are read as: double if they are shared, and
// sizes are constants. Whether constants are worth compiling where each of eight problems has matrices of its own, the caller says.
enum Unrolled { kShared, kSharedOrOwn };
template <class T, Unrolled which, class F>
VEDETTE_INLINE void with_constants(int n, int m, bool shared, const F& f) {
    if constexpr (which == kShared && !std::is_same_v<T, double>)
        if (!shared) return f(n, m, T{});
    with_sizes(n, m, [&](auto states, auto measured) {
        if constexpr (std::is_same_v<decltype(states), int>) return f(states, measured, T{});
        if constexpr (which == kSharedOrOwn && !std::is_same_v<T, double>)
            if (!shared) return f(states, measured, T{});
        f(states, measured, 0.0);
    });
}

// The same where the most usual sizes alone are worth it: for kernels that take long to compile.
template <class T, class F>
VEDETTE_INLINE void with_usual_constants(int n, int m, bool shared, const F& f) {
    if constexpr (kUnrolls)
        if (n == 4 && m == 2 && (shared || std::is_same_v<T, double>))
            return f(std::integral_constant<int, 4>(), std::integral_constant<int, 2>(), 0.0);
    f(n, m, T{});
}

// A stage of eight problems stands apart, or the compiler would keep too much in memory, and be at it for minutes.
template <class T, class... N, class F>
VEDETTE_INLINE void outlined_for_eight(const F& f) {
    if constexpr (std::is_same_v<T, double>)
        once_unless_constant<N...>(f);
    else
        outlined(f);
}

constexpr double kLog2Pi = 1.8378770664093454836;
constexpr double kLeastIndependence = 1e-3;  // the least |S| / (S_11 S_22 ..) at which P - K S K' is: K S K' errs by its inverse
constexpr double kSingular = 1e-12;  // an S with a smaller pivot than this part of its diagonal has no good inverse

// What the comparison of two numbers says, or of eight pairs.
template <class T>
using Mask = std::conditional_t<std::is_same_v<T, double>, bool, Eight64>;

template <class T>
VEDETTE_INLINE void wrap(T* x, const Periods& periods) {
    for (int i = 0; i < periods.count; ++i) {
        T& value = x[periods.each[i].axis];
        value = Lane<T>::wrap(value, periods.each[i].period);
    }
}

template <class T>
VEDETTE_INLINE T safe_log(T p) {
    return Lane<T>::log(Lane<T>::maximum(p, Lane<T>::broadcast(kTiny)));
}

// One problem by itself, of four columns or more, is worked on row by row: a row is one to three vectors, of which the last holds
// the last four columns, some of them once more. Calls f with how many as a constant.
template <class F>
VEDETTE_INLINE void with_vectors(int columns, const F& f) {
    if (columns == 4) return f(std::integral_constant<int, 1>());
    if (columns <= 8) return f(std::integral_constant<int, 2>());
    f(std::integral_constant<int, 3>());
}
constexpr int kMostInRows = 12;
static_assert(kMostInRows >= kMostStates);
template <class T>
VEDETTE_INLINE bool is_by_rows(int columns) {
    return std::is_same_v<T, double> && columns >= 4;
}

template <int vectors>
struct Rows {
    Row each[vectors];
    int last;  // where the last begins

    VEDETTE_INLINE explicit Rows(int columns) : each{}, last(columns - 4) {}
    VEDETTE_INLINE int begin(int v) const { return v == vectors - 1 ? last : 4 * v; }
    VEDETTE_INLINE void load(const double* at) {
        for (int v = 0; v < vectors; ++v) each[v] = load_row(at + begin(v));
    }
    VEDETTE_INLINE void add(double factor, const double* at) {
        for (int v = 0; v < vectors; ++v) each[v] += factor * load_row(at + begin(v));
    }
    VEDETTE_INLINE void store(double* at) const {
        for (int v = 0; v < vectors; ++v) store_row(at + begin(v), each[v]);
    }
};

// B (n, p) = A' with A (p, n), in blocks of four by four, the last ones some of them once more.
VEDETTE_INLINE void transpose_blocks(const double* A, double* B, int p, int n) {
    for (int i = 0; i < p; i += 4) {
        if (i > p - 4) i = p - 4;
        for (int j = 0; j < n; j += 4) {
            if (j > n - 4) j = n - 4;
            Row rows[4];
            for (int l = 0; l < 4; ++l) rows[l] = load_row(A + (i + l) * n + j);
            transpose(rows);
            for (int l = 0; l < 4; ++l) store_row(B + (j + l) * p + i, rows[l]);
        }
    }
}

// C (4, 4), its lower triangle made that of its transpose.
VEDETTE_INLINE void copy_upper_to_lower_by_rows(double* C) {
    Row row[4], transposed[4];
    for (int i = 0; i < 4; ++i) transposed[i] = row[i] = load_row(C + 4 * i);
    transpose(transposed);
    store_row(C + 4, VEDETTE_SHUFFLE(Row64, transposed[1], row[1], 0, 5, 6, 7));
    store_row(C + 8, VEDETTE_SHUFFLE(Row64, transposed[2], row[2], 0, 1, 6, 7));
    store_row(C + 12, VEDETTE_SHUFFLE(Row64, transposed[3], row[3], 0, 1, 2, 7));
}

// Entry (i, j) of A, if it is symmetric from its upper triangle.
template <bool symmetric = true, class T>
VEDETTE_INLINE const T& entry(const T* A, int i, int j, int columns) {
    return symmetric && i > j ? A[j * columns + i] : A[i * columns + j];
}

// Makes the lower triangle of a symmetric C that of its upper one.
template <class T, class N>
VEDETTE_INLINE void copy_upper_to_lower(T* C, N n) {
    once_unless_constant<N>([=]() VEDETTE_INLINED {
        if constexpr (std::is_same_v<T, double>)
            if (n == 4) return copy_upper_to_lower_by_rows(C);
        for (int i = 0; i < n; ++i)
            for (int j = i + 1; j < n; ++j) C[j * n + i] = C[i * n + j];
    });
}

// Sets entry (i, j) of a symmetric C, i <= j.
template <class T>
VEDETTE_INLINE void set_entry(T* C, int i, int j, int n, const T& value) {
    C[i * n + j] = value;
    if constexpr (std::is_same_v<T, double>) C[j * n + i] = value;
}

// `count` symmetric matrices (n, n) one after another, eight problems' side by side: their upper triangles alone where n is a
// constant.
struct Symmetry {};
constexpr Symmetry kSymmetric{};
template <class T, class N>
VEDETTE_INLINE void load_symmetric(In a, T* to, N n, int count = 1) {
    if constexpr (std::is_same_v<T, double> || std::is_same_v<N, int>)
        load(a, to, count * n * n);
    else
        outlined([=] {
            for (int c = 0; c < count; ++c)
                load_where(at_offset(a, c * n * n), to + c * n * n, n * n, [&](int i) { return i / n <= i % n; });
        });
}
template <class T, class N>
VEDETTE_INLINE void store_symmetric(Out a, T* from, N n, int count = 1) {
    for (int c = 0; c < count; ++c) {
        if constexpr (!std::is_same_v<T, double> && std::is_same_v<N, int>) copy_upper_to_lower(from + c * n * n, n);
        if constexpr (std::is_same_v<T, double> || std::is_same_v<N, int>)
            store(at_offset(a, c * n * n), from + c * n * n, n * n);
        else
            store_each(at_offset(a, c * n * n), n * n, [&](int i) { return entry(from + c * n * n, i / n, i % n, n); });
    }
}

// A matrix among the inputs: one problem's where it lies, eight problems' side by side.
template <class T, int most>
struct Matrix {
    T at[most];
    template <class N>
    VEDETTE_INLINE Matrix(In a, N count) {
        load(a, at, count);
    }
    template <class N>
    VEDETTE_INLINE Matrix(In a, N n, Symmetry) { load_symmetric(a, at, n); }
    VEDETTE_INLINE operator const T*() const { return at; }
};
template <int most>
struct Matrix<double, most> {
    const double* at;
    VEDETTE_INLINE Matrix(In a, int) : at(a.at) {}
    VEDETTE_INLINE Matrix(In a, int, Symmetry) : at(a.at) {}
    VEDETTE_INLINE operator const double*() const { return at; }
};
template <class T>
using Vector = Matrix<T, kMostStates>;
template <class T>
using Square = Matrix<T, kStates2>;
template <class T>
using Rectangle = Matrix<T, kMostMeasured * kMostStates>;

// Products take numbers that all eight problems share as they are: A, B may be double where T is Eight.

constexpr std::integral_constant<int, 1> kOne{};

// C (p, q) by rows: of each what it begins as, and `factor(i, l)` times row l of B (s, q).
template <class M, class S, class N, class Begin, class Factor>
VEDETTE_INLINE void add_rows(const Begin& begin, const Factor& factor, const double* B, double* C, M p, S s, N q) {
    with_vectors(q, [&](auto vectors) VEDETTE_INLINED {
        for (int i = 0; i < p; ++i) {
            Rows<vectors> sum(q);
            begin(sum, i);
            for (int l = 0; l < s; ++l) sum.add(factor(i, l), B + q * l);
            sum.store(C + q * i);
        }
    });
}
constexpr auto kFromNothing = [](auto&, int) VEDETTE_INLINED {};

// Which of a product's two matrices is symmetric; or the left one is given transposed.
enum Side { kNeither, kLeft, kRight, kTransposed };

// C (p, q) = A B with B (s, q), and A (p, s), or A' (s, p) if that is given.
template <Side which = kNeither, class T, class L, class R, class M, class S, class N>
VEDETTE_INLINE void multiply(const L* A, const R* B, T* C, M p, S s, N q) {
    const auto left = [=](int i, int l) VEDETTE_INLINED -> const L& {
        return which == kTransposed ? A[l * p + i] : entry<which == kLeft>(A, i, l, s);
    };
    once_unless_constant<M, S, N>([=]() VEDETTE_INLINED {
        if constexpr (std::is_same_v<T, double>)
            if (is_by_rows<T>(q)) {
                const auto factor = [=](int i, int l) VEDETTE_INLINED { return which == kTransposed ? A[l * p + i] : A[i * s + l]; };
                return add_rows(kFromNothing, factor, B, C, p, s, q);
            }
        for (int i = 0; i < p; ++i)
            for (int j = 0; j < q; ++j) {
                T sum = T{} + left(i, 0) * entry<which == kRight>(B, 0, j, q);
                for (int l = 1; l < s; ++l) sum += left(i, l) * entry<which == kRight>(B, l, j, q);
                C[i * q + j] = sum;
            }
    });
}

// Symmetric C (p, p) = D + sign A' B with A, B (s, p)
template <int sign = 1, class T, class C, class L, class R, class N, class S>
VEDETTE_INLINE void add_transposed_product(const C* D, const L* A, const R* B, T* to, N p, S s) {
    once_unless_constant<N, S>([=]() VEDETTE_INLINED {
        if constexpr (std::is_same_v<T, double>)
            if (is_by_rows<T>(p)) {
                add_rows([=](auto& sum, int i) VEDETTE_INLINED { sum.load(D + p * i); },
                         [=](int i, int l) VEDETTE_INLINED { return sign * A[l * p + i]; }, B, to, p, s, p);
                return copy_upper_to_lower(to, p);
            }
        for (int i = 0; i < p; ++i)
            for (int j = i; j < p; ++j) {
                T sum = T{} + D[i * p + j];
                for (int l = 0; l < s; ++l) sum += sign * A[l * p + i] * B[l * p + j];
                set_entry(to, i, j, p, sum);
            }
    });
}

// A x with A (p, n)
template <class T, class C, class M, class N>
VEDETTE_INLINE void apply(const C* A, const T* x, T* to, M p, N n) {
    once_unless_constant<M, N>([=]() VEDETTE_INLINED {
        if constexpr (std::is_same_v<T, double>)
            if (is_by_rows<T>(n) && is_by_rows<T>(p)) {
                double transposed[kStates2];
                transpose_blocks(A, transposed, p, n);
                return multiply(x, transposed, to, kOne, n, p);
            }
        multiply(A, x, to, p, n, kOne);
    });
}

// A P (p, n) and A P A' + D (p, p) with A (p, n); P and D symmetric
template <class T, class C, class M, class N>
VEDETTE_INLINE void congruence(const C* A, const T* P, const C* D, T* AP, T* to, M p, N n) {
    once_unless_constant<M, N>([=]() VEDETTE_INLINED {
        multiply<kRight>(A, P, AP, p, n, n);
        if constexpr (std::is_same_v<T, double>)
            if (is_by_rows<T>(n) && is_by_rows<T>(p)) {
                double transposed[kStates2];
                transpose_blocks(A, transposed, p, n);
                add_rows([=](auto& sum, int i) VEDETTE_INLINED { sum.load(D + p * i); },
                         [=](int i, int l) VEDETTE_INLINED { return AP[n * i + l]; }, transposed, to, p, n, p);
                return copy_upper_to_lower(to, p);
            }
        for (int i = 0; i < p; ++i)
            for (int j = i; j < p; ++j) {
                T sum = T{} + D[i * p + j];
                for (int l = 0; l < n; ++l) sum += AP[i * n + l] * A[j * n + l];
                set_entry(to, i, j, p, sum);
            }
    });
}

// Whether a symmetric A (m, m) is more than a part of B in every direction: whether A - part B has positive pivots.
template <class T, class C>
VEDETTE_INLINE bool exceeds_part(const C* A, const T* B, double part, int m) {
    T left[kMeasured2];
    for (int i = 0; i < m; ++i)
        for (int j = i; j < m; ++j) left[i * m + j] = A[i * m + j] - part * B[i * m + j];
    for (int j = 0; j < m; ++j) {
        if (!all_of(left[j * m + j] > 0.0)) return false;
        const T over = 1.0 / left[j * m + j];
        for (int i = j + 1; i < m; ++i) {
            const T factor = left[j * m + i] * over;
            for (int l = i; l < m; ++l) left[i * m + l] -= factor * left[j * m + l];
        }
    }
    return true;
}

// The inverse of a positive definite S (m, m), and the logarithm of its determinant; if m > 2, also where no pivot is too small
// for them, and where |S| is a fair part of the product of its diagonal.
template <class T>
VEDETTE_INLINE T invert_inline(const T* S, T* inverse, int m, Mask<T>& is_regular, Mask<T>& is_independent) {
    if (m == 1) {
        inverse[0] = 1.0 / S[0];
        return Lane<T>::log(S[0]);
    }
    if (m == 2) {
        const T det = S[0] * S[3] - S[1] * S[1], over = 1.0 / det;
        inverse[0] = S[3] * over;
        inverse[3] = S[0] * over;
        set_entry(inverse, 0, 1, 2, T(-S[1] * over));
        return Lane<T>::log(det);
    }
    // S = L D L' with a unit lower triangular L; then the inverse of L by substitution.
    T L[kMeasured2], D[kMostMeasured], over[kMostMeasured], M[kMeasured2];
    T log_det = Lane<T>::broadcast(0.0), det = Lane<T>::broadcast(1.0), diagonal = det;
    is_regular = T{} == 0.0;
    for (int j = 0; j < m; ++j) {
        D[j] = S[j * m + j];
        for (int l = 0; l < j; ++l) D[j] -= L[j * m + l] * L[j * m + l] * D[l];
        is_regular = is_regular & (D[j] > kSingular * S[j * m + j]);
        log_det += Lane<T>::log(D[j]), det *= D[j], diagonal *= S[j * m + j], over[j] = 1.0 / D[j];
        for (int i = j + 1; i < m; ++i) {
            T sum = S[j * m + i];
            for (int l = 0; l < j; ++l) sum -= L[i * m + l] * L[j * m + l] * D[l];
            L[i * m + j] = sum * over[j];
        }
    }
    for (int j = 0; j < m; ++j) {
        M[j * m + j] = Lane<T>::broadcast(1.0);
        for (int i = j + 1; i < m; ++i) {
            T sum = -L[i * m + j];
            for (int l = j + 1; l < i; ++l) sum -= L[i * m + l] * M[l * m + j];
            M[i * m + j] = sum;
        }
    }
    for (int i = 0; i < m; ++i)
        for (int j = i; j < m; ++j) {
            T sum = Lane<T>::broadcast(0.0);
            for (int l = j; l < m; ++l) sum += M[l * m + i] * M[l * m + j] * over[l];
            set_entry(inverse, i, j, m, sum);
        }
    is_independent = det > kLeastIndependence * diagonal;
    return log_det;
}
template <class T, class M>
VEDETTE_INLINE T invert(const T* S, T* inverse, M m, Mask<T>& is_regular, Mask<T>& is_independent) {
    T log_det;
    once_unless_constant<M>([&]() VEDETTE_INLINED { log_det = invert_inline(S, inverse, m, is_regular, is_independent); });
    return log_det;
}

}  // namespace vedette::VEDETTE_ISA
