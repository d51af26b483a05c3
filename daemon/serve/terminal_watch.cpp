#include "daemon/serve/terminal_watch.hpp"

#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace weft::daemon {

TerminalWatch::TerminalWatch(RealLoop& loop, const std::string& terminal,
                             std::function<void()> changed)
    : changed_(std::move(changed)), queue_(::inotify_init1(IN_NONBLOCK | IN_CLOEXEC)) {
  if (queue_ < 0) return;
  events_ = adopt_stream(loop, queue_, "openings of " + terminal);
  events_->on_receive([this](ByteView events, TimePoint) { take(events); });
  tells_ = ::inotify_add_watch(queue_, terminal.c_str(), IN_OPEN | IN_CLOSE) >= 0;
}

void TerminalWatch::heard() {
  std::array<std::uint8_t, 4096> events{};
  while (tells_) {
    const ssize_t count = ::read(queue_, events.data(), events.size());
    if (count <= 0) break;
    take(ByteView(events).first(static_cast<std::size_t>(count)));
  }
  if (!told_) tells_ = false;  // somebody wrote who was not seen to open
}

void TerminalWatch::take(ByteView events) {
  while (events.size() >= sizeof(inotify_event)) {
    inotify_event event{};
    std::memcpy(&event, events.data(), sizeof event);
    events = events.subspan(std::min(events.size(), sizeof event + event.len));
    const bool before = somebody();
    if ((event.mask & IN_Q_OVERFLOW) != 0) tells_ = false;
    if ((event.mask & IN_OPEN) != 0) {
      told_ = true;
      ++open_;
    } else if ((event.mask & IN_CLOSE) != 0 && open_ > 0) {
      --open_;
    }
    if (somebody() != before) changed_();
  }
}

}  // namespace weft::daemon
