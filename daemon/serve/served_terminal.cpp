#include "daemon/serve/served_terminal.hpp"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <utility>

#include "daemon/link/serial_line.hpp"

namespace weft::daemon {
namespace {

tl::unexpected<Error> no_terminal(const char* what) {
  return fail(Errc::io, "cannot make a pseudo-terminal", what, {},
              std::generic_category().message(errno));
}

}  // namespace

Result<std::unique_ptr<ServedTerminal>> ServedTerminal::create(RealLoop& loop,
                                                               const std::string& path) {
  std::unique_ptr<ServedTerminal> made(new ServedTerminal(loop, path));
  if (Status in = made->set_plugged(true); !in) return pass(in.error());
  return made;
}

Status ServedTerminal::plug_in() {
  const int master = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (master < 0) return no_terminal("posix_openpt");
  master_ = std::make_unique<DescriptorLink>(*loop_, master, Framing::stream, path_, Unsent::lost);
  if (::grantpt(master) != 0 || ::unlockpt(master) != 0) return no_terminal("grantpt");
  const std::string terminal = ::ptsname(master);
  // Kept open: a master whose slaves are all closed reads an error (protocols.md D.5). Raw before
  // the path is known: a cooked terminal echoes.
  slave_ = ::open(terminal.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (slave_ < 0) return no_terminal("open");
  if (Status raw = set_line_raw(slave_, false); !raw) return raw;
  watch_ = std::make_unique<TerminalWatch>(*loop_, terminal, [this] { hosts_changed(); });
  master_->on_receive([this](ByteView bytes, TimePoint at) {
    watch_->heard();
    if (receiver_) receiver_(bytes, at);
  });
  return publish(terminal);
}

// Without a plug or a host: lost, as on a wire.
Status ServedTerminal::write(ByteView bytes) {
  return master_ && watch_->somebody() ? master_->write(bytes) : Status{};
}

void ServedTerminal::hosts_changed() {
  if (watch_->somebody()) {
    if (came_) came_();
    return;
  }
  master_->forget_unsent();
  ::tcflush(slave_, TCIFLUSH);
  ::ioctl(slave_, TIOCNXCL);  // which the last close of a port does; here this end stays open
}

// A symbolic link that is left over from a killed weft-rig is replaced; anything else is not.
Status ServedTerminal::publish(const std::string& terminal) {
  std::error_code error;
  const std::filesystem::path place(path_);
  if (place.has_parent_path()) std::filesystem::create_directories(place.parent_path(), error);
  if (std::filesystem::is_symlink(place, error)) std::filesystem::remove(place, error);
  std::filesystem::create_symlink(terminal, place, error);
  if (error)
    return fail(Errc::io, "cannot put the port there", path_, "a place for a symbolic link",
                error.message());
  published_ = true;
  return {};
}

void ServedTerminal::pull() {
  std::error_code ignored;
  if (std::exchange(published_, false)) std::filesystem::remove(path_, ignored);
  watch_.reset();
  master_.reset();  // hosts that hold the other end are hung up on
  if (slave_ >= 0) ::close(slave_);
  slave_ = -1;
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
