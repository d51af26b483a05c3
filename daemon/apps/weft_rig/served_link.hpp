#pragma once
// The device's end of a link. It waits for one or several hosts at the place that the rig file
// names: a terminal, UDP or TCP.

#include <functional>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "daemon/hardware/link/port_link.hpp"
#include "daemon/hardware/rig/rig_file.hpp"
#include "drivers/api/driver.hpp"
#include "sim/devices/emulator.hpp"

namespace weft::daemon {

/// The device's end of a link, with a plug that can be pulled.
class ServedPlace : public Link {
 public:
  /// False: hosts see a pulled plug. True: opens the same place again; hosts have to open it anew.
  /// No effect if the plug is in that state already. Errors: io if the place cannot be opened
  /// again.
  virtual Status set_plugged(bool in) = 0;
  /// Whether a host may be connected. A datagram port keeps its host once it had one.
  [[nodiscard]] virtual bool has_host() const = 0;
  /// Called at once when a host has connected. `is_new`: the device sees another host; false if its
  /// exchange with a host at another place continues.
  using HostCame = std::function<void(bool is_new)>;
  /// Without effect on a datagram port, where hosts are not seen to come and go.
  virtual void on_host_came(HostCame) {}
};

/// Passes every host that connects to `accepted`. Errors: not_found (address), io (port in use).
class TcpDoor {
 public:
  using Accepted = std::function<void(std::unique_ptr<Link> host)>;
  /// How a connection ends when its link is destroyed here: after the sent bytes have arrived, or
  /// at once with a reset.
  enum class Ends : std::uint8_t { in_order, reset };
  static Result<std::unique_ptr<TcpDoor>> open(RealLoop& loop, const Endpoint& at,
                                               Accepted accepted, Ends ends = Ends::in_order);
  ~TcpDoor();
  /// The port it listens on; chosen by the system if 0 was given.
  [[nodiscard]] std::uint16_t port() const;

 private:
  struct Parts;
  explicit TcpDoor(std::shared_ptr<Parts> parts) : parts_(std::move(parts)) {}
  std::shared_ptr<Parts> parts_;
};

/// A place on a TCP port. Unplugged, its connections are reset and new ones are refused.
class TcpPlace : public ServedPlace {
 public:
  TcpPlace(RealLoop& loop, Endpoint at) : loop_(&loop), at_(std::move(at)) {}
  Status set_plugged(bool in) override;
  void on_receive(Receiver receiver) override { receiver_ = std::move(receiver); }
  void on_closed(Closed) override {}  // a device outlives its hosts

 protected:
  virtual void welcome(std::unique_ptr<Link> host) = 0;
  virtual void part_with_hosts() = 0;
  [[nodiscard]] RealLoop& loop() const { return *loop_; }
  void on_bytes(ByteView bytes, TimePoint at) const {
    if (receiver_) receiver_(bytes, at);
  }

 private:
  RealLoop* loop_;
  Endpoint at_;
  Receiver receiver_;
  std::unique_ptr<TcpDoor> door_;
};

/// Makes a `Place` from `arguments` and plugs it in. Errors: those of set_plugged().
template <class Place, class... Arguments>
Result<std::unique_ptr<ServedPlace>> plugged_in(Arguments&&... arguments) {
  auto made = std::make_unique<Place>(std::forward<Arguments>(arguments)...);
  if (Status in = made->set_plugged(true); !in) return pass(in.error());
  return std::unique_ptr<ServedPlace>(std::move(made));
}

/// One host at a time; a new host replaces the old one. Unplugged, the host's connection is reset
/// and new ones are refused.
Result<std::unique_ptr<ServedPlace>> serve_tcp(RealLoop& loop, const Endpoint& at);
/// Whether later replies go to the sender of this datagram.
using Redirects = std::function<bool(ByteView datagram)>;
/// Replies go to the sender of the last redirecting datagram. Before the first, they go to port
/// `unasked` of the given address, or are dropped if that is 0. Unplugged, it is silent: a pulled
/// cable sends no refusal. Errors: not_found (address), io (port in use).
Result<std::unique_ptr<ServedPlace>> serve_udp(RealLoop& loop, const Endpoint& at,
                                               Redirects redirects, std::uint16_t unasked = 0);

// A port of an emulated device for many clients. Each has its own connection and emulator, which
// end when the client asks for it.

/// Thread-bound to its loop, which must outlive it.
class ServedClients {
 public:
  using Make = std::function<std::unique_ptr<sim::ClientEmulator>()>;
  /// Errors: not_found (address), io (port in use).
  static Result<std::unique_ptr<ServedClients>> open(RealLoop& loop, const Endpoint& at, Make make);
  /// False: connections end and new ones are refused. Errors: io if the port cannot be opened
  /// again.
  Status set_plugged(bool in);

 private:
  ServedClients(RealLoop& loop, Endpoint at, Make make)
      : loop_(&loop), at_(std::move(at)), make_(std::move(make)) {}
  void welcome(std::unique_ptr<Link> host);
  void answer(std::size_t client, ByteView bytes, TimePoint at);
  void end_soon(std::size_t client);

  struct Client {
    std::unique_ptr<Link> link;
    std::unique_ptr<sim::ClientEmulator> emulator;
  };
  RealLoop* loop_;
  Endpoint at_;
  Make make_;
  std::map<std::size_t, Client> clients_;
  std::size_t next_client_ = 0;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
  std::unique_ptr<TcpDoor> door_;
};

/// Number of bytes at the front that form whole messages or belong to none.
using WholeMessages = std::function<std::size_t(ByteView)>;

/// Serves one device. Bytes sent without a host are lost, as on a wire. A host may disconnect and
/// connect again.
///   serial  a pseudo-terminal; `path` becomes a symbolic link to it, removed with the link
///   tcp     listens at host:port; several hosts if `whole` can separate their messages, else one
///   at
///           a time, the newest replaces the older
///   udp     bound to host:port; replies go to the sender of the last redirecting datagram
/// Errors: io if the place is in use or cannot be made; wrong_state for a link in memory.
Result<std::unique_ptr<ServedPlace>> serve_link(RealLoop& loop, const LinkSettings& settings,
                                                Redirects redirects, WholeMessages whole = {});

/// Joins several places (at least one) of one device. A reply goes to the place that asked; an
/// unsolicited message goes to all.
std::unique_ptr<ServedPlace> join_links(std::vector<std::unique_ptr<ServedPlace>> places);

}  // namespace weft::daemon
