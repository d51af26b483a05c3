#pragma once
// Counts the heap allocations of a test program: features, drivers and recorder must not allocate
// in steady state. Programs that count have allocations.cpp among their sources.

#include <cstddef>

namespace weft {

/// Number of calls of operator new so far, over all threads.
std::size_t allocations();

}  // namespace weft
