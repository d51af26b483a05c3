#include "daemon/analysis/tradeoff/sim/downstream.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "classifier/base/student_t.hpp"
#include "daemon/analysis/tradeoff/sim/sim_scene.hpp"

namespace weft::daemon {
namespace {

using classifier::FeatureMatrix;

struct FeatureRows {
  std::string channels;
  std::vector<FeatureMatrix> by_level;
};

SeedMean seed_mean(std::vector<double> values, double low, double high) {
  SeedMean out;
  out.mean = classifier::compute_mean(values);
  const auto n = static_cast<double>(values.size());
  const double half = values.size() < 2 ? 0
                                        : classifier::critical_t(0.05, n - 1) *
                                              classifier::compute_deviation(values) / std::sqrt(n);
  out.ci95 = {std::max(low, out.mean - half), std::min(high, out.mean + half),
              "Student's t over seeds"};
  out.values = std::move(values);
  return out;
}

std::vector<double> extract_column(std::span<const std::vector<double>> rows, std::size_t column) {
  std::vector<double> out;
  for (const std::vector<double>& row : rows) out.push_back(row[column]);
  return out;
}

/// Training rows and test rows.
struct Sides {
  std::vector<std::size_t> train, test;
};

/// Tests every piece once and trains on the others.
std::vector<Sides> across(const FeatureMatrix& features, std::size_t swatches) {
  std::vector<Sides> out(swatches);
  for (std::size_t s = 0; s < swatches; ++s)
    for (std::size_t row = 0; row < features.size(); ++row)
      (features.groups[row] == std::to_string(s + 1) ? out[s].test : out[s].train).push_back(row);
  return out;
}

/// Trains on every second trial within all pieces.
std::vector<Sides> within(const FeatureMatrix& features) {
  std::vector<Sides> out(1);
  for (std::size_t row = 0; row < features.size(); ++row)
    (row % 2 == 0 ? out[0].train : out[0].test).push_back(row);
  return out;
}

Result<double> measure_accuracy(const classifier::TrainedLearner& trained,
                                const FeatureMatrix& features,
                                const std::vector<std::size_t>& rows) {
  std::size_t right = 0;
  for (const std::size_t row : rows) {
    const auto answer = trained.classify(features.values.row(row));
    if (!answer) return pass(answer.error(), features.files[row]);
    right += trained.labels()[*answer] == features.labels[row] ? 1 : 0;
  }
  return static_cast<double>(right) / static_cast<double>(rows.size());
}

/// Shifts of the features of one level relative to the reference level.
struct Moved {
  std::vector<std::string> names;
  std::vector<std::vector<double>> by_seed;
};

/// Collects the results of all seeds, in the order in which they are computed.
class Collector {
 public:
  explicit Collector(const DownstreamOptions& options) : options_(options) {}

  Status add_seed(const std::vector<FeatureRows>& seen, const DownstreamProgress& progress) {
    std::size_t next = 0, shift = 0;
    for (const FeatureRows& one : seen) {
      for (const bool crossing : {false, true}) {
        const auto sides = crossing ? across(one.by_level.front(), options_.campaign.swatches)
                                    : within(one.by_level.front());
        for (const classifier::Learner learner : options_.learners) {
          if (progress)
            progress(one.channels + ", " + std::string(classifier::to_string(learner)) +
                     (crossing ? ", across pieces" : ", same pieces"));
          for (std::size_t level = 0; level < one.by_level.size(); ++level)
            if (Status ok = add_training(one, sides, learner, level, crossing, next); !ok)
              return ok;
        }
      }
      add_shifts(one, shift);
    }
    return {};
  }

  void finish(DownstreamResult& out) {
    for (std::size_t i = 0; i < transfers_.size(); ++i) {
      SeedMean& accuracy = transfers_[i].accuracy;
      accuracy.ci95 = classifier::repetition_interval(accuracy.values, tested_[i]);
      accuracy.mean = classifier::compute_mean(accuracy.values);
    }
    for (std::size_t i = 0; i < shifts_.size(); ++i) {
      shifts_[i].spearman = seed_mean(std::move(shifts_[i].spearman.values), -1, 1);
      const std::size_t most = most_shifted(moved_[i].by_seed);
      shifts_[i].shifted = moved_[i].names[most];
      shifts_[i].max_shift = seed_mean(extract_column(moved_[i].by_seed, most), 0, HUGE_VAL);
    }
    out.transfers = std::move(transfers_);
    out.shifts = std::move(shifts_);
  }

