#pragma once
// Two ends of an in-memory byte pipe for virtual time. Bytes written at one end arrive at the other
// after a fixed latency, in order.

#include <memory>
#include <utility>

#include "drivers/api/driver.hpp"
#include "drivers/api/timer.hpp"

namespace weft::daemon {

/// One end. Thread-bound to its loop.
class MemoryLink final : public Link {
 public:
  /// Both ends of a pipe. Each write arrives as one piece `latency` later: at the first end on
  /// `first`, at the second on `second`. The loops are two views of one clock and outlive the pipe.
  static std::pair<std::unique_ptr<MemoryLink>, std::unique_ptr<MemoryLink>> make_pair(
      Loop& first, Loop& second, Duration latency);
  ~MemoryLink() override;

  Status write(ByteView bytes) override;
  void on_receive(Receiver receiver) override;
  void on_closed(Closed closed) override;
  /// Cuts the pipe: the far end is notified, and later writes fail on both sides.
  void unplug();

 private:
  struct Shared;
  MemoryLink(std::shared_ptr<Shared> shared, int side) : shared_(std::move(shared)), side_(side) {}

  std::shared_ptr<Shared> shared_;
  int side_;
};

}  // namespace weft::daemon
