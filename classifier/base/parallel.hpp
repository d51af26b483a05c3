#pragma once
// Independent work on all cores. Each item writes only its own place, so results do not depend on
// the number of threads.

#include <cstddef>
#include <functional>
#include <new>
#include <string>

#include "protocols/base/result.hpp"

namespace weft::classifier {

// Training that does not fit into memory: it is refused before it begins, or ends with an error.

/// The error for memory that ran out during training on `rows` feature vectors, with advice.
tl::unexpected<Error> out_of_memory(std::size_t rows, const std::string& got);

/// Refuses a learner that holds `matrices` matrices of [rows x rows] at once if they exceed the
/// machine's memory. Memory may still run out after this check: see within_memory().
Status check_square_memory(std::size_t rows, double matrices);

/// The Result of `work`, or out_of_memory() if memory runs out on any thread of the functions
/// below.
template <class Work>
auto within_memory(std::size_t rows, const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return out_of_memory(rows, "no free memory");
  }
}

/// Calls `work(i)` once for every i < count, on up to `threads` threads (0: one per core). Items
/// are handed out one at a time, so unequal items still balance. An exception of `work` (out of
/// memory) ends its thread's part. After all threads have ended, the caller gets the first
/// exception. The two functions below do the same.
void parallel_for(std::size_t count, std::size_t threads,
                  const std::function<void(std::size_t)>& work);

/// Like parallel_for(), with one function per thread that keeps its tables from item to item.
void parallel_workers(std::size_t count, std::size_t threads,
                      const std::function<std::function<void(std::size_t)>()>& make_worker);

/// Calls `work(from, to)` on one contiguous block per thread, for work that keeps tables between
/// items.
void parallel_blocks(std::size_t count, std::size_t threads,
                     const std::function<void(std::size_t, std::size_t)>& work);

}  // namespace weft::classifier
