#pragma once
// Independent work on all cores. Each item writes its own place only, so results do not depend on
// the number of threads.

#include <cstddef>
#include <functional>
#include <new>
#include <string>

#include "protocols/base/result.hpp"

namespace weft::classifier {

// Training that does not fit into memory: refused before it begins, or ended with a sentence.

/// That memory ran out while something was learnt from `rows` feature vectors, and what to do.
tl::unexpected<Error> out_of_memory(std::size_t rows, const std::string& got);

/// Refuses a learner that holds `matrices` matrices of [rows x rows] at once where the machine's
/// whole memory is smaller. What is there on paper may still run out: see within_memory().
Status check_square_memory(std::size_t rows, double matrices);

/// What `work` returns, a Result; out_of_memory() where it runs out of memory on any thread of
/// the functions below.
template <class Work>
auto within_memory(std::size_t rows, const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return out_of_memory(rows, "none is left");
  }
}

/// Calls `work(i)` once for every i < count, on up to `threads` threads (0: one per core). Items
/// are handed out one at a time, so unequal items still balance. What `work` throws (memory that
/// ran out) ends its own thread's part; the first of it is thrown to the caller once all have
/// ended. So in the two below.
void parallel_for(std::size_t count, std::size_t threads,
                  const std::function<void(std::size_t)>& work);

/// The same with one function per thread, which keeps its tables from item to item.
void parallel_workers(std::size_t count, std::size_t threads,
                      const std::function<std::function<void(std::size_t)>()>& make_worker);

/// Calls `work(from, to)` on one contiguous block per thread: for work that keeps tables between
/// items.
void parallel_blocks(std::size_t count, std::size_t threads,
                     const std::function<void(std::size_t, std::size_t)>& work);

}  // namespace weft::classifier
