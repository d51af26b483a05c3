#include "classifier/design/learning_curve.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "classifier/base/parallel.hpp"
#include "classifier/design/resample.hpp"

namespace weft::classifier::design {
namespace {

constexpr std::size_t least_trained = 2, least_groups = 4;

/// Rows of each group; groups sorted by name.
std::vector<std::vector<std::size_t>> rows_by_group(const FeatureMatrix& matrix) {
  std::map<std::string, std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < matrix.size(); ++i) groups[matrix.groups[i]].push_back(i);
  std::vector<std::vector<std::size_t>> out;
  for (auto& [name, rows] : groups) out.push_back(std::move(rows));
  return out;
}

/// Numbers of training repetitions: all from 2 to `most`, or `points` of them in equal ratios.
std::vector<std::size_t> sizes(std::size_t most, std::size_t points) {
  std::set<std::size_t> out;
  const double ratio = static_cast<double>(most) / least_trained;
  for (std::size_t i = 0; i < points; ++i) {
    const double share = points > 1 ? static_cast<double>(i) / static_cast<double>(points - 1) : 1;
    out.insert(static_cast<std::size_t>(std::lround(least_trained * std::pow(ratio, share))));
  }
  if (most - least_trained < points)
    for (std::size_t m = least_trained; m <= most; ++m) out.insert(m);
  return {out.begin(), out.end()};
}

/// One training and its test group.
struct Job {
  std::size_t tested = 0, size = 0;  ///< index of the group; index into sizes()
  std::vector<std::size_t> train;    ///< groups that train
  double error = 0;
  std::optional<Error> failed;
};

std::vector<Job> make_jobs(std::size_t groups, const std::vector<std::size_t>& trained,
                           const CurveOptions& options) {
  std::vector<Job> jobs;
  RandomEngine engine(options.seed);
  for (std::size_t tested = 0; tested < groups; ++tested)
    for (std::size_t size = 0; size < trained.size(); ++size) {
      const bool all = trained[size] == groups - 1;
      for (std::size_t draw = 0; draw < (all ? 1 : options.draws); ++draw) {
        std::vector<std::size_t> others;
        for (std::size_t g = 0; g < groups; ++g)
          if (g != tested) others.push_back(g);
        shuffle(others, engine);
        others.resize(trained[size]);
        std::ranges::sort(others);
        jobs.push_back({tested, size, std::move(others), 0, {}});
      }
    }
  return jobs;
}

void run(Job& job, const FeatureMatrix& matrix, const std::vector<std::vector<std::size_t>>& groups,
         const CurveOptions& options) {
  std::vector<std::size_t> rows;
  for (const std::size_t g : job.train) rows.insert(rows.end(), groups[g].begin(), groups[g].end());
  TrainOptions train;
  train.seed = options.seed;
  train.threads = 1;
  train.stop = options.stop;
  const auto chosen = train_learner(select_rows(matrix, rows), options.learner, train);
  if (!chosen) {
    job.failed = chosen.error();
    return;
  }
  std::size_t wrong = 0;
  for (const std::size_t r : groups[job.tested]) {
    const auto answer = chosen->trained.classify(matrix.values.row(r));
    if (!answer) {
      job.failed = answer.error();
      return;
    }
    wrong += chosen->trained.labels()[*answer] == matrix.labels[r] ? 0 : 1;
  }
  job.error = static_cast<double>(wrong) / static_cast<double>(groups[job.tested].size());
}

Status check_groups(const FeatureMatrix& matrix, std::size_t groups) {
  const std::set<std::string> labels(matrix.labels.begin(), matrix.labels.end());
  if (labels.size() < 2)
    return fail({.code = Errc::invalid_argument,
                 .where = "data",
                 .what = "too few fabrics for a learning curve",
                 .expected = "at least 2",
                 .got = std::to_string(labels.size())});
  if (groups < least_groups)
    return fail({.code = Errc::invalid_argument,
                 .where = "data",
                 .what = "too few repetitions for a learning curve",
                 .expected = "at least " + std::to_string(least_groups),
                 .got = std::to_string(groups)});
  return {};
}

double mean_error(const CurvePoint& point, const std::vector<std::size_t>& repetitions) {
  double sum = 0;
  for (const std::size_t r : repetitions) sum += point.error_by_tested[r];
  return sum / static_cast<double>(repetitions.size());
}

/// Error as if half an error more had been seen among one trial more (Krichevsky and Trofimov
/// 1981). No campaign proves that there are no errors.
double smoothed(double error, double requested) {
  return (error * requested + 0.5) / (requested + 1);
}

class Forecaster {
 public:
  Forecaster(const LearningCurve& curve, const ForecastOptions& options)
      : curve_(curve), options_(options), engine_(options.seed) {}

