#include "daemon/analysis/calibration/calibrate.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "daemon/analysis/calibration/held_out.hpp"
#include "daemon/analysis/calibration/minimise.hpp"
#include "daemon/analysis/calibration/stroke_choice.hpp"
#include "daemon/analysis/calibration/usable_views.hpp"
#include "daemon/base/text/format.hpp"
#include "sim/plant/random.hpp"

namespace weft::daemon::calibration {
namespace {

constexpr std::size_t noise_windows = 8;  // simulated once, to measure the noise added by texture
constexpr double known_noise_counts = 1;  // in the plant's counts; without noise, constant counts
                                          // would hide the texture
constexpr double failed_cost = 1e12;      // for a search in which the scene failed

/// Statistics that determine a common parameter. Without any of them, another value only gives
/// other strokes of the same kind, and Q changes by chance.
struct SeenBy {
  std::string_view parameter;
  std::array<std::string_view, 3> statistics;
};
constexpr SeenBy seen_by[] = {{"path_mm", {"repetition", "repetition_lag"}},
                              {"pad_ratio", {"pattern_path"}},
                              {"tilt_mrad", {"pattern_mounting"}},
                              {"pad_height_um", {"pattern_mounting"}},
                              {"common_mode", {"common_share", "neighbours", "far"}},
                              {"common_mode_time_s", {"common_share", "neighbours", "far"}},
                              {"grip_N_mm", {"common_share", "neighbours", "far"}},
                              {"drift_counts", {"drift"}}};

bool is_seen(std::string_view parameter, const std::vector<Target>& targets) {
  const auto* at = std::ranges::find(seen_by, parameter, &SeenBy::parameter);
  return at == std::end(seen_by) || std::ranges::any_of(targets, [&](const Target& target) {
           return std::ranges::find(at->statistics, target.real.name) != at->statistics.end();
         });
}

/// One run from strokes to parameters.
class Calibration {
 public:
  Calibration(const RecordingView& fitted, const ClothModel& model,
              const CalibrationOptions& options, const CalibrationProgress& progress)
      : fitted_(fitted),
        chosen_(choose_strokes(fitted, options.windows)),
        model_(model),
        options_(options),
        progress_(progress),
        values_(model.start()) {
    for (const Parameter& parameter : model.parameters())
      intervals_.push_back({Standing::estimated, parameter.start, parameter.start});
  }

  Result<CalibrationResult> run(const std::optional<RecordingView>& held_out);

 private:
  void say(const std::string& what) const {
    if (progress_) progress_(what);
  }
  Status prepare();
  void estimate_gains();
  void estimate_noise();
  Status take_off_texture();
  void estimate_one(std::string_view parameter, std::string_view statistic);
  void widen_gain_spread();
  Status make_objective();
  Status fit_blocks();
  Status polish(const std::vector<std::size_t>& varied);
  Status improve(const std::vector<std::size_t>& searched, std::size_t starts,
                 std::size_t evaluations);
  Status find_intervals();
  void name_unknown_intervals();
  void round_values();
  Status keep_unseen();
  Status check_others(const std::optional<RecordingView>& held_out, CalibrationResult& out) const;
  void fill(CalibrationResult& out);
  void compare(CalibrationResult& out) const;
  [[nodiscard]] std::vector<std::size_t> seen_common() const;
  [[nodiscard]] std::vector<std::size_t> searched() const;
  Result<StatisticSet> simulated(std::uint64_t seed, RecordingView* keep = nullptr);

