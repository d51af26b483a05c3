#pragma once
// The wall clock, for figures of speed and for the recorder's commit budget. Never for control.

#include <chrono>

namespace weft::daemon {

/// Monotonic, any origin.
std::chrono::nanoseconds steady_wall_now();
/// The same in seconds.
double steady_wall_seconds();
/// Processor time of this process alone, any origin: other work of the machine does not count.
double process_cpu_seconds();
/// Since 1970-01-01 UTC; recorded for people, part of no digest.
std::chrono::nanoseconds utc_now();

}  // namespace weft::daemon
