#include "daemon/campaign/setup/box_search.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
#include <ranges>
#include <set>
#include <system_error>

namespace weft::daemon {
namespace {

using protocols::rdt::DiscoveryReply;
using protocols::rdt::Ipv4;

tl::unexpected<Error> failed(const char* call) {
  return fail(
      {.code = Errc::io,
       .where = call,
       .what = "search for Net F/T boxes failed",
       .got = std::generic_category().message(errno),
       .hint = "End other programs that search for them, or name the box with --netft HOST"});
}

/// A socket that is closed at the end of its scope.
struct Socket {
  Socket() : descriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {}
  ~Socket() {
    if (descriptor >= 0) ::close(descriptor);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int descriptor;
};

sockaddr_in address_of(in_addr host, std::uint16_t port) {
  sockaddr_in out{};
  out.sin_family = AF_INET;
  out.sin_addr = host;
  out.sin_port = htons(port);
  return out;
}

/// Interface indices of the networks that have broadcasts and are up.
std::set<int> broadcast_networks() {
  std::set<int> out;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return out;
  constexpr unsigned wanted = IFF_UP | IFF_BROADCAST;
  for (const ifaddrs* one = list; one != nullptr; one = one->ifa_next)
    if (one->ifa_addr != nullptr && one->ifa_addr->sa_family == AF_INET &&
        (one->ifa_flags & wanted) == wanted)
      out.insert(static_cast<int>(::if_nametoindex(one->ifa_name)));
  ::freeifaddrs(list);
  return out;
}

/// Sends through one network; 0: by the routes of the computer.
bool send_through(int socket, int network, const sockaddr_in& to, ByteView bytes) {
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(in_pktinfo))]{};
  iovec part{const_cast<std::uint8_t*>(bytes.data()), bytes.size()};
  msghdr message{};
  message.msg_name = const_cast<sockaddr_in*>(&to);
  message.msg_namelen = sizeof to;
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  if (network != 0) {
    message.msg_control = control;
    message.msg_controllen = sizeof control;
    cmsghdr* const head = CMSG_FIRSTHDR(&message);
    head->cmsg_level = IPPROTO_IP;
    head->cmsg_type = IP_PKTINFO;
    head->cmsg_len = CMSG_LEN(sizeof(in_pktinfo));
    reinterpret_cast<in_pktinfo*>(CMSG_DATA(head))->ipi_ifindex = network;
  }
  return ::sendmsg(socket, &message, 0) == static_cast<ssize_t>(bytes.size());
}

/// Boxes reply to a group, so that boxes of another subnet can be found.
void join(int socket, int network, Ipv4 group) {
  ip_mreqn membership{};
  std::copy(group.begin(), group.end(), reinterpret_cast<std::uint8_t*>(&membership.imr_multiaddr));
  membership.imr_ifindex = network;
  static_cast<void>(
      ::setsockopt(socket, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership));
}

using Replies = std::map<Ipv4, DiscoveryReply>;

/// Reads the replies that have arrived, up to a limit that bounds a flood. Ignores a reply that
/// names another address than its sender's: a box of another subnet also sends from its own
/// address.
void take_replies(int socket, Replies& replies) {
  constexpr int most_datagrams = 64;
  std::array<std::uint8_t, 2048> datagram{};
  for (int i = 0; i < most_datagrams && replies.size() < most_boxes; ++i) {
    sockaddr_in from{};
    socklen_t from_size = sizeof from;
    const ssize_t size = ::recvfrom(socket, datagram.data(), datagram.size(), MSG_DONTWAIT,
                                    reinterpret_cast<sockaddr*>(&from), &from_size);
    if (size < 0) return;
    const auto reply = protocols::rdt::decode_discovery_reply(
        ByteView(datagram).first(static_cast<std::size_t>(size)));
    if (reply && std::memcmp(&from.sin_addr, reply->address.data(), sizeof from.sin_addr) == 0)
      replies.emplace(reply->address, *reply);
  }
}

/// Waits as long as the last box may take.
std::vector<DiscoveryReply> receive_replies(int socket, std::uint8_t delay_ms) {
  constexpr int last_reply = 257;  // as in ATI's client
  RealLoop loop;
  const TimePoint end = loop.now() + std::chrono::milliseconds(last_reply * delay_ms);
  Replies replies;
  loop.run_until([&] {  // checked every RealLoop::longest_wait
    take_replies(socket, replies);
    return loop.now() >= end;
  });
  const auto in_order = std::views::values(replies);
  return {in_order.begin(), in_order.end()};
}

}  // namespace

Result<std::vector<DiscoveryReply>> find_boxes(const BoxSearch& search) {
  const Socket socket;
  if (socket.descriptor < 0) return failed("socket");
  const int yes = 1;
  for (const int option : {SO_REUSEADDR, SO_BROADCAST})
    if (::setsockopt(socket.descriptor, SOL_SOCKET, option, &yes, sizeof yes) != 0)
      return failed("setsockopt");
  const sockaddr_in here = address_of({htonl(INADDR_ANY)}, search.reply_port);
  if (::bind(socket.descriptor, reinterpret_cast<const sockaddr*>(&here), sizeof here) != 0)
    return failed("bind");
  in_addr to{};
  if (::inet_pton(AF_INET, search.to.c_str(), &to) != 1) return failed("inet_pton");
  const bool everywhere = to.s_addr == htonl(INADDR_BROADCAST);
  const std::set<int> networks = everywhere ? broadcast_networks() : std::set<int>{0};
  const Bytes request = protocols::rdt::encode(search.request);
  bool sent = networks.empty();  // a computer without a network has no box in it
  for (const int network : networks) {
    if (network != 0) join(socket.descriptor, network, search.request.reply_to);
    sent = send_through(socket.descriptor, network, address_of(to, search.port), request) || sent;
  }
  if (!sent) return failed("sendmsg");
  if (networks.empty()) return std::vector<DiscoveryReply>{};
  return receive_replies(socket.descriptor, search.request.delay_ms);
}

}  // namespace weft::daemon
