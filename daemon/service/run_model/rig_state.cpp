#include "daemon/service/run_model/rig_state.hpp"

#include <algorithm>

namespace weft::daemon::runs {

std::string run_id(std::int64_t number) {
  std::string digits = std::to_string(number);
  constexpr std::size_t width = 6;
  if (digits.size() < width) digits.insert(0, width - digits.size(), '0');
  return "R-" + digits;
}

RigFact rig_fact_of(std::string_view name) {
  for (const RigFact fact : {RigFact::safe, RigFact::holding})
    if (name == to_string(fact)) return fact;
  return RigFact::unknown;
}

bool RigState::needs_reset() const {
  return is_latched() || (facts_.fact != RigFact::safe && !facts_.acknowledged);
}

bool RigState::can_move(std::int64_t run) const {
  return can_move() || (run == resume_override_run_ && !is_latched() && !facts_.lock_out);
}

bool RigState::halt(Stop stop, std::string_view by, std::string_view reason) {
  end_override();
  const std::optional<Latch> before = facts_.latch;
  const bool was_emergency = before && before->is_emergency;
  std::string why(by);
  if (!reason.empty()) why.append(": ").append(reason);
  facts_.latch = Latch{was_emergency || stop == Stop::emergency, std::move(why)};
  return !before || facts_.latch->is_emergency != was_emergency;
}

void RigState::reset() {
  end_override();
  facts_.latch.reset();
  facts_.acknowledged = facts_.fact != RigFact::safe;
}

bool RigState::on_ended(RigFact fact, std::string left_by) {
  end_override();
  RigFacts next = facts_;
  next.fact = fact;
  next.left_by = fact == RigFact::safe ? std::string() : std::move(left_by);
  next.acknowledged = false;
  if (next == facts_) return false;
  facts_ = std::move(next);
  return true;
}

Status RigState::lock(LockOut lock_out) {
  if (facts_.lock_out && facts_.lock_out->user != lock_out.user)
    return fail({.code = Errc::wrong_state,
                 .where = "rig",
                 .what = "rig already locked out by " + facts_.lock_out->user,
                 .got = facts_.lock_out->reason,
                 .hint = "Ask that user or an engineer to run weft unlock"});
  end_override();
  facts_.lock_out = std::move(lock_out);
  return {};
}

Status RigState::unlock(std::string_view user, bool is_allowed_for_others,
                        std::string_view reason) {
  if (!facts_.lock_out)
    return fail({.code = Errc::wrong_state, .where = "rig", .what = "rig not locked out"});
  const bool is_own = facts_.lock_out->user == user;
  if (!is_own && !is_allowed_for_others)
    return fail({.code = Errc::wrong_state,
                 .where = "rig",
                 .what = "user not permitted to remove the lock-out",
                 .expected = facts_.lock_out->user + ", or an engineer with a reason",
                 .got = std::string(user)});
  if (!is_own && reason.size() < 3)
    return fail({.code = Errc::invalid_argument,
                 .where = "/params/reason",
                 .what = "reason missing or too short to remove another user's lock-out",
                 .expected = "at least 3 characters",
                 .got = std::string(reason)});
  end_override();
  facts_.lock_out.reset();
  return {};
}

void RigState::allow_resumed(std::int64_t run) {
  if (!is_latched() && !facts_.lock_out && facts_.left_by == run_id(run))
    resume_override_run_ = run;
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
  // Repeated stops are counted again from now on: one line per window while they last.
  if (now != Clock::max())
    for (const Counted& counted : out) entries_.push_back({counted.stop, now, 0});
  return out;
}

}  // namespace weft::daemon::runs
