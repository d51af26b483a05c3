#pragma once
// Progress of a run: a bar with the time left on a terminal, plain lines elsewhere.

#include <cstddef>
#include <iosfwd>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "daemon/campaign/campaign.hpp"

namespace weft::daemon::cli {

/// Reads the terminal on its own thread, so that the run's loop never blocks. A line typed before a
/// prompt is dropped: it confirms nothing. After the end of the input no confirmation is possible,
/// and the next operator step stops the run.
class ConsolePrompt {
 public:
  /// `terminal`: descriptor to read; below 0 there is no person, and every step counts as
  /// confirmed. `out` and `orders` must outlive it.
  ConsolePrompt(int terminal, std::ostream& out, RunOrders& orders);
  /// Call on the run's thread at each change.
  void moment(const RunStatusUpdate& moment);

 private:
  void listen(const std::stop_token& stop);
  void received();
  void closed();

  int terminal_;
  std::ostream* out_;
  RunOrders* orders_;
  std::mutex mutex_;
  std::optional<recipes::Ticket> requested_;
  bool gone_ = false;  ///< the terminal is closed
  std::jthread listener_;
};

/// "[#########...........]" of `width` characters between the brackets; done > planned is full.
std::string bar(std::size_t done, std::size_t planned, std::size_t width);

/// Prints TrialProgress. On a terminal one line is rewritten. Elsewhere it prints a line for every
/// 5 % of the trials and for every trial that did not complete.
class ProgressPrinter {
 public:
  ProgressPrinter(std::ostream& out, bool terminal) : out_(&out), terminal_(terminal) {}
  void operator()(const TrialProgress& progress);
  /// Replaces the line before it.
  void rewrite(const std::string& line);
  /// Ends the rewritten line.
  void finish();

 private:
  void step(const TrialProgress& progress, const std::string& line);

  std::ostream* out_;
  bool terminal_;
  std::size_t last_width_ = 0;
  std::size_t lines_ = 0;  ///< twentieths printed
};

}  // namespace weft::daemon::cli
