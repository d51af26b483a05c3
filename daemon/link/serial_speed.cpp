// Apart from serial_line.cpp: the kernel's termios and that of the C library cannot be included
// together.

#include <asm/termbits.h>
#include <sys/ioctl.h>

#include <string>

#include "daemon/link/serial_line.hpp"

namespace weft::daemon {

Status set_line_speed(int descriptor, std::uint32_t baud) {
  termios2 line{};
  const auto refused = [&](const std::string& got) {
    return fail(Errc::unsupported, "the port does not take this speed", {},
                std::to_string(baud) + " baud", got,
                "Choose a speed that the adapter can do, on both sides");
  };
  if (::ioctl(descriptor, TCGETS2, &line) != 0) return refused("not a terminal line");
  line.c_cflag &= ~static_cast<tcflag_t>(CBAUD | (CBAUD << IBSHIFT));
  line.c_cflag |= BOTHER | (BOTHER << IBSHIFT);
  line.c_ispeed = line.c_ospeed = baud;
  if (::ioctl(descriptor, TCSETS2, &line) != 0) return refused("a refusal");
  if (::ioctl(descriptor, TCGETS2, &line) != 0) return refused("no answer");
  // Dividers cannot make every speed; a line works while both sides agree to 2 %.
  const double off = static_cast<double>(line.c_ospeed) / baud - 1;
  if (off > 0.02 || off < -0.02) return refused(std::to_string(line.c_ospeed) + " baud");
  return {};
}

}  // namespace weft::daemon
