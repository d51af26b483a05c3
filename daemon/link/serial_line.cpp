#include "daemon/link/serial_line.hpp"

#include <termios.h>

#include <cerrno>
#include <system_error>

namespace weft::daemon {

Status set_line_raw(int descriptor, bool rts_cts) {
  termios line{};
  if (::tcgetattr(descriptor, &line) != 0)
    return fail(Errc::io, "not a terminal line", {}, {}, std::generic_category().message(errno));
  ::cfmakeraw(&line);
  line.c_cflag |= CLOCAL | CREAD;
  line.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
  if (rts_cts) line.c_cflag |= CRTSCTS;
  line.c_cc[VMIN] = 1;
  line.c_cc[VTIME] = 0;
  if (::tcsetattr(descriptor, TCSANOW, &line) != 0)
    return fail(Errc::io, "the line does not take its settings", {}, {},
                std::generic_category().message(errno));
  return {};
}

}  // namespace weft::daemon
