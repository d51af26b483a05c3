#pragma once
// Eight doubles side by side, one per taxel. The compiler maps them to the vectors of the
// processor. Lanes never mix and no operation is fused, so every processor and compiler computes
// the same bits.

#ifdef __linux__
#include <sys/mman.h>
#endif

#include <cstddef>
#include <new>
#include <vector>

// Only functions that are always inlined pass lanes by value. So no call passes a lane and no ABI
// matters.
#pragma GCC diagnostic ignored "-Wpsabi"

#define WEFT_INLINE [[gnu::always_inline]] inline
// One copy of a function for each named kind of processor and one for all others, chosen when the
// program starts. That is before the thread sanitizer is ready, which crashes it. clang 14 names
// such clones so that its own linker does not find them.
#if defined(__x86_64__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define WEFT_CLONES(...) [[gnu::target_clones(__VA_ARGS__, "default")]]
#else
#define WEFT_CLONES(...)
#endif

namespace weft::classifier::simd {

inline constexpr std::size_t width = 8;
/// Taxels processed together: two lanes each, the real and the imaginary signal of one Fourier
/// transform.
inline constexpr std::size_t block_taxels = 2 * width;

using Lanes = double __attribute__((vector_size(width * sizeof(double))));

/// Lanes at any address in an array of doubles, without alignment.
struct __attribute__((packed, may_alias)) Loose {
  Lanes value;
};
WEFT_INLINE Lanes load(const double* p) {
  return reinterpret_cast<const Loose*>(p)->value;
}
WEFT_INLINE void store(double* p, Lanes v) {
  reinterpret_cast<Loose*>(p)->value = v;
}
WEFT_INLINE Lanes all(double v) {
  // Fills by doubling: gcc 12 fills {v, v ... v} lane by lane in a function that has clones.
  using Two = double __attribute__((vector_size(2 * sizeof(double))));
  const Two two{v, v};
  const auto four = __builtin_shufflevector(two, two, 0, 1, 0, 1);
  return __builtin_shufflevector(four, four, 0, 1, 2, 3, 0, 1, 2, 3);
}

// The same operations for V = Lanes or one double.
template <class V>
inline constexpr std::size_t lanes_of = sizeof(V) / sizeof(double);
template <class V>
WEFT_INLINE V load(const double* p) {
  if constexpr (lanes_of<V> == 1) {
    return *p;
  } else {
    return load(p);
  }
}
WEFT_INLINE void store(double* p, double v) {
  *p = v;
}
template <class V>
WEFT_INLINE V all(double v) {
  if constexpr (lanes_of<V> == 1) {
    return v;
  } else {
    return all(v);
  }
}
template <class V>
WEFT_INLINE V larger(V a, V b) {
  return a > b ? a : b;
}
template <class V>
WEFT_INLINE V smaller(V a, V b) {
  return a < b ? a : b;
}
template <class V>
WEFT_INLINE V magnitude(V a) {
  return larger<V>(a, -a);
}

/// Memory on cache line boundaries: a load of eight doubles then touches one line, not two. Blocks
/// of several huge pages request huge pages from the kernel. A long transform accesses a dozen
/// distant places; with pages of 4 KiB every step would wait for the page table.
template <class T>
struct LineAllocator {
  using value_type = T;
  static constexpr std::size_t line = 64, huge_page = std::size_t{1} << 21;
  LineAllocator() = default;
  template <class U>
  LineAllocator(const LineAllocator<U>& /*other*/) {}
  T* allocate(std::size_t n) {
    void* const p = ::operator new(n * sizeof(T), alignment(n));
    prefer_huge_pages(p, n * sizeof(T));
    return static_cast<T*>(p);
  }
  void deallocate(T* p, std::size_t n) { ::operator delete(p, alignment(n)); }
  static std::align_val_t alignment(std::size_t n) {
    return std::align_val_t{n * sizeof(T) < 2 * huge_page ? line : huge_page};
  }
  static void prefer_huge_pages([[maybe_unused]] void* p, [[maybe_unused]] std::size_t bytes) {
#ifdef __linux__
    if (bytes >= 2 * huge_page) ::madvise(p, bytes / huge_page * huge_page, MADV_HUGEPAGE);
#endif
  }
  friend bool operator==(const LineAllocator&, const LineAllocator&) {
    return true;
  }
};
using AlignedDoubles = std::vector<double, LineAllocator<double>>;

}  // namespace weft::classifier::simd
