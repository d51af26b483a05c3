#include <fcntl.h>
#include <libserialport.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>

#include "daemon/hardware/link/descriptor_link.hpp"
#include "daemon/hardware/link/port_link.hpp"
#include "daemon/hardware/link/serial_line.hpp"

namespace weft::daemon {
namespace {

template <class Change>
Status with_settings(int descriptor, const Change& change) {
  termios line{};
  if (::tcgetattr(descriptor, &line) != 0)
    return fail({.code = Errc::io,
                 .what = "not a serial port",
                 .got = std::generic_category().message(errno)});
  change(line);
  if (::tcsetattr(descriptor, TCSANOW, &line) != 0)
    return fail({.code = Errc::io,
                 .what = "serial settings rejected",
                 .got = std::generic_category().message(errno)});
  return {};
}

void wait_for_a_byte(termios& line) {
  line.c_cc[VMIN] = 1;
  line.c_cc[VTIME] = 0;
}

std::string hint_for(int number) {
  if (number == EACCES) return "Add yourself to the group dialout and log in again";
  if (number == ENOENT) return "Connect the device, switch it on and look into /dev/serial/by-id";
  return {};
}

tl::unexpected<Error> cannot_open(int number) {
  return fail({.code = number == ENOENT ? Errc::not_found : Errc::io,
               .what = "port cannot be opened",
               .got = std::generic_category().message(number),
               .hint = hint_for(number)});
}

tl::unexpected<Error> in_use(int number) {
  return fail({.code = Errc::busy,
               .what = "port in use by another program",
               .got = std::generic_category().message(number),
               .hint = "End that program, or use another port"});
}

Status lock(int descriptor) {
  if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) return {};
  return in_use(errno);
}

/// Two programs on one line would each read half of the answers. Root may open a port that another
/// program has exclusively.
Status claim(int descriptor) {
  int is_exclusive = 0;
  if (::ioctl(descriptor, TIOCGEXCL, &is_exclusive) == 0 && is_exclusive != 0) return in_use(EBUSY);
  return lock(descriptor);
}

class OpenPort {
 public:
  explicit OpenPort(int descriptor) : descriptor_(descriptor) {}
  ~OpenPort() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  OpenPort(const OpenPort&) = delete;
  OpenPort& operator=(const OpenPort&) = delete;
  OpenPort(OpenPort&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  [[nodiscard]] int get() const { return descriptor_; }
  int release() { return std::exchange(descriptor_, -1); }

 private:
  int descriptor_;
};

// A pseudo-terminal carries no parity and has no RTS line (docs/reference/device-facts.md, Serial
// ports).
Result<OpenPort> open_pseudo_terminal(const std::string& path, const SerialSettings& settings) {
  OpenPort port(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (port.get() < 0) return cannot_open(errno);
  if (Status s = claim(port.get()); !s) return pass(s.error());
  if (Status s = set_line_raw(port.get(), settings.rts_cts); !s) return pass(s.error());
  if (Status s = set_line_speed(port.get(), settings.baud); !s) return pass(s.error());
  ::tcflush(port.get(), TCIFLUSH);  // bytes from before the port was open
  return port;
}

sp_parity parity_of(Parity parity) {
  if (parity == Parity::even) return SP_PARITY_EVEN;
  return parity == Parity::odd ? SP_PARITY_ODD : SP_PARITY_NONE;
}

bool configure(sp_port* port, const SerialSettings& settings) {
  const auto ok = [](sp_return result) { return result == SP_OK; };
  return ok(sp_set_bits(port, 8)) && ok(sp_set_stopbits(port, 1)) &&
         ok(sp_set_parity(port, parity_of(settings.parity))) &&
         ok(sp_set_flowcontrol(port,
                               settings.rts_cts ? SP_FLOWCONTROL_RTSCTS : SP_FLOWCONTROL_NONE));
}

struct FreePort {
  void operator()(sp_port* port) const {
    sp_close(port);
    sp_free_port(port);
  }
};

tl::unexpected<Error> library_refused(sp_return code) {
  if (code == SP_ERR_ARG) return cannot_open(ENOENT);
  const int number = sp_last_error_code();
  return number == EBUSY ? in_use(number) : cannot_open(number);
}

// RTS handshake starts with the line raised (docs/reference/device-facts.md, APT line). If the
// kernel's driver does not report it as raised, libserialport has lowered it. A port without such
// lines has nothing to raise.
void raise_rts_and_dtr(int descriptor) {
  const int lines = TIOCM_RTS | TIOCM_DTR;
  static_cast<void>(::ioctl(descriptor, TIOCMBIS, &lines));
}

Status set_by_library(const std::string& path, const SerialSettings& settings) {
  sp_port* found = nullptr;
  if (const sp_return got = sp_get_port_by_name(path.c_str(), &found); got != SP_OK)
    return library_refused(got);
  const std::unique_ptr<sp_port, FreePort> port(found);
  if (const sp_return got = sp_open(found, SP_MODE_READ_WRITE); got != SP_OK)
    return library_refused(got);
  if (!configure(found, settings))
    return fail({.code = Errc::io,
                 .what = "serial settings rejected",
                 .got = std::generic_category().message(sp_last_error_code())});
  return {};
}

// Changes no setting before the line is claimed. Releases of libserialport after Debian's lock the
// port themselves while they have it, so the claim is repeated afterwards. Their settings outlive
// their handle, because the line stays open.
Result<OpenPort> open_real(const std::string& path, const SerialSettings& settings) {
  OpenPort line(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (line.get() < 0) return errno == EBUSY ? in_use(errno) : cannot_open(errno);
  if (Status s = claim(line.get()); !s) return pass(s.error());
  ::flock(line.get(), LOCK_UN);
  if (Status s = set_by_library(path, settings); !s) return pass(s.error());
  if (Status s = lock(line.get()); !s) return pass(s.error());
  if (Status s = let_reads_wait(line.get()); !s) return pass(s.error());
  if (settings.rts_cts) raise_rts_and_dtr(line.get());
  if (Status s = set_line_speed(line.get(), settings.baud); !s) return pass(s.error());
  return line;
}

Result<OpenPort> open_line(const SerialSettings& settings) {
  std::error_code error;
  const std::string path = std::filesystem::canonical(settings.path, error).string();
  if (error) return cannot_open(error.value());
  return path.rfind("/dev/pts/", 0) == 0 ? open_pseudo_terminal(path, settings)
                                         : open_real(path, settings);
}

}  // namespace

Result<std::unique_ptr<Link>> open_serial(RealLoop& loop, const SerialSettings& settings) {
  Result<OpenPort> port = open_line(settings);
  if (!port) return pass(port.error(), settings.path);
  auto link =
      std::make_unique<DescriptorLink>(loop, port->release(), Framing::stream, settings.path);
  if (settings.ftdi_start_up) link->hold_for(ftdi_start_up_time);
  return std::unique_ptr<Link>(std::move(link));
}

std::unique_ptr<Link> adopt_stream(RealLoop& loop, int descriptor, std::string name) {
  return std::make_unique<DescriptorLink>(loop, descriptor, Framing::stream, std::move(name));
}

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
