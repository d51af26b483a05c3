#pragma once
// Ctrl-C and SIGTERM while a campaign runs: the first asks it to end tidily, the second ends the
// process.

#include <signal.h>

#include <atomic>

namespace weft::daemon::cli {

/// While it lives, the first SIGINT or SIGTERM sets asked(), and both signals then have their
/// default effect again. A signal that was ignored stays ignored. One at a time.
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
};

}  // namespace weft::daemon::cli
