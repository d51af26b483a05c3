#pragma once
// Settings of a terminal line that <termios.h> has no names for.

#include <cstdint>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Whether a line that was asked for `requested` baud and reads back `got` can be used: dividers
/// cannot make every speed; it works while both sides agree to 2 %.
bool speed_taken(std::uint32_t requested, std::uint32_t got);

/// Sets any speed (Linux: TCSETS2 with BOTHER) and reads it back: some ports take the call and
/// keep another speed (docs/reference/device-facts.md, Serial ports). Errors: unsupported, with
/// the speed that it has.
Status set_line_speed(int descriptor, std::uint32_t baud);

/// A read of a line that has no byte yet waits, or would have to (EAGAIN). As libserialport leaves
/// a line it returns 0 at once, which is also how the end of one looks.
Status let_reads_wait(int descriptor);

/// Raw bytes: eight bits, no echo, no signals, no translation. RTS/CTS as told.
Status set_line_raw(int descriptor, bool rts_cts);

}  // namespace weft::daemon
