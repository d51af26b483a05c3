#pragma once
// The link that all ports share: a descriptor, read when it is ready, written at once.

#include <functional>
#include <memory>
#include <string>

#include "daemon/base/loop/real_loop.hpp"
#include "drivers/api/driver.hpp"

namespace weft::daemon {

enum class Framing : std::uint8_t {
  stream,  ///< end of file means that the far end is gone
  /// The master of a pseudo-terminal; reading pauses while the other end is not open, until
  /// resume().
  terminals,
  datagrams  ///< each read and write is one datagram; a far end that is not there yet is no error
};

enum class Unsent : std::uint8_t {
  waits,  ///< bytes that the port does not accept at once are sent later
  /// Bytes are lost, as on a wire without a receiver. Messages are never split: the rest of a
  /// started message waits, and later writes are lost meanwhile.
  lost
};

/// Thread-bound to its loop. Owns the descriptor.
class DescriptorLink final : public Link {
 public:
  /// Maximum number of bytes that wait for a far end; more is an error.
  static constexpr std::size_t most_waiting = std::size_t{1} << 20;

  DescriptorLink(RealLoop& loop, int descriptor, Framing framing, std::string name,
                 Unsent unsent = Unsent::waits);
  ~DescriptorLink() override;

  /// Errors: io if the port is closed, fails or has more than `most_waiting` bytes unsent.
  Status write(ByteView bytes) override;
  void on_receive(Receiver receiver) override;
  void on_closed(Closed closed) override;

  /// Sends nothing until `delay` is over: writes wait. Drops all bytes received until then. At half
  /// of `delay` it purges the buffers of both sides.
  void hold_for(Duration delay);
  /// Discards the waiting bytes.
  void forget_unsent();
  /// For a master: called when the last program has closed the terminal. Nothing is read until
  /// resume().
  void on_vacant(std::function<void()> vacant);
  void resume();

 private:
  struct Port;
  std::shared_ptr<Port> port_;
};

}  // namespace weft::daemon
