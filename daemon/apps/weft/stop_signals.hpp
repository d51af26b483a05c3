#pragma once
// Ctrl-C, SIGTERM and a terminal that is closed while a campaign runs: the first asks it to end
// tidily, a second Ctrl-C or SIGTERM ends the process. SIGHUP asks a daemon to reload instead.
// Ctrl-Z would leave the probe on the cloth without control: it is refused.

#include <signal.h>

#include <array>
#include <atomic>

namespace weft::daemon::cli {

/// While it lives, a write that cannot be done fails, where a signal would have ended the process
/// and left the probe where it is: SIGPIPE (a reader that is gone, as `| head`) and SIGXFSZ (the
/// limit of a file's size).
class IgnoreWriteSignals {
 public:
  IgnoreWriteSignals();
  ~IgnoreWriteSignals();  ///< puts the actions back that were there before
  IgnoreWriteSignals(const IgnoreWriteSignals&) = delete;
  IgnoreWriteSignals& operator=(const IgnoreWriteSignals&) = delete;

 private:
  struct sigaction before_pipe_ {};
  struct sigaction before_size_ {};
};

/// While it lives, the first SIGINT, SIGTERM or SIGHUP sets requested(), and the first two then
/// have their default effect again; of a closed terminal the kernel and the shell both tell, so
/// SIGHUP never ends the process. A signal that was ignored, as by nohup, stays ignored. One at a
/// time. With Hangup::reloads SIGHUP sets reload_requested() alone, also where it was ignored.
/// With Suspend::refused SIGTSTP writes a sentence to standard error, and a terminal does not stop
/// a process in the background that reads or writes (SIGTTIN, SIGTTOU).
class StopSignals {
 public:
  enum class Hangup { stops, reloads };
  enum class Suspend { allowed, refused };
  explicit StopSignals(Hangup hangup = Hangup::stops, Suspend suspend = Suspend::refused);
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
  Suspend suspend_;
  std::array<struct sigaction, 3> before_suspend_{};
  IgnoreWriteSignals ignore_write_signals_;
};

}  // namespace weft::daemon::cli
