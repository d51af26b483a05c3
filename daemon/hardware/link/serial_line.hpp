#pragma once
// Terminal settings that <termios.h> does not define.

#include <cstdint>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Whether a line with the read-back speed `got` works for `requested` baud. Dividers cannot make
/// every speed; a line works while both sides agree to 2 %.
bool speed_taken(std::uint32_t requested, std::uint32_t got);

/// Sets any speed (Linux: TCSETS2 with BOTHER) and reads it back: some ports accept the call and
/// keep another speed (docs/reference/device-facts.md, Serial ports). Errors: unsupported, with the
/// actual speed.
Status set_line_speed(int descriptor, std::uint32_t baud);

/// Makes a read without a byte wait, or fail with EAGAIN. As libserialport leaves a line, such a
/// read returns 0 at once, like the end of a file.
Status let_reads_wait(int descriptor);

/// Raw bytes: eight bits, no echo, no signals, no translation. RTS/CTS as given.
Status set_line_raw(int descriptor, bool rts_cts);

}  // namespace weft::daemon