  RepetitionForecast run() {
    RepetitionForecast out;
    out.law = fit_power_law(make_points(numbers_below(curve_.repetitions)));
    std::vector<double> laws, measured, enough;
    for (std::size_t b = 0; b < options_.resamples; ++b) {
      const PowerLaw law = drawn_law(make_points(resampled(curve_.repetitions, engine_)));
      const double accuracy = 1 - law.error_at(trained(options_.predict));
      laws.push_back(accuracy);
      const double noisy = accuracy + measurement_sd(accuracy) * normal_draw(engine_);
      measured.push_back(std::clamp(noisy, 0.0, 1.0));
      enough.push_back(first_enough(law));
    }
    out.predict = options_.predict;
    out.accuracy = quantile(laws, 0.5);
    out.ci95 = {quantile(measured, 0.025), quantile(measured, 0.975),
                "percentiles of " + std::to_string(options_.resamples) +
                    " resamples of the repetitions, with measurement noise"};
    out.wanted = options_.accuracy;
    out.most = options_.most;
    out.enough = reached(enough, 0.5);
    out.enough_low = reached(enough, 0.025);
    out.enough_high = reached(enough, 0.975);
    for (const double n : enough) out.reached_share += std::isfinite(n) ? 1 : 0;
    out.reached_share /= static_cast<double>(enough.size());
    return out;
  }

 private:
  static double trained(std::size_t repetitions) { return static_cast<double>(repetitions) - 1; }

  [[nodiscard]] double requested() const { return static_cast<double>(curve_.trials); }

  /// Every test repetition shares nearly all its training repetitions with the others, so their
  /// mean varies by more than their spread shows. Therefore the variance is sd^2 (1 / R + test /
  /// train) instead of sd^2 / R, as in split_interval() (Nadeau and Bengio 2003). One of the R
  /// repetitions tests and R - 1 train.
  [[nodiscard]] std::vector<ErrorPoint> make_points(
      const std::vector<std::size_t>& repetitions) const {
    std::vector<ErrorPoint> out;
    const auto groups = static_cast<double>(curve_.repetitions);
    const double widening = std::sqrt(1 + groups / (groups - 1));
    for (const CurvePoint& point : curve_.points) {
      const double mean = 1 - point.accuracy;
      const double drawn = mean + widening * (mean_error(point, repetitions) - mean);
      const double error = smoothed(std::clamp(drawn, 0.0, 1.0), requested());
      out.push_back({trained(point.repetitions), error, requested() / (error * (1 - error))});
    }
    return out;
  }

  /// Draws an exponent by its likelihood under the binomial variance of the points.
  PowerLaw drawn_law(const std::vector<ErrorPoint>& points) {
    std::vector<PowerLaw> laws;
    std::vector<double> misfits;
    for (const double exponent : exponents()) {
      laws.push_back(fit_power_law(points, exponent));
      misfits.push_back(misfit(points, laws.back()));
    }
    const double least = *std::ranges::min_element(misfits);
    double sum = 0;
    for (double& m : misfits) sum += m = std::exp((least - m) / 2);
    double left = sum * static_cast<double>(random_below(engine_, 1'000'000)) / 1e6;
    for (std::size_t i = 0; i < laws.size(); ++i) {
      left -= misfits[i];
      if (left < 0) return laws[i];
    }
    return laws.back();
  }

  /// Standard deviation of the mean accuracy of `options_.predict` repetitions. It is binomial, or
  /// the spread between repetitions where that is larger: the trials of one repetition may fail
  /// together.
  [[nodiscard]] double measurement_sd(double accuracy) const {
    const auto& last = curve_.points.back().error_by_tested;
    const auto repetitions = static_cast<double>(options_.predict);
    const double trials = requested() / static_cast<double>(curve_.repetitions) * repetitions;
    const double binomial = accuracy * (1 - accuracy) / trials;
    const double between = std::pow(compute_deviation(last), 2) / repetitions;
    return std::sqrt(std::max(binomial, between));
  }

  [[nodiscard]] double first_enough(const PowerLaw& law) const {
    for (std::size_t n = least_trained + 1; n <= options_.most; ++n)
      if (1 - law.error_at(trained(n)) >= options_.accuracy) return static_cast<double>(n);
    return HUGE_VAL;
  }

  static std::optional<std::size_t> reached(std::vector<double> enough, double share) {
    std::ranges::sort(enough);
    const double n =
        enough[static_cast<std::size_t>(share * static_cast<double>(enough.size() - 1))];
    return std::isfinite(n) ? std::optional(static_cast<std::size_t>(n)) : std::nullopt;
  }

  const LearningCurve& curve_;
  const ForecastOptions& options_;
  RandomEngine engine_;
};

}  // namespace

