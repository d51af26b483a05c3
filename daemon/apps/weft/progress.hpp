#pragma once
// How far a run is: a bar with the time left on a terminal, plain lines elsewhere.

#include <cstddef>
#include <iosfwd>
#include <mutex>
#include <optional>
#include <string>
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
  void received();
  void closed();

  int terminal_;
  std::ostream* out_;
  RunOrders* orders_;
  std::mutex mutex_;
  std::optional<recipes::Ticket> requested_;
  bool gone_ = false;  ///< the terminal
  std::jthread listener_;
};

/// "[#########...........]" of `width` characters between the brackets; done > planned is full.
std::string bar(std::size_t done, std::size_t planned, std::size_t width);

/// Prints TrialProgress. On a terminal one line that is rewritten; otherwise a line for every 5 %
/// of the trials and for every trial that did not complete.
class ProgressPrinter {
 public:
  ProgressPrinter(std::ostream& out, bool terminal) : out_(&out), terminal_(terminal) {}
  void operator()(const TrialProgress& progress);
  /// In place of the line before it.
  void rewrite(const std::string& line);
  /// Ends the rewritten line.
  void finish();

 private:
  void step(const TrialProgress& progress, const std::string& line);

  std::ostream* out_;
  bool terminal_;
  std::size_t last_width_ = 0;
  std::size_t lines_ = 0;  ///< twentieths printed so far
};

}  // namespace weft::daemon::cli
