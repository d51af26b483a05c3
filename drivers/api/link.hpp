#pragma once
// A link moves bytes and stamps their arrival. It knows nothing about frames.

#include <functional>

#include "protocols/base/bytes.hpp"
#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"

namespace weft {

/// Serial links deliver any chunking of the stream; datagram links deliver one datagram a call.
class Link {
 public:
  using Receiver = std::function<void(ByteView bytes, TimePoint arrival)>;
  using Closed = std::function<void(const Error& why)>;

  virtual ~Link() = default;
  virtual Status write(ByteView bytes) = 0;
  /// Replaces the receiver; an empty function stops delivery.
  virtual void on_receive(Receiver receiver) = 0;
  /// Called at most once, when the far end goes away.
  virtual void on_closed(Closed closed) = 0;
};

}  // namespace weft
