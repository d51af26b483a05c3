#pragma once
// Orders to weft-rig: one JSON object a line, each answered by one, in order.

#include <deque>
#include <functional>
#include <memory>
#include <string>

#include "drivers/api/link.hpp"

namespace weft::daemon {

/// The host's end. Thread-bound to the link's loop.
class RigConsole {
 public:
  using Answer = std::function<void(Status)>;
  explicit RigConsole(std::unique_ptr<Link> link);

  /// Puts a patch of a fabric on the emulated plate. Errors told: those of weft-rig; io.
  void mount(std::string_view fabric, std::uint64_t patch_seed, Answer answer);
  /// Lets a fault befall a device, or ends some: `fault_json` as FaultOrder has it. Errors told:
  /// likewise.
  void inject_fault(std::string_view fault_json, bool ends, Answer answer);

 private:
  void send(const std::string& order, Answer answer);
  void take(ByteView bytes);
  void answer(Status status);

  std::deque<Answer> waiting_;
  std::string line_;
  std::unique_ptr<Link> link_;
};

}  // namespace weft::daemon
