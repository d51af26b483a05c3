#pragma once
// Memory that a long piece of work has freed, back to the system.

#include <malloc.h>

namespace weft::daemon {

/// The allocator keeps what a campaign or a training has freed, tens of megabytes, for the next
/// one, which may be a day away. Takes milliseconds; for the thread that did the work, at its end.
/// Source: malloc_trim(3).
inline void give_back_free_memory() {
  malloc_trim(0);
}

}  // namespace weft::daemon
