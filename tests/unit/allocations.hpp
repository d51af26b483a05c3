#pragma once
// Counts what a test program takes from the heap: features, drivers and recorder promise nothing in
// steady state. Programs that count have allocations.cpp among their sources.

#include <cstddef>

namespace weft {

/// Calls of operator new, of all threads, so far.
std::size_t allocations();

}  // namespace weft
