#pragma once
// The device's end of a link: it waits for hosts at the place that the rig file names, on a
// terminal, UDP or TCP, one host or several.

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

/// The device's end of a link, whose plug can be pulled.
class ServedPlace : public Link {
 public:
  /// Out: what a host sees when the plug is pulled. In: the same place again, for hosts to open
  /// anew. Nothing is done when it is so already. Errors: io, when the place cannot be had again.
  virtual Status set_plugged(bool in) = 0;
  /// Whether a host may be there. On a datagram port it stays one that was there once.
  [[nodiscard]] virtual bool has_host() const = 0;
  /// Told at once when a host has come. `is_new`: it is another one for the device; false where the
  /// device's conversation at another place goes on.
  using HostCame = std::function<void(bool is_new)>;
  /// On a datagram port hosts come and go unseen.
  virtual void on_host_came(HostCame) {}
};

/// Hands every host that connects to `accepted`. Errors: not_found (address), io (port taken).
class TcpDoor {
 public:
  using Accepted = std::function<void(std::unique_ptr<Link> host)>;
  /// How a connection ends when its link is destroyed here: after what was sent has arrived, or at
  /// once, with a reset.
  enum class Ends : std::uint8_t { in_order, reset };
  static Result<std::unique_ptr<TcpDoor>> open(RealLoop& loop, const Endpoint& at,
                                               Accepted accepted, Ends ends = Ends::in_order);
  ~TcpDoor();
  /// The port it listens on; the system's choice when 0 was asked for.
  [[nodiscard]] std::uint16_t port() const;

 private:
  struct Parts;
  explicit TcpDoor(std::shared_ptr<Parts> parts) : parts_(std::move(parts)) {}
  std::shared_ptr<Parts> parts_;
};

/// A place behind a TCP door: out, connections are reset and others refused.
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

/// `Place` is made of `arguments` and plugged in.
template <class Place, class... Arguments>
Result<std::unique_ptr<ServedPlace>> plugged_in(Arguments&&... arguments) {
  auto made = std::make_unique<Place>(std::forward<Arguments>(arguments)...);
  if (Status in = made->set_plugged(true); !in) return pass(in.error());
  return std::unique_ptr<ServedPlace>(std::move(made));
}

/// One host at a time, the newest wins. Unplugged, the host's connection is reset and others are
/// refused.
Result<std::unique_ptr<ServedPlace>> serve_tcp(RealLoop& loop, const Endpoint& at);
/// Whether a datagram makes its sender the one who is answered.
using Redirects = std::function<bool(ByteView datagram)>;
/// Answers go to whoever sent the last datagram that redirects them; before there was one, to port
/// `unasked` of this address, to nobody where that is 0. Unplugged, it is silent: a cable that is
/// out sends no refusal.
Result<std::unique_ptr<ServedPlace>> serve_udp(RealLoop& loop, const Endpoint& at,
                                               Redirects redirects, std::uint16_t unasked = 0);

// A port of an emulated device that takes many clients: a connection and an emulator for each,
// ended when the client asks.

/// Thread-bound to its loop, which outlives it.
class ServedClients {
 public:
  using Make = std::function<std::unique_ptr<sim::ClientEmulator>()>;
  /// Errors: not_found (address), io (port taken).
  static Result<std::unique_ptr<ServedClients>> open(RealLoop& loop, const Endpoint& at, Make make);
  /// Out: connections end, others are refused. Errors: io, when the port cannot be had again.
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

/// How many bytes at the front are whole messages, or no part of any.
using WholeMessages = std::function<std::size_t(ByteView)>;

/// Serves one device. What is sent while nobody listens is lost, as on a wire. A host may come, go
/// and come again.
///   serial  a pseudo-terminal; `path` becomes a symbolic link to it, removed with the link
///   tcp     listens at host:port; several hosts where `whole` tells their messages apart, else one
///           at a time, the newest wins
///   udp     bound to host:port; answers go to whoever sent the last datagram that redirects them
/// Errors: io, when the place is taken or cannot be made; wrong_state for a link in memory.
Result<std::unique_ptr<ServedPlace>> serve_link(RealLoop& loop, const LinkSettings& settings,
                                                Redirects redirects, WholeMessages whole = {});

/// One device at several places. What it answers goes to whom it answers, what it says unasked to
/// all. There must be at least one.
std::unique_ptr<ServedPlace> join_links(std::vector<std::unique_ptr<ServedPlace>> places);

}  // namespace weft::daemon
