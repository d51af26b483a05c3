#pragma once
// Bytes in, bytes out, time as an argument: what every emulated device looks like to the rig.

#include <functional>
#include <optional>

#include "protocols/base/bytes.hpp"
#include "protocols/base/time.hpp"

namespace weft::sim {

/// Takes what a device sends. Each call is one datagram, or one piece of a stream.
using ByteSink = std::function<void(ByteView)>;

/// Times that a caller passes never decrease.
class Emulator {
 public:
  virtual ~Emulator() = default;
  /// Bytes from the host, in any chunking for streams, one datagram a call otherwise.
  virtual void receive(ByteView bytes, TimePoint now, ByteSink& out) = 0;
  /// When the device wants to act by itself next; may lie in the past, then it is due at once.
  [[nodiscard]] virtual std::optional<TimePoint> next_wakeup() const = 0;
  /// Lets it act; early or late calls do no harm.
  virtual void wake(TimePoint now, ByteSink& out) = 0;
};

}  // namespace weft::sim
