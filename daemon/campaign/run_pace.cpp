#include "daemon/campaign/run_pace.hpp"

#include <algorithm>

namespace weft::daemon {
namespace {

double seconds(RunPace::Clock time) {
  return std::chrono::duration<double>(time).count();
}

}  // namespace

RunPace::RunPace(const recipes::Plan& plan, std::size_t first_trial, bool keeps_time, Clock begun)
    : plan_(&plan),
      first_(first_trial),
      done_(first_trial),
      keeps_time_(keeps_time),
      begun_(begun),
      people_left_s_(recipes::people_forecast(plan, first_trial).people_s) {}

void RunPace::step(const recipes::State& state, Clock now) {
  const bool with_people = state.step == recipes::Step::awaiting_operator;
  const bool stands = with_people || state.step == recipes::Step::held;
  if (since_) {
    idle_ += now - *since_;
    if (for_people_) worked_s_ += seconds(now - *since_);
  }
  since_ = stands ? std::optional(now) : std::nullopt;
  for_people_ = with_people;
}

void RunPace::confirmed(const recipes::OperatorAsk& ask) {
  estimated_s_ += ask.people_s;
  passed_over(ask);
}

void RunPace::passed_over(const recipes::OperatorAsk& ask) {
  people_left_s_ = std::max(0.0, people_left_s_ - ask.people_s);
}

std::optional<double> RunPace::trial_s(Clock now) const {
  const Clock idle = idle_ + (since_ ? now - *since_ : Clock{});
  if (done_ > first_) return seconds(now - begun_ - idle) / static_cast<double>(done_ - first_);
  if (keeps_time_) return recipes::machine_s(*plan_, 0, 1);
  return std::nullopt;
}

// People take as much longer or shorter than the recipe says as they have so far.
double RunPace::left_s(Clock now) const {
  const double pace = estimated_s_ > 0 ? worked_s_ / estimated_s_ : 1;
  return trial_s(now).value_or(0) * static_cast<double>(plan_->trials.size() - done_) +
         people_left_s_ * pace + (keeps_time_ ? plan_->forecast.finally_s : 0);
}

const std::optional<recipes::OperatorAsk>& RunPace::next_ask(std::size_t from) {
  if (!looked_ || (next_ && next_->trial < from)) next_ = recipes::next_ask(*plan_, from);
  looked_ = true;
  return next_;
}

std::optional<double> RunPace::machine_until_s(std::size_t from, std::size_t to, Clock now) const {
  const auto each = trial_s(now);
  if (!each) return std::nullopt;
  return *each * static_cast<double>(to - from);
}

}  // namespace weft::daemon
