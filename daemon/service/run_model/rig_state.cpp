#include "daemon/service/run_model/rig_state.hpp"

#include <algorithm>
#include <array>

namespace weft::daemon::runs {

std::string run_id(std::int64_t number) {
  std::string digits = std::to_string(number);
  constexpr std::size_t width = 6;
  if (digits.size() < width) digits.insert(0, width - digits.size(), '0');
  return "R-" + digits;
}

std::string_view to_string(RigState::Fact fact) {
  constexpr std::array<std::string_view, 3> names{"safe", "unknown", "latched"};
  return names[static_cast<std::size_t>(fact)];
}

bool RigState::can_move(std::int64_t run) const {
  return is_safe() || (fact_ == Fact::unknown && run == resume_override_run_);
}

bool RigState::halt(Stop stop, std::string_view by, std::string_view reason) {
  const bool is_emergency = is_emergency_ || stop == Stop::emergency;
  const bool is_news = !is_latched() || is_emergency != is_emergency_;
  std::string why(by);
  if (!reason.empty()) why.append(": ").append(reason);
  *this = RigState(Fact::latched, std::move(why), is_emergency);
  return is_news;
}

bool RigState::on_ended(bool is_safe, std::int64_t run) {
  end_override();
  if (is_latched()) return false;
  RigState next = is_safe ? RigState() : RigState(Fact::unknown, run_id(run));
  if (next == *this) return false;
  *this = std::move(next);
  return true;
}

void RigState::allow_resumed(std::int64_t run) {
  if (*this == RigState(Fact::unknown, run_id(run))) resume_override_run_ = run;
}

void RigState::end_override(std::int64_t run) {
  if (run == resume_override_run_) end_override();
}

bool RepeatedStops::is_journalled(const Stop& stop, bool is_news, Clock now) {
  auto known = std::ranges::find(entries_, stop, &Counted::stop);
  const bool is_new = known == entries_.end();
  if (is_new && !is_news && entries_.size() >= most_apart) {
    const Stop several{stop.kind, "auto:several", {}};
    known = std::ranges::find(entries_, several, &Counted::stop);
    if (known == entries_.end()) known = entries_.insert(known, {several, now, 0});
    ++known->times;
    return false;
  }
  if (is_new) {
    if (entries_.size() < most_apart) entries_.push_back({stop, now, 0});
    return true;
  }
  if (!is_news) ++known->times;
  return is_news;
}

std::vector<RepeatedStops::Counted> RepeatedStops::take(Clock now) {
  std::vector<Counted> out;
  std::erase_if(entries_, [&](const Counted& entry) {
    const bool is_over = now - entry.since >= window;
    if (is_over && entry.times > 0) out.push_back(entry);
    return is_over;
  });
  // What was repeated is counted from now on again: one line each window, as long as it lasts.
  if (now != Clock::max())
    for (const Counted& counted : out) entries_.push_back({counted.stop, now, 0});
  return out;
}

}  // namespace weft::daemon::runs
