#pragma once
// Operator steps of a `weft run`: asked at its terminal, confirmed by Enter.

#include <iosfwd>
#include <mutex>
#include <optional>
#include <thread>

#include "daemon/campaign/campaign.hpp"

namespace weft::daemon::cli {

/// Reads the terminal on a thread of its own, so that the run's loop waits for nobody. A line that
/// was typed before anything was asked is dropped: it confirms nothing. Once the input has ended
/// nobody can confirm any more, and the next step stops the run.
class ConsolePrompt {
 public:
  /// `terminal`: a descriptor to read; below 0 there is nobody, and every step counts as confirmed.
  /// `out` and `orders` outlive it.
  ConsolePrompt(int terminal, std::ostream& out, RunOrders& orders);
  /// Of the run's thread, at each change.
  void moment(const RunStatusUpdate& moment);

 private:
  void listen(const std::stop_token& stop);
  void on_key();
  void closed();

  int terminal_;
  std::ostream* out_;
  RunOrders* orders_;
  std::mutex mutex_;
  std::optional<recipes::Ticket> ticket_;
  bool gone_ = false;  ///< the terminal
  std::jthread listener_;
};

}  // namespace weft::daemon::cli
