#include "daemon/service/run_model/repeated_stops.hpp"

#include <algorithm>

namespace weft::daemon::runs {

bool RepeatedStops::is_journalled(const Stop& stop, bool is_news, Clock now) {
  auto known = std::ranges::find(entries_, stop, &Entry::stop);
  const bool is_new = known == entries_.end();
  if (is_new && !is_news && entries_.size() >= most_apart) {
    const Stop several{stop.kind, "auto:several", {}};
    known = std::ranges::find(entries_, several, &Entry::stop);
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

std::vector<RepeatedStops::Counted> RepeatedStops::over(Clock now) {
  return taken([now](const Entry& entry) { return now - entry.since >= window; });
}

std::vector<RepeatedStops::Counted> RepeatedStops::all() {
  return taken([](const Entry&) { return true; });
}

std::vector<RepeatedStops::Counted> RepeatedStops::taken(
    const std::function<bool(const Entry&)>& is_over) {
  std::vector<Counted> out;
  std::erase_if(entries_, [&](const Entry& entry) {
    if (!is_over(entry)) return false;
    if (entry.times > 0) out.push_back({entry.stop, entry.times});
    return true;
  });
  return out;
}

}  // namespace weft::daemon::runs