 private:
  Status add_training(const FeatureRows& seen, const std::vector<Sides>& sides,
                      classifier::Learner learner, std::size_t level, bool crossing,
                      std::size_t& next) {
    std::vector<double> sums(seen.by_level.size(), 0);
    std::size_t rows = 0;
    for (const Sides& side : sides) rows += side.test.size();
    for (const Sides& side : sides) {
      const auto trained = classifier::train_learner(
          classifier::select_rows(seen.by_level[level], side.train), learner, options_.training);
      if (!trained) return pass(trained.error(), options_.levels[level].name);
      for (std::size_t tested = 0; tested < sums.size(); ++tested) {
        const auto share = measure_accuracy(trained->trained, seen.by_level[tested], side.test);
        if (!share) return pass(share.error(), options_.levels[tested].name);
        sums[tested] += *share / static_cast<double>(sides.size());
      }
    }
    for (std::size_t tested = 0; tested < sums.size(); ++tested, ++next) {
      if (next == transfers_.size()) {
        transfers_.push_back({seen.channels,
                              std::string(classifier::to_string(learner)),
                              options_.levels[level].name,
                              options_.levels[tested].name,
                              crossing,
                              {}});
        tested_.push_back(rows);
      }
      transfers_[next].accuracy.values.push_back(sums[tested]);
    }
    return {};
  }

  void add_shifts(const FeatureRows& seen, std::size_t& next) {
    const FeatureMatrix& yardstick = seen.by_level.back();
    const std::vector<double> f = f_statistics(yardstick);
    for (std::size_t level = 0; level + 1 < seen.by_level.size(); ++level, ++next) {
      if (next == shifts_.size()) {
        shifts_.push_back({seen.channels, options_.levels[level].name, {}, {}, {}});
        moved_.push_back({yardstick.names, {}});
      }
      shifts_[next].spearman.values.push_back(spearman(f_statistics(seen.by_level[level]), f));
      moved_[next].by_seed.push_back(feature_shifts(seen.by_level[level], yardstick));
    }
  }

  const DownstreamOptions& options_;
  std::vector<Transfer> transfers_;
  std::vector<std::size_t> tested_;  // test trials per seed
  std::vector<Moved> moved_;
  std::vector<FeatureShift> shifts_;
};

Result<std::vector<FeatureRows>> compute_features(const sim::FabricLibrary& library,
                                                  const DownstreamOptions& options,
                                                  std::uint64_t seed,
                                                  const DownstreamProgress& progress) {
  std::vector<FeatureRows> out{{"pads", {}}, {"force", {}}};
  for (const DownstreamLevel& level : options.levels) {
    if (progress) progress("seed " + std::to_string(seed) + ", trials at " + level.name);
    const auto trials = make_downstream_trials(library, options.campaign, level, seed);
    if (!trials) return pass(trials.error(), level.name);
    for (FeatureRows& seen : out) {
      auto features = classifier::build_feature_matrix(
          seen.channels == "pads" ? trials->pads : trials->force, {}, options.training.threads);
      if (!features) return pass(features.error(), level.name);
      seen.by_level.push_back(std::move(*features));
    }
  }
  return out;
}

Status check(const DownstreamOptions& options) {
  if (options.seeds < 2 || options.campaign.trials < 4 || options.campaign.swatches < 2)
    return fail({.code = Errc::invalid_argument,
                 .where = "downstream",
                 .what = "too few seeds, trials or pieces to compare levels",
                 .expected = "at least 2 seeds, 4 trials on each of 2 pieces",
                 .got = std::to_string(options.seeds) + " seeds, " +
                        std::to_string(options.campaign.trials) + " trials on each of " +
                        std::to_string(options.campaign.swatches) + " pieces"});
  return {};
}

/// Sums of one column over the rows of each label.
struct LabelSums {
  struct Sum {
    double count = 0, mean = 0, squares = 0;  // squares: sum of squares about the mean (Welford)
  };
  std::map<std::string, Sum> of;

