#include "daemon/service/transport/unix_socket.hpp"

#include <pwd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <asio/io_context.hpp>

namespace weft::daemon::server {
namespace {

using Unix = asio::local::stream_protocol;

constexpr mode_t socket_mode = 0660;  // owner and group; others have no business here

std::string name_of(uid_t user) {
  std::array<char, 1024> text{};
  passwd entry{};
  passwd* found = nullptr;
  if (getpwuid_r(user, &entry, text.data(), text.size(), &found) == 0 && found != nullptr)
    return found->pw_name;
  return "uid " + std::to_string(user);
}

/// Refuses everything but an old socket.
Status clear_the_way(const std::filesystem::path& path) {
  struct stat found {};
  if (lstat(path.c_str(), &found) != 0) return {};
  if (!S_ISSOCK(found.st_mode))
    return fail({.code = Errc::invalid_argument,
                 .where = path.string(),
                 .what = "something else is in the way of the socket",
                 .expected = "nothing, or an old socket",
                 .got = S_ISLNK(found.st_mode) ? "a symbolic link" : "a file or folder",
                 .hint = "Move it away"});
  asio::io_context context;
  Unix::socket probe(context);
  asio::error_code error;
  probe.connect(Unix::endpoint(path.string()), error);
  if (!error)
    return fail({.code = Errc::wrong_state,
                 .where = path.string(),
                 .what = "another daemon listens there",
                 .hint = "Stop it, or choose another --socket"});
  std::error_code removed;
  std::filesystem::remove(path, removed);
  if (removed)
    return fail({.code = Errc::io,
                 .where = path.string(),
                 .what = "cannot remove the old socket",
                 .got = removed.message()});
  return {};
}

}  // namespace

Status open_unix(Unix::acceptor& acceptor, const std::filesystem::path& path) {
  constexpr std::size_t longest = 107;  // sun_path
  if (path.string().size() > longest)
    return fail({.code = Errc::range,
                 .where = path.string(),
                 .what = "the socket's path is too long",
                 .expected = "107 bytes",
                 .got = std::to_string(path.string().size())});
  if (Status clear = clear_the_way(path); !clear) return clear;
  asio::error_code error;
  acceptor.open(Unix(), error);
  const mode_t before = umask(static_cast<mode_t>(~socket_mode & 0777));
  if (!error) acceptor.bind(Unix::endpoint(path.string()), error);
  umask(before);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error)
    return fail({.code = Errc::io,
                 .where = path.string(),
                 .what = "cannot listen",
                 .got = error.message()});
  return {};
}

Peer read_peer(int descriptor) {
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0)
    return {true, {}, std::nullopt};
  const bool own = credentials.uid == 0 || credentials.uid == geteuid();
  return {true, name_of(credentials.uid), own ? access::Role::admin : access::Role::operator_};
}

}  // namespace weft::daemon::server
