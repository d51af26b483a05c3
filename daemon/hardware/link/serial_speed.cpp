// Separate from serial_link.cpp: the kernel's termios and that of the C library cannot be included
// together.

#include <asm/termbits.h>
#include <sys/ioctl.h>

#include <cmath>
#include <string>

#include "daemon/hardware/link/serial_line.hpp"

namespace weft::daemon {

bool speed_taken(std::uint32_t requested, std::uint32_t got) {
  return std::abs(static_cast<double>(got) / requested - 1) <= 0.02;
}

Status set_line_speed(int descriptor, std::uint32_t baud) {
  termios2 line{};
  const auto refused = [&](const std::string& got) {
    return fail({.code = Errc::unsupported,
                 .what = "speed not supported by the port",
                 .expected = std::to_string(baud) + " baud",
                 .got = got,
                 .hint = "Choose a speed that the adapter supports, on both sides"});
  };
  if (::ioctl(descriptor, TCGETS2, &line) != 0) return refused("not a serial port");
  line.c_cflag &= ~static_cast<tcflag_t>(CBAUD | (CBAUD << IBSHIFT));
  line.c_cflag |= BOTHER | (BOTHER << IBSHIFT);
  line.c_ispeed = line.c_ospeed = baud;
  if (::ioctl(descriptor, TCSETS2, &line) != 0) return refused("rejected");
  if (::ioctl(descriptor, TCGETS2, &line) != 0) return refused("no answer");
  if (!speed_taken(baud, line.c_ospeed)) return refused(std::to_string(line.c_ospeed) + " baud");
  return {};
}

}  // namespace weft::daemon
