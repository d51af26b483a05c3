#pragma once
// Who has a pseudo-terminal open: hosts of a terminal come and go unseen otherwise.

#include <functional>
#include <memory>
#include <string>

#include "daemon/link/port_link.hpp"

namespace weft::daemon {

/// Counts openings and closings (inotify). Thread-bound to its loop, which outlives it. Where the
/// system does not tell of them, somebody is taken to be there always.
class TerminalWatch {
 public:
  /// `changed` is called when the first opens the terminal and when the last has closed it.
  TerminalWatch(RealLoop& loop, const std::string& terminal, std::function<void()> changed);

  [[nodiscard]] bool somebody() const { return !tells_ || open_ > 0; }
  /// Bytes have come from the terminal: its opening is noticed before them.
  void heard();

 private:
  void take(ByteView events);

  std::function<void()> changed_;
  int queue_ = -1;                ///< owned by events_
  std::unique_ptr<Link> events_;  ///< nullptr: the system does not tell
  bool tells_ = false;
  bool told_ = false;  ///< of one opening at least
  int open_ = 0;
};

}  // namespace weft::daemon
