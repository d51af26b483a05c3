#pragma once
// Devices on TCP and UDP.

#include <functional>
#include <memory>
#include <utility>

#include "daemon/apps/weft_rig/served_place.hpp"
#include "daemon/hardware/link/port_link.hpp"

namespace weft::daemon {

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

}  // namespace weft::daemon
