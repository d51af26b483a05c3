#pragma once
// Ctrl-C, SIGTERM and a terminal that is closed while a campaign runs: the first asks it to end
// tidily, a second Ctrl-C or SIGTERM ends the process.

#include <signal.h>

#include <atomic>

namespace weft::daemon::cli {

/// While it lives, the first SIGINT, SIGTERM or SIGHUP sets asked(), and the first two then have
/// their default effect again; of a closed terminal the kernel and the shell both tell, so SIGHUP
/// never ends the process. Nor does a reader of what is printed that has gone, as `| head` does: it
/// would leave the probe where it is. A signal that was ignored, as by nohup, stays ignored. One at
/// a time.
class StopSignals {
 public:
  StopSignals();
  ~StopSignals();  ///< puts the actions back that were there before
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  [[nodiscard]] const std::atomic<bool>& asked() const;
  /// The signal that came, or 0.
  [[nodiscard]] int number() const;

 private:
  struct sigaction before_interrupt_ {};
  struct sigaction before_terminate_ {};
  struct sigaction before_hangup_ {};
  struct sigaction before_pipe_ {};
};

}  // namespace weft::daemon::cli
