#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "daemon/hardware/link/descriptor_link.hpp"
#include "daemon/hardware/link/port_link.hpp"

namespace weft::daemon {
namespace {

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
  if (code != 0)
    return fail({.code = Errc::not_found,
                 .where = words(end),
                 .what = "host not found",
                 .got = ::gai_strerror(code)});
  return Addresses(list);
}

/// The outcome of a connect in progress: 0, or a number of <cerrno>.
int outcome(int descriptor, Duration limit) {
  pollfd ready{descriptor, POLLOUT, 0};
  const auto limit_ms = std::chrono::duration_cast<std::chrono::milliseconds>(limit).count();
  if (::poll(&ready, 1, static_cast<int>(limit_ms)) <= 0) return ETIMEDOUT;
  int number = 0;
  socklen_t size = sizeof number;
  ::getsockopt(descriptor, SOL_SOCKET, SO_ERROR, &number, &size);
  return number;
}

int connect_to(int descriptor, const addrinfo& address, Duration limit) {
  if (::connect(descriptor, address.ai_addr, address.ai_addrlen) == 0) return 0;
  return errno == EINPROGRESS ? outcome(descriptor, limit) : errno;
}

/// Binds to any address of this computer. Returns 0, or a number of <cerrno>.
int bind_to(int descriptor, int family, std::uint16_t port) {
  if (port == 0) return 0;
  sockaddr_in6 six{};
  sockaddr_in four{};
  six.sin6_family = AF_INET6;
  four.sin_family = AF_INET;
  six.sin6_port = four.sin_port = htons(port);
  const bool is_six = family == AF_INET6;
  const auto* const any =
      is_six ? reinterpret_cast<const sockaddr*>(&six) : reinterpret_cast<const sockaddr*>(&four);
  const auto size = static_cast<socklen_t>(is_six ? sizeof six : sizeof four);
  return ::bind(descriptor, any, size) == 0 ? 0 : errno;
}

/// Tries each address of the name in turn.
Result<int> connected_socket(const Endpoint& end, int type, Duration limit,
                             std::uint16_t local_port = 0) {
  const Result<Addresses> addresses = resolve(end, type);
  if (!addresses) return pass(addresses.error());
  int number = 0;
  bool own_port_refused = false;
  for (const addrinfo* a = addresses->get(); a != nullptr; a = a->ai_next) {
    const int descriptor =
        ::socket(a->ai_family, a->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, a->ai_protocol);
    number = descriptor < 0 ? errno : bind_to(descriptor, a->ai_family, local_port);
    own_port_refused = descriptor >= 0 && number != 0;
    if (number == 0) number = connect_to(descriptor, *a, limit);
    if (number == 0) return descriptor;
    if (descriptor >= 0) ::close(descriptor);
  }
  if (own_port_refused)
    return fail({.code = Errc::io,
                 .where = std::to_string(local_port),
                 .what = "port cannot be opened for listening",
                 .got = std::generic_category().message(number),
                 .hint = "End the other program or run that uses the port"});
  return fail(
      {.code = number == ETIMEDOUT ? Errc::timeout : Errc::io,
       .where = words(end),
       .what = "connection failed",
       .got = std::generic_category().message(number),
       .hint = "Check that the device is on, its address and the network of this computer"});
}

/// One second of a Net F/T box at 7000 datagrams, which the kernel counts as about 800 bytes each.
constexpr int datagram_buffer = 4 << 20;

/// Requests the size with privilege first; without it the limit is net.core.rmem_max.
void enlarge_receive_buffer(int socket) {
  if (::setsockopt(socket, SOL_SOCKET, SO_RCVBUFFORCE, &datagram_buffer, sizeof(int)) != 0)
    ::setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &datagram_buffer, sizeof(int));
}

constexpr Duration again_limit = std::chrono::seconds(1);

class RequestLink final : public Link {
 public:
  RequestLink(RealLoop& loop, Endpoint far_end, std::unique_ptr<Link> first)
      : loop_(&loop), far_end_(std::move(far_end)), connection_(std::move(first)) {
    read_next();
  }

  Status write(ByteView bytes) override {
    if (std::exchange(used_, true)) {
      auto next = open_tcp(*loop_, far_end_, again_limit);
      if (!next) return pass(next.error());
      connection_ = std::move(*next);
      read_next();
    }
    return connection_->write(bytes);
  }
  void on_receive(Receiver receiver) override { receiver_ = std::move(receiver); }
  void on_closed(Closed closed) override { closed_ = std::move(closed); }

 private:
  // A callback may write, which replaces the connection, or stop listening. Do not touch members of
  // this object after it.
  void read_next() {
    connection_->on_receive([this](ByteView bytes, TimePoint at) {
      if (const Receiver now = receiver_) now(bytes, at);
    });
    connection_->on_closed([this](const Error& why) {
      used_ = true;  // a server does not wait for long
      if (const Closed callback = std::exchange(closed_, {})) callback(why);
    });
  }

  RealLoop* loop_;
  Endpoint far_end_;
  std::unique_ptr<Link> connection_;
  bool used_ = false;
  Receiver receiver_;
  Closed closed_;
};

}  // namespace

Result<std::unique_ptr<Link>> open_tcp(RealLoop& loop, const Endpoint& far_end, Duration limit) {
  const Result<int> socket = connected_socket(far_end, SOCK_STREAM, limit);
  if (!socket) return pass(socket.error());
  const int on = 1;
  ::setsockopt(*socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  return std::unique_ptr<Link>(
      std::make_unique<DescriptorLink>(loop, *socket, Framing::stream, words(far_end)));
}

Result<std::unique_ptr<Link>> open_udp(RealLoop& loop, const Endpoint& far_end,
                                       std::uint16_t local_port) {
  const Result<int> socket = connected_socket(far_end, SOCK_DGRAM, {}, local_port);
  if (!socket) return pass(socket.error());
  enlarge_receive_buffer(*socket);
  return std::unique_ptr<Link>(
      std::make_unique<DescriptorLink>(loop, *socket, Framing::datagrams, words(far_end)));
}

Result<std::unique_ptr<Link>> open_requests(RealLoop& loop, const Endpoint& far_end) {
  auto first = open_tcp(loop, far_end);
  if (!first) return pass(first.error());
  return std::unique_ptr<Link>(std::make_unique<RequestLink>(loop, far_end, std::move(*first)));
}

}  // namespace weft::daemon
