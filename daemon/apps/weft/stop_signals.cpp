#include "daemon/apps/weft/stop_signals.hpp"

#include <unistd.h>

#include <cerrno>
#include <string_view>

namespace weft::daemon::cli {
namespace {

// A signal handler can only reach static data.
std::atomic<bool> stop_requested{false};
std::atomic<int> stop_number{0};
std::atomic<bool> hung_up{false};
std::atomic<bool> hangup_reloads{false};
std::atomic<bool> reload_wanted{false};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free);

extern "C" void on_stop_signal(int number) {
  if (number == SIGHUP && hangup_reloads.load()) {
    reload_wanted.store(true);
    return;
  }
  if (number == SIGHUP) {  // not counted: a signal after it is the first
    hung_up.store(true);
    stop_requested.store(true);
    return;
  }
  int none = 0;
  const bool first = stop_number.compare_exchange_strong(none, number);
  stop_requested.store(true);
  signal(SIGINT, SIG_DFL);
  signal(SIGTERM, SIG_DFL);
  if (!first) raise(number);  // signals on two threads; delivered on return
}

// On one thread each signal waits while the other is handled; the second then has its default
// effect.
void install(int number, struct sigaction& before) {
  struct sigaction action {};
  action.sa_handler = on_stop_signal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaddset(&action.sa_mask, SIGINT);
  sigaddset(&action.sa_mask, SIGTERM);
  sigaddset(&action.sa_mask, SIGHUP);
  sigaction(number, nullptr, &before);
  const bool is_reload = number == SIGHUP && hangup_reloads.load();
  if (before.sa_handler != SIG_IGN || is_reload) sigaction(number, &action, nullptr);
}

constexpr std::array suspensions{SIGTSTP, SIGTTIN, SIGTTOU};

extern "C" void on_suspend_signal(int) {
  constexpr std::string_view text =
      "weft: not suspended: the rig needs control. End the run with Ctrl-C or hold it with weft "
      "pause.\n";
  const int before = errno;
  static_cast<void>(!write(STDERR_FILENO, text.data(), text.size()));
  errno = before;
}

void refuse_suspension(std::array<struct sigaction, suspensions.size()>& before) {
  for (std::size_t i = 0; i < suspensions.size(); ++i) {
    struct sigaction action {};
    action.sa_handler = suspensions[i] == SIGTSTP ? on_suspend_signal : SIG_IGN;
    action.sa_flags = SA_RESTART;
    sigemptyset(&action.sa_mask);
    sigaction(suspensions[i], &action, &before[i]);
  }
}

}  // namespace

IgnoreWriteSignals::IgnoreWriteSignals() {
  struct sigaction ignored {};
  ignored.sa_handler = SIG_IGN;
  sigaction(SIGPIPE, &ignored, &before_pipe_);
  sigaction(SIGXFSZ, &ignored, &before_size_);
}

IgnoreWriteSignals::~IgnoreWriteSignals() {
  sigaction(SIGPIPE, &before_pipe_, nullptr);
  sigaction(SIGXFSZ, &before_size_, nullptr);
}

StopSignals::StopSignals(Hangup hangup, Suspend suspend) : suspend_(suspend) {
  hangup_reloads.store(hangup == Hangup::reloads);
  reload_wanted.store(false);
  stop_requested.store(false);
  stop_number.store(0);
  hung_up.store(false);
  install(SIGINT, before_interrupt_);
  install(SIGTERM, before_terminate_);
  install(SIGHUP, before_hangup_);
  if (suspend_ == Suspend::refused) refuse_suspension(before_suspend_);
}

StopSignals::~StopSignals() {
  sigaction(SIGINT, &before_interrupt_, nullptr);
  sigaction(SIGTERM, &before_terminate_, nullptr);
  sigaction(SIGHUP, &before_hangup_, nullptr);
  for (std::size_t i = 0; suspend_ == Suspend::refused && i < suspensions.size(); ++i)
    sigaction(suspensions[i], &before_suspend_[i], nullptr);
}

const std::atomic<bool>& StopSignals::requested() const {
  return stop_requested;
}

std::atomic<bool>& StopSignals::reload_requested() {
  return reload_wanted;
}

int StopSignals::number() const {
  const int requested = stop_number.load();
  return requested == 0 && hung_up.load() ? SIGHUP : requested;
}

}  // namespace weft::daemon::cli
