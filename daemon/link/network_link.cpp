#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "daemon/link/descriptor_link.hpp"
#include "daemon/link/port_link.hpp"

namespace weft::daemon {
namespace {

constexpr int connect_limit_ms = 3000;

std::string words(const Endpoint& end) {
  return end.host + ":" + std::to_string(end.port);
}

struct FreeAddresses {
  void operator()(addrinfo* list) const { ::freeaddrinfo(list); }
};
using Addresses = std::unique_ptr<addrinfo, FreeAddresses>;

Result<Addresses> resolve(const Endpoint& end, int type) {
  addrinfo wanted{};
  wanted.ai_family = AF_UNSPEC;
  wanted.ai_socktype = type;
  wanted.ai_flags = AI_NUMERICSERV;
  addrinfo* list = nullptr;
  const int code =
      ::getaddrinfo(end.host.c_str(), std::to_string(end.port).c_str(), &wanted, &list);
  if (code != 0) return fail(Errc::not_found, "no such host", words(end), {}, ::gai_strerror(code));
  return Addresses(list);
}

/// The outcome of a connect that is under way: 0, or a number of <cerrno>.
int outcome(int descriptor) {
  pollfd ready{descriptor, POLLOUT, 0};
  if (::poll(&ready, 1, connect_limit_ms) <= 0) return ETIMEDOUT;
  int number = 0;
  socklen_t size = sizeof number;
  ::getsockopt(descriptor, SOL_SOCKET, SO_ERROR, &number, &size);
  return number;
}

int connect_to(int descriptor, const addrinfo& address) {
  if (::connect(descriptor, address.ai_addr, address.ai_addrlen) == 0) return 0;
  return errno == EINPROGRESS ? outcome(descriptor) : errno;
}

/// Tries each address of the name in turn.
Result<int> connected_socket(const Endpoint& end, int type) {
  const Result<Addresses> addresses = resolve(end, type);
  if (!addresses) return pass(addresses.error());
  int number = 0;
  for (const addrinfo* a = addresses->get(); a != nullptr; a = a->ai_next) {
    const int descriptor =
        ::socket(a->ai_family, a->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, a->ai_protocol);
    number = descriptor < 0 ? errno : connect_to(descriptor, *a);
    if (number == 0) return descriptor;
    if (descriptor >= 0) ::close(descriptor);
  }
  return fail(number == ETIMEDOUT ? Errc::timeout : Errc::io, "cannot connect", words(end), {},
              std::generic_category().message(number),
              "Is the device on, and are its address and this machine's network right?");
}

}  // namespace

Result<std::unique_ptr<Link>> open_tcp(RealLoop& loop, const Endpoint& far_end) {
  const Result<int> socket = connected_socket(far_end, SOCK_STREAM);
  if (!socket) return pass(socket.error());
  const int on = 1;
  ::setsockopt(*socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  return std::unique_ptr<Link>(
      std::make_unique<DescriptorLink>(loop, *socket, Framing::stream, words(far_end)));
}

Result<std::unique_ptr<Link>> open_udp(RealLoop& loop, const Endpoint& far_end) {
  const Result<int> socket = connected_socket(far_end, SOCK_DGRAM);
  if (!socket) return pass(socket.error());
  return std::unique_ptr<Link>(
      std::make_unique<DescriptorLink>(loop, *socket, Framing::datagrams, words(far_end)));
}

}  // namespace weft::daemon
