#pragma once
// Ctrl-C, SIGTERM and a terminal that is closed while a campaign runs: the first asks it to end
// tidily, a second Ctrl-C or SIGTERM ends the process. SIGHUP asks a daemon to reload instead.

#include <signal.h>

#include <atomic>

namespace weft::daemon::cli {

/// While it lives, who reads what is printed may go, as `| head` does: writing fails then, where it
/// would have ended the process and left the probe where it is.
class IgnoreBrokenPipe {
 public:
  IgnoreBrokenPipe();
  ~IgnoreBrokenPipe();  ///< puts the action back that was there before
  IgnoreBrokenPipe(const IgnoreBrokenPipe&) = delete;
  IgnoreBrokenPipe& operator=(const IgnoreBrokenPipe&) = delete;

 private:
  struct sigaction before_ {};
};

/// While it lives, the first SIGINT, SIGTERM or SIGHUP sets requested(), and the first two then
/// have their default effect again; of a closed terminal the kernel and the shell both tell, so
/// SIGHUP never ends the process. A signal that was ignored, as by nohup, stays ignored. One at a
/// time. With Hangup::reloads SIGHUP sets reload_requested() alone, also where it was ignored.
class StopSignals {
 public:
  enum class Hangup { stops, reloads };
  explicit StopSignals(Hangup hangup = Hangup::stops);
  ~StopSignals();  ///< puts the actions back that were there before
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  [[nodiscard]] const std::atomic<bool>& requested() const;
  /// Taken back by whoever reloads.
  [[nodiscard]] static std::atomic<bool>& reload_requested();
  /// The signal that came, or 0.
  [[nodiscard]] int number() const;

 private:
  struct sigaction before_interrupt_ {};
  struct sigaction before_terminate_ {};
  struct sigaction before_hangup_ {};
  IgnoreBrokenPipe ignore_broken_pipe_;
};

}  // namespace weft::daemon::cli
