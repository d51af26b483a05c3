#include "daemon/apps/weft_rig/served_terminal.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <utility>

#include "daemon/hardware/link/serial_line.hpp"

namespace weft::daemon {
namespace {

/// Longest delay until a host that opens the terminal is noticed.
constexpr Duration poll_period = std::chrono::milliseconds(5);

tl::unexpected<Error> no_terminal(const char* what) {
  return fail({.code = Errc::io,
               .where = what,
               .what = "pseudo-terminal not created",
               .got = std::generic_category().message(errno)});
}

}  // namespace

Status ServedTerminal::plug_in() {
  master_port_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (master_port_ < 0) return no_terminal("posix_openpt");
  master_ = std::make_unique<DescriptorLink>(*loop_, master_port_, Framing::terminals, path_,
                                             Unsent::lost);
  if (::grantpt(master_port_) != 0 || ::unlockpt(master_port_) != 0) return no_terminal("grantpt");
  terminal_ = ::ptsname(master_port_);
  // Made raw before the path is published, because a terminal in cooked mode echoes. It stays raw
  // while its master is open. Closed again, so that hosts are seen to come and go.
  const int other_end = open_other_end();
  if (other_end < 0) return no_terminal("open");
  const Status raw = set_line_raw(other_end, false);
  ::close(other_end);
  if (!raw) return raw;
  master_->on_receive([this](ByteView bytes, TimePoint at) {
    have_host();
    if (receiver_) receiver_(bytes, at);
  });
  master_->on_vacant([this] { have_lost_host(); });
  poll_host();
  return publish();
}

int ServedTerminal::open_other_end() const {
  return ::open(terminal_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
}

// Without a plug or a host the bytes are lost, as on a wire.
Status ServedTerminal::write(ByteView bytes) {
  return master_ && occupied_ ? master_->write(bytes) : Status{};
}

void ServedTerminal::have_host() {
  if (!std::exchange(occupied_, true) && came_) came_(true);
}

// Unread bytes and exclusive mode (TIOCEXCL) end with the last host, as on a serial port. Line
// settings stay.
void ServedTerminal::have_lost_host() {
  occupied_ = false;
  master_->forget_unsent();
  if (const int other_end = open_other_end(); other_end >= 0) {
    ::tcflush(other_end, TCIFLUSH);
    ::ioctl(other_end, TIOCNXCL);
    ::close(other_end);
  }
  poll_host();
}

/// The kernel does not notify a master when its terminal is opened, so the end of the hang-up
/// (POLLHUP) is polled.
void ServedTerminal::poll_host() {
  if (std::exchange(looking_, true)) return;
  loop_->after(poll_period, [this, alive = std::weak_ptr(alive_)] {
    if (!alive.lock()) return;
    looking_ = false;
    if (!master_ || occupied_) return;
    pollfd port{master_port_, POLLIN, 0};
    static_cast<void>(::poll(&port, 1, 0));
    const bool vacant = (port.revents & POLLHUP) != 0;
    if (vacant && (port.revents & POLLIN) == 0) return poll_host();
    have_host();
    master_->resume();
  });
}

// Replaces a symbolic link left over from a killed weft-rig, and nothing else.
Status ServedTerminal::publish() {
  std::error_code error;
  const std::filesystem::path place(path_);
  if (place.has_parent_path()) std::filesystem::create_directories(place.parent_path(), error);
  if (std::filesystem::is_symlink(place, error)) std::filesystem::remove(place, error);
  std::filesystem::create_symlink(terminal_, place, error);
  if (error)
    return fail({.code = Errc::io,
                 .where = path_,
                 .what = "link to the port not created",
                 .expected = "a path for a symbolic link",
                 .got = error.message()});
  published_ = true;
  return {};
}

void ServedTerminal::pull() {
  std::error_code ignored;
  const bool is_ours = std::filesystem::read_symlink(path_, ignored) == terminal_;
  if (std::exchange(published_, false) && is_ours) std::filesystem::remove(path_, ignored);
  master_.reset();  // hangs up on hosts that have the other end open
  occupied_ = false;
}

Status ServedTerminal::set_plugged(bool in) {
  if (in == (master_ != nullptr)) return {};
  pull();
  if (!in) return {};
  const Status plugged = plug_in();
  if (!plugged) pull();
  return plugged;
}

ServedTerminal::~ServedTerminal() {
  pull();
}

}  // namespace weft::daemon