  const RecordingView& fitted_;
  RecordingView chosen_;
  const ClothModel& model_;
  const CalibrationOptions& options_;
  const CalibrationProgress& progress_;
  std::vector<double> values_;
  std::vector<ParameterInterval> intervals_;
  BootstrapSet real_;
  std::optional<Scene> scene_;
  std::optional<Objective> objective_;
  std::vector<std::string> blind_, no_interval_;
  StatisticSet before_, after_;
  RecordingView view_before_, view_after_;
  double cost_before_ = 0, cost_after_ = 0;
};

std::vector<std::size_t> Calibration::seen_common() const {
  std::vector<std::size_t> out = model_.block(Block::common);
  std::erase_if(out, [&](std::size_t i) {
    return !is_seen(model_.parameters()[i].name, objective_->targets());
  });
  return out;
}

std::vector<std::size_t> Calibration::searched() const {
  std::vector<std::size_t> out = model_.block(Block::cloth);
  const auto common = seen_common();
  out.insert(out.end(), common.begin(), common.end());
  return out;
}

Result<StatisticSet> Calibration::simulated(std::uint64_t seed, RecordingView* keep) {
  auto view = scene_->simulate(values_, seed, options_.threads);
  if (!view) return pass(view.error());
  StatisticSet out = compute_statistics(*view);
  if (keep != nullptr) *keep = std::move(*view);
  return out;
}

Status Calibration::prepare() {
  auto scene = Scene::make(chosen_, model_);
  if (!scene) return pass(scene.error());
  scene_.emplace(std::move(*scene));
  say("bootstrap of " + std::to_string(fitted_.strokes.size()) + " strokes");
  real_ =
      bootstrap_statistics(fitted_, options_.bootstrap_draws, sim::mix(options_.seed, "bootstrap"));
  auto before = simulated(options_.seed, &view_before_);
  if (!before) return pass(before.error());
  before_ = std::move(*before);
  return {};
}

void Calibration::estimate_one(std::string_view parameter, std::string_view statistic) {
  const std::size_t i = model_.find(parameter);
  const auto at = std::ranges::find_if(real_.statistics, [&](const BootstrapStatistic& s) {
    return s.statistic.name == statistic && s.statistic.cloth.empty();
  });
  const Parameter& p = model_.parameters()[i];
  if (at == real_.statistics.end()) {
    intervals_[i] = {Standing::not_seen, p.low, p.high};
    return;
  }
  const auto natural = [&](double value) {
    return std::clamp(from_scale(value, at->statistic.scale), p.low, p.high);
  };
  values_[i] = natural(at->statistic.value);
  intervals_[i] = {Standing::calibrated, natural(at->low), natural(at->high)};
  if (!(intervals_[i].low > p.low) || !(intervals_[i].high < p.high))
    intervals_[i].standing = Standing::bounded;
}

void Calibration::estimate_gains() {
  estimate_one("gain_spread", "level_spread");
  widen_gain_spread();
}

void Calibration::estimate_noise() {
  estimate_one("noise_counts", "noise_s0");
  estimate_one("noise_per_count", "noise_k1");
  estimate_one("noise_per_square", "noise_k2");
}

/// The bootstrap draws cells, but all from one sensor. Its few pads are themselves a sample of
/// gains, which has the interval of a standard deviation (chi square, Wilson and Hilferty).
void Calibration::widen_gain_spread() {
  const std::size_t i = model_.find("gain_spread");
  if (intervals_[i].standing == Standing::not_seen || fitted_.channels < 2) return;
  const double freedom = static_cast<double>(fitted_.channels) - 1, spread = 2 / (9 * freedom);
  const auto ratio = [&](double z) {
    return std::pow(1 - spread + z * std::sqrt(spread), -1.5);  // sqrt(freedom / chi square)
  };
  constexpr double z_95 = 1.96;
  intervals_[i].low = std::min(intervals_[i].low, values_[i] * ratio(z_95));
  intervals_[i].high = std::max(intervals_[i].high, values_[i] * ratio(-z_95));
}

/// Third differences also contain fine texture. Subtracts the excess measured on simulated strokes
/// with known noise. Runs after the texture is fitted; earlier it would subtract too much.
Status Calibration::take_off_texture() {
  estimate_noise();
  const RecordingView fine = choose_strokes(finest_strokes(fitted_), noise_windows);
  auto scene = Scene::make(fine, model_);
  if (!scene) return pass(scene.error());
  const std::size_t s0 = model_.find("noise_counts"), k1 = model_.find("noise_per_count"),
                    k2 = model_.find("noise_per_square");
  std::vector<double> quiet = values_;
  const double known = known_noise_counts * model_.scale();
  quiet[s0] = known;
  quiet[k1] = quiet[k2] = 0;
  const auto view = scene->simulate(quiet, options_.seed, options_.threads);
  if (!view) return pass(view.error());
  const StatisticSet set = compute_statistics(*view);
  const auto added = [&](std::string_view name) {
    const Statistic* one = find(set.statistics, name);
    return one == nullptr ? 0 : one->shown;
  };
  const double offset = std::max(0.0, std::pow(added("noise_s0"), 2) - std::pow(known, 2));
  const auto shift = [&](std::size_t i, double off, auto&& from, auto&& to) {
    for (double* value : {&values_[i], &intervals_[i].low, &intervals_[i].high})
      *value = from(std::max(0.0, to(*value) - off));
    if (intervals_[i].standing == Standing::calibrated && !(intervals_[i].low > 0))
      intervals_[i].standing = Standing::bounded;
  };
  const auto same = [](double x) { return x; };
  shift(
      s0, offset, [](double x) { return std::sqrt(x); }, [](double x) { return x * x; });
  shift(k1, added("noise_k1"), same, same);
  shift(k2, added("noise_k2"), same, same);
  return {};
}

Status Calibration::make_objective() {
  say(std::to_string(options_.replicates) + " simulated replicates");
  std::vector<StatisticSet> replicates;
  for (std::size_t r = 0; r < options_.replicates; ++r) {
    auto set = simulated(sim::mix(sim::mix(options_.seed, "replicate"), r));
    if (!set) return pass(set.error());
    replicates.push_back(std::move(*set));
  }
  objective_.emplace(*scene_, make_targets(real_, replicates), options_.seed, options_.threads);
  objective_->report_to([this](std::size_t done) { say(std::to_string(done) + " evaluations"); });
  if (objective_->targets().empty())
    return fail({.code = Errc::measurement,
                 .where = "recordings",
                 .what = "no statistics to fit parameters to",
                 .expected = "strokes of at least 8 varying samples"});
  const auto cost = objective_->cost_at(values_);
  if (!cost) return pass(cost.error());
  cost_before_ = *cost;
  return {};
}

Status Calibration::improve(const std::vector<std::size_t>& varied, std::size_t starts,
                            std::size_t evaluations) {
  if (varied.empty()) return {};
  std::vector<double> start;
  for (const std::size_t i : varied) start.push_back(model_.parameters()[i].to_unit(values_[i]));
  Status failed;
  const auto place = [&](std::span<const double> at) {
    std::vector<double> values = values_;
    for (std::size_t k = 0; k < varied.size(); ++k)
      values[varied[k]] = model_.parameters()[varied[k]].from_unit(at[k]);
    return values;
  };
  const auto cost = [&](std::span<const double> at) {
    if (!failed) return failed_cost;
    const auto value = objective_->cost_at(place(at));
    if (!value) failed = pass(value.error());
    return value ? *value : failed_cost;
  };
  const auto found = minimise_from_many(cost, start, starts, evaluations);
  if (!failed) return failed;
  if (!found) return pass(found.error());
  values_ = place(found->at);
  return {};
}

Status Calibration::fit_blocks() {
  for (const BaseCloth& cloth : model_.cloths()) {
    say("fitting " + cloth.label);
    if (Status ok =
            improve(model_.block(Block::cloth, cloth.label), options_.starts, options_.evaluations);
        !ok)
      return ok;
  }
  say("fitting the common parameters");
  if (Status ok = improve(seen_common(), options_.starts, options_.common_evaluations); !ok)
    return ok;
  if (Status ok = take_off_texture(); !ok) return ok;
  return polish(searched());
}

/// Fits the blocks again in turn, from the current values. A search over all parameters would need
/// a hundred evaluations before its first step.
Status Calibration::polish(const std::vector<std::size_t>& varied) {
  const auto of_varied = [&](std::vector<std::size_t> block) {
    std::erase_if(block,
                  [&](std::size_t i) { return std::ranges::find(varied, i) == varied.end(); });
    return block;
  };
  for (std::size_t round = 1; round <= options_.rounds; ++round) {
    say("fitting all parameters again, round " + std::to_string(round) + " of " +
        std::to_string(options_.rounds));
    for (const BaseCloth& cloth : model_.cloths())
      if (Status ok =
              improve(of_varied(model_.block(Block::cloth, cloth.label)), 1, options_.evaluations);
          !ok)
        return ok;
    if (Status ok = improve(of_varied(seen_common()), 1, options_.common_evaluations); !ok)
      return ok;
  }
  return {};
}

/// Resets parameters that are not seen to their estimates and fits the others again. Each change is
/// small alone, but their sum may not be. Intervals are extended to the new values.
Status Calibration::keep_unseen() {
  std::vector<std::size_t> seen;
  for (const std::size_t i : searched())
    if (intervals_[i].standing == Standing::not_seen)
      values_[i] = model_.parameters()[i].start;
    else
      seen.push_back(i);
  if (seen.size() == searched().size()) return {};
  if (Status ok = polish(seen); !ok) return ok;
  for (const std::size_t i : seen) {
    intervals_[i].low = std::min(intervals_[i].low, values_[i]);
    intervals_[i].high = std::max(intervals_[i].high, values_[i]);
  }
  return {};
}

/// A single stroke, or equal draws, give an interval of width 0, which is treated as no interval.
void Calibration::name_unknown_intervals() {
  for (std::size_t i = 0; i < values_.size(); ++i) {
    ParameterInterval& interval = intervals_[i];
    if (interval.standing == Standing::estimated || interval.low < interval.high) continue;
    interval = {Standing::estimated, values_[i], values_[i]};
    no_interval_.push_back(model_.parameters()[i].label());
  }
}

void Calibration::round_values() {
  for (std::size_t i = 0; i < values_.size(); ++i) {
    ParameterInterval& interval = intervals_[i];
    if (interval.standing == Standing::estimated || interval.standing == Standing::not_seen)
      continue;
    const double low = interval.low, high = interval.high;
    for (double* value : {&values_[i], &interval.low, &interval.high})
      *value = round_to_interval(*value, low, high);
  }
}

Status Calibration::find_intervals() {
  say("intervals of " + std::to_string(searched().size()) + " parameters");
  const auto found = identify(*objective_, model_, values_, searched());
  if (!found) return pass(found.error());
  for (const std::size_t i : model_.block(Block::common))
    intervals_[i] = {Standing::not_seen, model_.parameters()[i].low, model_.parameters()[i].high};
  for (const std::size_t i : searched()) intervals_[i] = found->intervals[i];
  blind_ = found->blind_directions;
  if (Status ok = keep_unseen(); !ok) return ok;
  name_unknown_intervals();
  round_values();
  const auto cost = objective_->cost_at(values_);
  if (!cost) return pass(cost.error());
  cost_after_ = *cost;
  auto after = simulated(options_.seed, &view_after_);
  if (!after) return pass(after.error());
  after_ = std::move(*after);
  return {};
}

void Calibration::compare(CalibrationResult& out) const {
  const auto value_of = [](const StatisticSet& set, const Statistic& like) {
    const Statistic* one = find(set.statistics, like.name, like.cloth);
    return one == nullptr ? std::nullopt : std::optional(one->value);
  };
  for (const BootstrapStatistic& one : real_.statistics)
    out.statistics.push_back({one.statistic, one.low, one.high, value_of(before_, one.statistic),
                              value_of(after_, one.statistic), is_fitted(one.statistic.name)});
}

void Calibration::fill(CalibrationResult& out) {
  out.cloths = model_.cloths();
  for (std::size_t i = 0; i < values_.size(); ++i)
    out.parameters.push_back({model_.parameters()[i], intervals_[i].standing, values_[i],
                              intervals_[i].low, intervals_[i].high});
  compare(out);
  out.blind_directions = std::move(blind_);
  out.remarks = fitted_.remarks;
  out.remarks.insert(out.remarks.end(), real_.remarks.begin(), real_.remarks.end());
  for (const BaseCloth& cloth : model_.cloths())
    if (!cloth.is_named)
      out.remarks.push_back("The table has no fabric " + cloth.label + ". The fit starts from " +
                            cloth.taken + ", the fabric of median stiffness.");
  if (!no_interval_.empty())
    out.remarks.push_back(
        "The recordings give a value without an interval. More strokes or more varied "
        "values are needed: " +
        joined(no_interval_) + ".");
  if (model_.scale() > 1)
    out.remarks.push_back(
        "The recorded counts exceed the range of the simulated sensor. They are "
        "scaled down.");
  out.cost_before = cost_before_;
  out.cost_after = cost_after_;
  out.targets = objective_->targets().size();
  out.evaluations = objective_->evaluations();
  out.scale = model_.scale();
  out.seed = options_.seed;
  out.fitted_strokes = fitted_.strokes.size();
  out.simulated_strokes = chosen_.strokes.size();
  out.real = std::move(chosen_);
  out.before = std::move(view_before_);
  out.after = std::move(view_after_);
}

Status Calibration::check_others(const std::optional<RecordingView>& held_out,
                                 CalibrationResult& out) const {
  if (!held_out || held_out->strokes.empty()) {
    out.held_out.why_not = held_out ? "No held-out stroke was on the fabric."
                                    : "Too few recordings to hold a part out. Give another data "
                                      "set with --held-out.";
    return {};
  }
  say("held-out check of " + std::to_string(held_out->strokes.size()) + " strokes");
  auto check = check_held_out(*held_out, model_, values_, options_);
  if (!check) return pass(check.error());
  out.held_out = std::move(*check);
  out.held_out_strokes = held_out->strokes.size();
  return {};
}

Result<CalibrationResult> Calibration::run(const std::optional<RecordingView>& held_out) {
  if (Status ok = prepare(); !ok) return pass(ok.error());
  estimate_gains();
  estimate_noise();
  for (const auto step :
       {&Calibration::make_objective, &Calibration::fit_blocks, &Calibration::find_intervals})
    if (Status ok = (this->*step)(); !ok) return pass(ok.error());
  CalibrationResult out;
  if (Status ok = check_others(held_out, out); !ok) return pass(ok.error());
  fill(out);
  if (held_out)
    for (const std::string& remark : held_out->remarks)
      if (std::ranges::find(fitted_.remarks, remark) == fitted_.remarks.end())
        out.remarks.push_back("Held out: " + remark);
  return out;
}

}  // namespace

double round_to_interval(double value, double low, double high) {
  const double width = std::min(high - low, std::abs(value));
  if (!(width > 0) || !std::isfinite(width)) return value;
  // Positive powers of ten are exact; 0.001 is not.
  const int digits = static_cast<int>(std::floor(std::log10(width / 10)));
  const double step = std::pow(10.0, std::abs(digits));
  return digits < 0 ? std::round(value * step) / step : std::round(value / step) * step;
}

Result<CalibrationResult> calibrate(const RecordingView& fitted,
                                    const std::optional<RecordingView>& held_out,
                                    const sim::FabricLibrary& library,
                                    const CalibrationOptions& options,
                                    const CalibrationProgress& progress) {
  if (!has_nlopt()) return pass(minimise({}, {}, 0).error());
  const auto views = usable_views(fitted, held_out, options.windows);
  if (!views) return pass(views.error());
  const auto model = ClothModel::make(views->fitted, library);
  if (!model) return pass(model.error());
  return Calibration(views->fitted, *model, options, progress).run(views->held_out);
}

}  // namespace weft::daemon::calibration
