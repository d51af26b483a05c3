#pragma once
// Ctrl-C, SIGTERM and a closed terminal while a campaign runs. The first asks it to end in order, a
// second Ctrl-C or SIGTERM ends the process. SIGHUP asks a daemon to reload instead. Ctrl-Z is
// refused: it would leave the probe on the cloth without control.

#include <signal.h>

#include <array>
#include <atomic>

namespace weft::daemon::cli {

/// While it exists, a failed write returns an error. Otherwise a signal would end the process and
/// leave the probe in place: SIGPIPE (a closed reader, as with `| head`) and SIGXFSZ (the limit of
/// a file's size).
class IgnoreWriteSignals {
 public:
  IgnoreWriteSignals();
  ~IgnoreWriteSignals();  ///< restores the earlier actions
  IgnoreWriteSignals(const IgnoreWriteSignals&) = delete;
  IgnoreWriteSignals& operator=(const IgnoreWriteSignals&) = delete;

 private:
  struct sigaction before_pipe_ {};
  struct sigaction before_size_ {};
};

/// While it exists, the first SIGINT, SIGTERM or SIGHUP sets requested(). After a SIGINT or SIGTERM
/// these two have their default effect again. Kernel and shell both report a closed terminal, so
/// SIGHUP never ends the process. A signal that was ignored, as by nohup, stays ignored. Only one
/// object at a time. With Hangup::reloads SIGHUP sets reload_requested() only, even if it was
/// ignored. With Suspend::refused SIGTSTP writes a sentence to standard error, and a terminal does
/// not stop a background process that reads or writes (SIGTTIN, SIGTTOU).
class StopSignals {
 public:
  enum class Hangup { stops, reloads };
  enum class Suspend { allowed, refused };
  explicit StopSignals(Hangup hangup = Hangup::stops, Suspend suspend = Suspend::refused);
  ~StopSignals();  ///< restores the earlier actions
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  [[nodiscard]] const std::atomic<bool>& requested() const;
  /// The code that reloads clears it.
  [[nodiscard]] static std::atomic<bool>& reload_requested();
  /// The first SIGINT or SIGTERM, else SIGHUP after a hang-up that stops, else 0.
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