  LabelSums(const classifier::FeatureMatrix& features, std::size_t column) {
    for (std::size_t row = 0; row < features.size(); ++row) {
      Sum& sum = of[features.labels[row]];
      const double x = features.values(row, column), before = x - sum.mean;
      sum.mean += before / ++sum.count;
      sum.squares += before * (x - sum.mean);
    }
  }
  [[nodiscard]] double rows() const {
    double n = 0;
    for (const auto& [label, sum] : of) n += sum.count;
    return n;
  }
  /// Pooled variance within labels.
  [[nodiscard]] double within() const {
    double squares = 0;
    for (const auto& [label, sum] : of) squares += sum.squares;
    return squares / std::max(1.0, rows() - static_cast<double>(of.size()));
  }
  [[nodiscard]] double between() const {
    double mean = 0, squares = 0;
    for (const auto& [label, sum] : of) mean += sum.count * sum.mean;
    mean /= rows();
    for (const auto& [label, sum] : of)
      squares += sum.count * (sum.mean - mean) * (sum.mean - mean);
    return squares / std::max(1.0, static_cast<double>(of.size()) - 1);
  }
};

std::vector<double> ranks(std::span<const double> values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return values[i]; });
  std::vector<double> out(values.size());
  for (std::size_t i = 0; i < order.size();) {
    std::size_t end = i;
    while (end < order.size() && values[order[end]] == values[order[i]]) ++end;
    const double mean = 0.5 * static_cast<double>(i + end - 1);
    for (; i < end; ++i) out[order[i]] = mean;
  }
  return out;
}

}  // namespace

std::vector<DownstreamLevel> downstream_levels() {
  return {{"L0", sim::Level::algebraic, 0},
          {"L1", sim::Level::quasistatic, 0},
          {"L2 1.024 ms", sim::Level::dynamic, sim_grid_s / 3},
          {"L2 0.192 ms", sim::Level::dynamic, sim_grid_s / 16}};
}

Result<DownstreamResult> measure_downstream(const sim::FabricLibrary& library,
                                            DownstreamOptions options,
                                            const DownstreamProgress& progress) {
  if (Status ok = check(options); !ok) return pass(ok.error());
  if (options.levels.empty()) options.levels = downstream_levels();
  DownstreamResult out;
  out.campaign = options.campaign;
  out.seeds = options.seeds;
  for (const DownstreamLevel& level : options.levels) out.levels.push_back(level.name);
  Collector collector(options);
  for (std::size_t i = 0; i < options.seeds; ++i) {
    const auto seen = compute_features(library, options, options.first_seed + i, progress);
    if (!seen) return pass(seen.error());
    const auto& labels = seen->front().by_level.front().labels;
    out.fabrics = labels.size() / (options.campaign.swatches * options.campaign.trials);
    if (Status ok = collector.add_seed(*seen, progress); !ok) return pass(ok.error());
  }
  collector.finish(out);
  return out;
}

std::vector<double> f_statistics(const classifier::FeatureMatrix& features) {
  std::vector<double> out;
  for (std::size_t column = 0; column < features.values.cols(); ++column) {
    const LabelSums sums(features, column);
    const double within = sums.within(), between = sums.between();
    out.push_back(within > 0    ? between / within
                  : between > 0 ? std::numeric_limits<double>::infinity()
                                : 0);
  }
  return out;
}

double spearman(std::span<const double> a, std::span<const double> b) {
  const std::vector<double> x = ranks(a), y = ranks(b);
  const double middle = 0.5 * (static_cast<double>(x.size()) - 1);
  double xy = 0, xx = 0, yy = 0;
  for (std::size_t i = 0; i < std::min(x.size(), y.size()); ++i) {
    xy += (x[i] - middle) * (y[i] - middle);
    xx += (x[i] - middle) * (x[i] - middle);
    yy += (y[i] - middle) * (y[i] - middle);
  }
  return xx > 0 && yy > 0 ? xy / std::sqrt(xx * yy) : 0;
}

std::vector<double> feature_shifts(const classifier::FeatureMatrix& features,
                                   const classifier::FeatureMatrix& yardstick) {
  std::vector<double> out;
  for (std::size_t column = 0; column < yardstick.values.cols(); ++column) {
    const LabelSums here(features, column), there(yardstick, column);
    const double deviation = std::sqrt(there.within());
    double sum = 0;
    for (const auto& [label, one] : there.of) sum += std::abs(here.of.at(label).mean - one.mean);
    const double mean = sum / static_cast<double>(there.of.size());
    out.push_back(deviation > 0 ? mean / deviation
                  : mean > 0    ? std::numeric_limits<double>::infinity()
                                : 0);
  }
  return out;
}

std::size_t most_shifted(std::span<const std::vector<double>> by_seed) {
  std::vector<double> sum = by_seed.front();
  for (const std::vector<double>& shifts : by_seed.subspan(1))
    for (std::size_t f = 0; f < sum.size(); ++f) sum[f] += shifts[f];
  return static_cast<std::size_t>(std::ranges::max_element(sum) - sum.begin());
}

}  // namespace weft::daemon
