#include "daemon/service/run_model/run_forecast.hpp"

#include <algorithm>
#include <utility>

namespace weft::daemon::runs {
namespace {

double seconds(RunForecast::Clock time) {
  return std::chrono::duration<double>(time).count();
}

}  // namespace

void RunForecast::on_begun(double bench_s, Clock now) {
  if (std::exchange(has_begun_, true)) return;
  bench_began_s_ = bench_s_ = bench_s;
  at_ = now;
}

void RunForecast::on_trial(std::size_t done, double bench_s, double pace, Clock now) {
  const double used_s = bench_s - bench_s_, passed_s = seconds(now - at_);
  const bool is_measured = pace == pace_ || done_ == 0;  // else the pace changed within it
  speed_ = 0;
  if (is_measured && used_s > 0 && passed_s > 0) speed_ = used_s / passed_s;
  done_ = done;
  bench_s_ = bench_s;
  pace_ = pace;
  at_ = now;
}

void RunForecast::on_held(bool is_held, Clock now) {
  if (is_held == held_at_.has_value()) return;
  if (!is_held) at_ += now - *held_at_;
  held_at_ = is_held ? std::optional(now) : std::nullopt;
}

std::optional<double> RunForecast::left_s(double pace, Clock now) const {
  if (plan_.trials == 0) return std::nullopt;
  const double share =
      1.0 - static_cast<double>(std::min(done_, plan_.trials)) / static_cast<double>(plan_.trials);
  // A plan is seldom wrong by more than this; a first trial may be.
  constexpr double least = 0.2, most = 5;
  const double planned_s = plan_.trials_s * (1 - share);
  const double ratio =
      planned_s > 0 ? std::clamp((bench_s_ - bench_began_s_) / planned_s, least, most) : 1;
  const double measured = pace == pace_ ? speed_ : 0;
  if (pace <= 0 && measured <= 0) return std::nullopt;
  const double speed = pace <= 0 || (measured > 0 && measured < pace) ? measured : pace;
  const double trial_s = plan_.trials_s * ratio / static_cast<double>(plan_.trials);
  const double since_s = has_begun_ ? seconds(held_at_.value_or(now) - at_) * speed : 0;
  const double bench_s =
      plan_.trials_s * ratio * share - std::clamp(since_s, 0.0, trial_s) + plan_.finally_s;
  return std::max(bench_s, 0.0) / speed + plan_.people_s * share;
}

}  // namespace weft::daemon::runs
