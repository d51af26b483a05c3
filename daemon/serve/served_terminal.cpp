#include "daemon/serve/served_terminal.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "daemon/link/descriptor_link.hpp"
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
  std::unique_ptr<ServedTerminal> made(new ServedTerminal);
  const int master = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (master < 0) return no_terminal("posix_openpt");
  made->master_ =
      std::make_unique<DescriptorLink>(loop, master, Framing::stream, path, Unsent::lost);
  if (::grantpt(master) != 0 || ::unlockpt(master) != 0) return no_terminal("grantpt");
  const std::string terminal = ::ptsname(master);
  // Kept open: a master whose slaves are all closed reads an error (protocols.md D.5). Raw before
  // the path is known: a cooked terminal echoes.
  made->slave_ = ::open(terminal.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (made->slave_ < 0) return no_terminal("open");
  if (Status raw = set_line_raw(made->slave_, false); !raw) return pass(raw.error());
  if (Status linked = made->publish(terminal, path); !linked) return pass(linked.error());
  return made;
}

// A symbolic link that is left over from a killed weft-rig is replaced; anything else is not.
Status ServedTerminal::publish(const std::string& terminal, const std::string& path) {
  std::error_code error;
  const std::filesystem::path place(path);
  if (place.has_parent_path()) std::filesystem::create_directories(place.parent_path(), error);
  if (std::filesystem::is_symlink(place, error)) std::filesystem::remove(place, error);
  std::filesystem::create_symlink(terminal, place, error);
  if (error)
    return fail(Errc::io, "cannot put the port there", path, "a place for a symbolic link",
                error.message());
  path_ = path;
  return {};
}

ServedTerminal::~ServedTerminal() {
  std::error_code ignored;
  if (!path_.empty()) std::filesystem::remove(path_, ignored);
  if (slave_ >= 0) ::close(slave_);
}

}  // namespace weft::daemon
