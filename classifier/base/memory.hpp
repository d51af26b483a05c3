#pragma once
// Training that does not fit into memory: refused before it begins, or ended with a sentence.

#include <cstddef>
#include <new>
#include <string>

#include "protocols/base/result.hpp"

namespace weft::classifier {

/// That memory ran out while something was learnt from `rows` feature vectors, and what to do.
tl::unexpected<Error> out_of_memory(std::size_t rows, const std::string& got);

/// Refuses a learner that holds `matrices` matrices of [rows x rows] at once where the machine's
/// whole memory is smaller. What is there on paper may still run out: see within_memory().
Status check_square_memory(std::size_t rows, double matrices);

/// What `work` returns, a Result; out_of_memory() where it runs out of memory on any thread of
/// parallel.hpp.
template <class Work>
auto within_memory(std::size_t rows, const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return out_of_memory(rows, "none is left");
  }
}

}  // namespace weft::classifier
