#pragma once
// Work that may take as long as it likes, and must not hold up what may not.

namespace weft::daemon {

/// The calling thread, and those that it makes from here on, run when nobody else wants the
/// processor (SCHED_IDLE); where the system does not permit that, with the least share (nice 19).
void set_low_priority();

}  // namespace weft::daemon
