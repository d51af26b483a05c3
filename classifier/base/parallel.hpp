#pragma once
// Independent work on all cores. Each item writes its own place only, so results do not depend on
// the number of threads.

#include <cstddef>
#include <functional>

namespace weft::classifier {

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