Result<LearningCurve> learning_curve(const FeatureMatrix& matrix, const CurveOptions& options) {
  const auto groups = rows_by_group(matrix);
  if (Status ok = check_groups(matrix, groups.size()); !ok) return pass(ok.error());
  const auto trained = sizes(groups.size() - 1, options.most_points);
  std::vector<Job> jobs = make_jobs(groups.size(), trained, options);
  parallel_for(jobs.size(), options.threads,
               [&](std::size_t i) { run(jobs[i], matrix, groups, options); });
  LearningCurve out;
  out.repetitions = groups.size();
  out.trials = matrix.size();
  out.draws = options.draws;
  out.fabrics = std::set<std::string>(matrix.labels.begin(), matrix.labels.end()).size();
  out.points.resize(trained.size());
  for (std::size_t s = 0; s < trained.size(); ++s) {
    out.points[s].repetitions = trained[s] + 1;
    out.points[s].error_by_tested.assign(groups.size(), 0.0);
  }
  std::vector<std::vector<double>> counted(trained.size(), std::vector<double>(groups.size(), 0.0));
  for (const Job& job : jobs) {
    if (job.failed) return pass(*job.failed);
    out.points[job.size].error_by_tested[job.tested] += job.error;
    ++counted[job.size][job.tested];
  }
  const double each = static_cast<double>(out.trials) / static_cast<double>(groups.size());
  std::vector<ClusteredShare> shares;
  for (std::size_t s = 0; s < trained.size(); ++s) {
    CurvePoint& point = out.points[s];
    ClusteredShare& right = shares.emplace_back();
    for (std::size_t g = 0; g < groups.size(); ++g) {
      point.error_by_tested[g] /= counted[s][g];
      right.clusters.push_back({1 - point.error_by_tested[g], each});
    }
    point.accuracy = right.share();
  }
  const double effect = design_effect(shares);
  for (std::size_t s = 0; s < trained.size(); ++s)
    out.points[s].ci95 = clustered_interval(shares[s], effect);
  return out;
}

Result<RepetitionForecast> forecast_repetitions(const LearningCurve& curve,
                                                const ForecastOptions& options) {
  if (curve.points.size() < 2)
    return fail({.code = Errc::invalid_argument,
                 .where = "curve",
                 .what = "too few points for a learning curve",
                 .expected = "at least 2",
                 .got = std::to_string(curve.points.size())});
  const auto refuse = [](const char* what, std::string expected, std::string got) {
    return fail({.code = Errc::range,
                 .where = "forecast",
                 .what = what,
                 .expected = std::move(expected),
                 .got = std::move(got)});
  };
  if (options.predict <= least_trained)
    return refuse("too few repetitions for a forecast",
                  "at least " + std::to_string(least_trained + 1), std::to_string(options.predict));
  if (!(options.accuracy > 0) || !(options.accuracy < 1))
    return refuse("target accuracy out of range", "above 0 and below 1",
                  std::to_string(options.accuracy));
  if (options.resamples == 0) return refuse("too few resamples for an interval", "at least 1", "0");
  return Forecaster(curve, options).run();
}

double PowerLaw::error_at(double trained) const {
  return std::clamp(floor + scale * std::pow(trained, -exponent), 0.0, 1.0);
}

PowerLaw fit_power_law(std::span<const ErrorPoint> points, double exponent) {
  double w = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const ErrorPoint& p : points) {
    const double at = std::pow(p.trained, -exponent);
    w += p.weight;
    x += p.weight * at;
    y += p.weight * p.error;
    xx += p.weight * at * at;
    xy += p.weight * at * p.error;
  }
  const double determinant = w * xx - x * x;
  PowerLaw law{y / w, 0, exponent};  // a flat line: the points show no learning
  if (!(determinant > 1e-12 * w * xx)) return law;
  const double scale = (w * xy - x * y) / determinant;
  if (scale <= 0) return law;
  law.scale = scale;
  law.floor = (y - scale * x) / w;
  if (law.floor < 0) law = {0, xy / xx, exponent};
  return law;
}

double misfit(std::span<const ErrorPoint> points, const PowerLaw& law) {
  double sum = 0;
  for (const ErrorPoint& p : points) {
    const double off = p.error - (law.floor + law.scale * std::pow(p.trained, -law.exponent));
    sum += p.weight * off * off;
  }
  return sum;
}

const std::vector<double>& exponents() {
  static const std::vector<double> list{0.25, 0.375, 0.5, 0.75, 1, 1.25, 1.5, 2};
  return list;
}

PowerLaw fit_power_law(std::span<const ErrorPoint> points) {
  PowerLaw best = fit_power_law(points, exponents().front());
  for (const double exponent : exponents()) {
    const PowerLaw law = fit_power_law(points, exponent);
    if (misfit(points, law) < misfit(points, best)) best = law;
  }
  return best;
}

}  // namespace weft::classifier::design
