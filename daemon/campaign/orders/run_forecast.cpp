#include "daemon/campaign/orders/run_forecast.hpp"

#include <algorithm>
#include <utility>

namespace weft::daemon {
namespace {

double seconds(RunForecast::Clock time) {
  return std::chrono::duration<double>(time).count();
}

}  // namespace

PlannedTime PlannedTime::of(const recipes::Plan& plan, std::size_t first, bool is_real_time) {
  return {.trials = plan.trials.size(),
          .first = first,
          .trial_s = recipes::machine_s(plan, 0, 1),
          .finally_s = plan.forecast.finally_s,
          .people_s = recipes::people_forecast(plan, first).people_s,
          .is_real_time = is_real_time};
}

// The time since the newest report belongs to the activity of the run in it. A pause is no bench
// time, although the clock of a real bench continues.
void RunForecast::advance(double bench_s, double pace, Clock now) {
  if (doing_ == Doing::moving) {
    used_s_ += bench_s - bench_at_s_;
    used_wall_s_ += seconds(now - at_);
  } else if (doing_ == Doing::with_people) {
    people_s_ += seconds(now - at_);
  }
  if (pace != pace_) {
    paced_s_ = paced_wall_s_ = 0;
    has_one_pace_ = doing_ == Doing::nothing;
  }
  bench_at_s_ = bench_s;
  pace_ = pace;
  at_ = now;
}

void RunForecast::on_step(recipes::Step step, double bench_s, double pace, Clock now) {
  advance(bench_s, pace, now);
  doing_ = step == recipes::Step::held                ? Doing::waiting
           : step == recipes::Step::awaiting_operator ? Doing::with_people
                                                      : Doing::moving;
}

void RunForecast::on_trial(std::size_t done, double bench_s, double pace, Clock now) {
  advance(bench_s, pace, now);
  done_ = done;
  trials_s_ += used_s_;
  if (std::exchange(has_one_pace_, true)) {
    paced_s_ += used_s_;
    paced_wall_s_ += used_wall_s_;
  }
  used_s_ = used_wall_s_ = 0;
}

void RunForecast::on_confirmed(const recipes::StepPrompt& prompt) {
  people_planned_s_ += prompt.people_s;
  skip_prompt(prompt);
}

void RunForecast::skip_prompt(const recipes::StepPrompt& prompt) {
  people_left_s_ = std::max(0.0, people_left_s_ - prompt.people_s);
}

std::optional<double> RunForecast::speed(double pace) const {
  if (plan_.is_real_time) return 1;
  const double measured = pace == pace_ && paced_wall_s_ > 0 ? paced_s_ / paced_wall_s_ : 0;
  if (pace > 0) return measured > 0 ? std::min(pace, measured) : pace;
  return measured > 0 ? std::optional(measured) : std::nullopt;
}

double RunForecast::trial_s() const {
  // A plan is seldom wrong by more than this; a first trial may be.
  constexpr double least = 0.2, most = 5;
  const double planned_s = plan_.trial_s * static_cast<double>(done_ - plan_.first);
  return plan_.trial_s * (planned_s > 0 ? std::clamp(trials_s_ / planned_s, least, most) : 1);
}

double RunForecast::used_s(double speed, Clock now) const {
  const double since_s = doing_ == Doing::moving ? seconds(now - at_) * speed : 0;
  return std::clamp(used_s_ + since_s, 0.0, trial_s());
}

// Scales the planned time of people by their actual time so far.
std::optional<double> RunForecast::left_s(double pace, Clock now) const {
  const auto fast = speed(pace);
  if (plan_.trials == 0 || !fast) return std::nullopt;
  const double trials = static_cast<double>(plan_.trials - std::min(done_, plan_.trials));
  const double machine_s = std::max(0.0, trials * trial_s() - used_s(*fast, now)) + plan_.finally_s;
  const double people = people_planned_s_ > 0 ? people_s_ / people_planned_s_ : 1;
  return machine_s / *fast + people_left_s_ * people;
}

std::optional<double> RunForecast::trial_left_s(double pace, Clock now) const {
  const auto fast = speed(pace);
  if (plan_.trials == 0 || !fast) return std::nullopt;
  return done_ < plan_.trials ? (trial_s() - used_s(*fast, now)) / *fast : 0;
}

std::optional<double> RunForecast::left_until_s(std::size_t trial, double pace, Clock now) const {
  const auto fast = speed(pace);
  if (doing_ != Doing::moving || !fast || trial < done_) return std::nullopt;
  const double machine_s = static_cast<double>(trial - done_) * trial_s() - used_s(*fast, now);
  return std::max(0.0, machine_s) / *fast;
}

}  // namespace weft::daemon
