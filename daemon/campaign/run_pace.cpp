#include "daemon/campaign/run_pace.hpp"

#include <algorithm>

namespace weft::daemon {
namespace {

double seconds(RunPace::Clock time) {
  return std::chrono::duration<double>(time).count();
}

constexpr std::chrono::nanoseconds most_behind = std::chrono::milliseconds(100);

}  // namespace

RunPace::RunPace(const recipes::Plan& plan, std::size_t first_trial, bool runs_in_real_time,
                 Clock begun)
    : plan_(&plan),
      first_(first_trial),
      done_(first_trial),
      runs_in_real_time_(runs_in_real_time),
      begun_(begun),
      people_left_s_(recipes::people_forecast(plan, first_trial).people_s) {}

void RunPace::step(const recipes::State& state, Clock now) {
  const bool with_people = state.step == recipes::Step::awaiting_operator;
  const bool is_waiting = with_people || state.step == recipes::Step::held;
  if (since_) {
    idle_ += now - *since_;
    if (for_people_) worked_s_ += seconds(now - *since_);
  }
  since_ = is_waiting ? std::optional(now) : std::nullopt;
  for_people_ = with_people;
}

void RunPace::confirmed(const recipes::StepPrompt& prompt) {
  estimated_s_ += prompt.people_s;
  skip_prompt(prompt);
}

void RunPace::skip_prompt(const recipes::StepPrompt& prompt) {
  people_left_s_ = std::max(0.0, people_left_s_ - prompt.people_s);
}

std::optional<double> RunPace::trial_s(Clock now) const {
  const Clock idle = idle_ + (since_ ? now - *since_ : Clock{});
  if (done_ > first_) return seconds(now - begun_ - idle) / static_cast<double>(done_ - first_);
  if (runs_in_real_time_) return recipes::machine_s(*plan_, 0, 1);
  return std::nullopt;
}

// People take as much longer or shorter than the recipe says as they have so far.
double RunPace::left_s(Clock now) const {
  const double pace = estimated_s_ > 0 ? worked_s_ / estimated_s_ : 1;
  return trial_s(now).value_or(0) * static_cast<double>(plan_->trials.size() - done_) +
         people_left_s_ * pace + (runs_in_real_time_ ? plan_->forecast.finally_s : 0);
}

const std::optional<recipes::StepPrompt>& RunPace::next_prompt(std::size_t from) {
  if (!has_next_ || (next_ && next_->trial < from)) next_ = recipes::next_prompt(*plan_, from);
  has_next_ = true;
  return next_;
}

std::optional<double> RunPace::machine_until_s(std::size_t from, std::size_t to, Clock now) const {
  const auto each = trial_s(now);
  if (!each) return std::nullopt;
  return *each * static_cast<double>(to - from);
}

std::chrono::nanoseconds PaceKeeper::ahead(TimePoint bench, std::chrono::nanoseconds wall) {
  const double requested = requested_ == nullptr ? 0 : requested_->load(std::memory_order_relaxed);
  if (requested == 0 || requested != pace_) since_.reset();
  pace_ = requested;
  if (requested == 0) return {};
  if (!since_) since_ = Since{bench, wall};
  const std::chrono::duration<double, std::nano> passed = bench - since_->bench;
  const auto due =
      since_->wall + std::chrono::duration_cast<std::chrono::nanoseconds>(passed / requested);
  if (wall - due > most_behind) since_ = Since{bench, wall};
  return std::max(due - wall, std::chrono::nanoseconds{});
}

}  // namespace weft::daemon
