#pragma once
// The link that all ports share: a descriptor, read when it is ready, written at once.

#include <functional>
#include <memory>
#include <string>

#include "daemon/base/loop/real_loop.hpp"
#include "drivers/api/driver.hpp"

namespace weft::daemon {

enum class Framing : std::uint8_t {
  stream,     ///< no bytes for good means that the far end is gone
  terminals,  ///< of a pseudo-terminal's master: nobody has the other end open, until resume()
  datagrams   ///< each read and write is one datagram; a far end that is not there yet is no error
};

enum class Unsent : std::uint8_t {
  waits,  ///< what the port does not take at once is sent when it does
  lost    ///< as on a wire at whose end nobody is; never a part: of a message that was begun the
          ///< rest waits, and what is written meanwhile is lost
};

/// Thread-bound to its loop. Owns the descriptor.
class DescriptorLink final : public Link {
 public:
  /// Bytes that may wait for a far end that does not take them; more is an error.
  static constexpr std::size_t most_waiting = std::size_t{1} << 20;

  DescriptorLink(RealLoop& loop, int descriptor, Framing framing, std::string name,
                 Unsent unsent = Unsent::waits);
  ~DescriptorLink() override;

  /// Errors: io, when the port is closed, fails or has more than `most_waiting` bytes unsent.
  Status write(ByteView bytes) override;
  void on_receive(Receiver receiver) override;
  void on_closed(Closed closed) override;

  /// Nothing goes out before `delay` is over; what is written meanwhile waits. What comes in until
  /// then is dropped, and so is what both sides of the port held: purged at half of it.
  void hold_for(Duration delay);
  /// What waits is not sent any more.
  void forget_unsent();
  /// Of a master: called when the last has closed the terminal; nothing is read until resume().
  void on_vacant(std::function<void()> vacant);
  void resume();

 private:
  struct Port;
  std::shared_ptr<Port> port_;
};

}  // namespace weft::daemon
