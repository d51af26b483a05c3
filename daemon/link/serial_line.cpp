#include "daemon/link/serial_line.hpp"

#include <termios.h>

#include <cerrno>
#include <system_error>

namespace weft::daemon {

namespace {

Status with_settings(int descriptor, void (*change)(termios& line, bool rts_cts), bool rts_cts) {
  termios line{};
  if (::tcgetattr(descriptor, &line) != 0)
    return fail(Errc::io, "not a terminal line", {}, {}, std::generic_category().message(errno));
  change(line, rts_cts);
  if (::tcsetattr(descriptor, TCSANOW, &line) != 0)
    return fail(Errc::io, "the line does not take its settings", {}, {},
                std::generic_category().message(errno));
  return {};
}

void wait_for_a_byte(termios& line, bool) {
  line.c_cc[VMIN] = 1;
  line.c_cc[VTIME] = 0;
}

void be_raw(termios& line, bool rts_cts) {
  ::cfmakeraw(&line);
  line.c_cflag |= CLOCAL | CREAD;
  line.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
  if (rts_cts) line.c_cflag |= CRTSCTS;
  wait_for_a_byte(line, rts_cts);
}

}  // namespace

Status let_reads_wait(int descriptor) {
  return with_settings(descriptor, wait_for_a_byte, false);
}

Status set_line_raw(int descriptor, bool rts_cts) {
  return with_settings(descriptor, be_raw, rts_cts);
}

}  // namespace weft::daemon
