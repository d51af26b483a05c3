#include "daemon/hardware/link/serial_line.hpp"

#include <termios.h>

#include <cerrno>
#include <system_error>

namespace weft::daemon {

namespace {

template <class Change>
Status with_settings(int descriptor, const Change& change) {
  termios line{};
  if (::tcgetattr(descriptor, &line) != 0)
    return fail({.code = Errc::io,
                 .what = "not a terminal line",
                 .got = std::generic_category().message(errno)});
  change(line);
  if (::tcsetattr(descriptor, TCSANOW, &line) != 0)
    return fail({.code = Errc::io,
                 .what = "the line does not take its settings",
                 .got = std::generic_category().message(errno)});
  return {};
}

void wait_for_a_byte(termios& line) {
  line.c_cc[VMIN] = 1;
  line.c_cc[VTIME] = 0;
}

}  // namespace

Status let_reads_wait(int descriptor) {
  return with_settings(descriptor, wait_for_a_byte);
}

Status set_line_raw(int descriptor, bool rts_cts) {
  return with_settings(descriptor, [rts_cts](termios& line) {
    ::cfmakeraw(&line);
    line.c_cflag |= CLOCAL | CREAD;
    line.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
    if (rts_cts) line.c_cflag |= CRTSCTS;
    wait_for_a_byte(line);
  });
}

}  // namespace weft::daemon
