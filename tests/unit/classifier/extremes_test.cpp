// The method at its limits: the documented value or a clear error, and never a NaN.

#include <array>
#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

#include "classifier/fabric/model.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "tests/unit/allocations.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::extremes_test {
namespace {

using testing::gaussian_classes;
using testing::motion_trial;

// Places in the vector of one taxel with phase M only: Table I from the fourth feature on.
enum At : std::size_t {
  at_max,
  at_min,
  at_mean,
  at_var,
  at_norm,
  at_kurt,
  at_skew,
  at_range,
  at_mode,
  at_m5,
  at_hfrq,
  at_sh
};

// Features of one taxel alone. Sixteen of them together must have the same bits, except for the
// spectrum: a shared transform may change its last bits.
std::vector<double> compute_features(const std::vector<double>& signal) {
  const auto out = extract(motion_trial(signal));
  REQUIRE(out);
  REQUIRE(out->size() == 12);
  for (const double v : *out) REQUIRE(std::isfinite(v));
  constexpr std::size_t many = 16;
  std::vector<std::vector<double>> rows;
  for (const double v : signal) rows.emplace_back(many, v);
  const auto wide = extract(motion_trial(rows));
  REQUIRE(wide);
  REQUIRE(wide->size() == 12 * many);
  const double rounding = 1e-12 * std::max(std::abs((*out)[at_max]), std::abs((*out)[at_min]));
  for (std::size_t k = 0; k < out->size(); ++k)
    for (std::size_t t = 0; t < many; ++t) {
      const double one = (*out)[k], beside = (*wide)[k * many + t];
      INFO("feature " << k << ", taxel " << t << ": " << one << " alone, " << beside << " beside");
      const bool of_spectrum = k == at_hfrq || k == at_sh;
      REQUIRE((of_spectrum
                   ? std::abs(one - beside) <= rounding
                   : std::bit_cast<std::uint64_t>(one) == std::bit_cast<std::uint64_t>(beside)));
    }
  return *out;
}

Trial with_phases(std::size_t each, std::size_t motion, double level) {
  Trial out = motion_trial(std::vector<double>(3 * each + motion, level));
  for (std::size_t i = 0; i < each; ++i) {
    out.phase[i] = Phase::rest;
    out.phase[each + i] = Phase::press;
    out.phase[2 * each + motion + i] = Phase::end;
  }
  return out;
}

// A hash of 64 bits over the bits of every number: equal on two compilers if every number is.
class Hash {
 public:
  void add(double v) {
    value_ = (value_ ^ std::bit_cast<std::uint64_t>(v)) * 1099511628211ULL;
    finite_ = finite_ && std::isfinite(v);
  }
  void add(std::span<const double> values) {
    for (const double v : values) add(v);
  }
  void add(const FabricModel& model, const FeatureMatrix& matrix) {
    for (const FabricCore& core : model.cores()) {
      const CoreInfo& info = core.info();
      for (const double v : {info.c, info.gamma, info.threshold, info.cv_loss, core.bias()}) add(v);
      add(core.coefficient());
      add(core.support().data());
      for (const SelectedFeature& s : info.selected) add(s.t), add(s.p_value);
    }
    for (const Vote& vote : testing::votes_on(model, matrix)) add(vote.decision), add(vote.support);
  }
  [[nodiscard]] std::uint64_t value() const { return value_; }
  [[nodiscard]] bool finite() const { return finite_; }

 private:
  std::uint64_t value_ = 1469598103934665603ULL;
  bool finite_ = true;
};

// Trains every kind and votes on the training rows; no result may be NaN or infinite.
void trains_and_votes(const FeatureMatrix& matrix, TrainOptions options = {}) {
  for (const Reduction r : {Reduction::pvalue, Reduction::pca, Reduction::all}) {
    INFO(to_string(r));
    options.reduction = r;
    const auto model = train(matrix, options);
    REQUIRE(model);
    Hash seen;
    seen.add(*model, matrix);
    CHECK(seen.finite());
  }
}

}  // namespace

TEST_CASE("Extremes: no sample in M is refused, one to three give the documented values") {
  const auto none = extract(with_phases(2, 0, 5.0));
  REQUIRE_FALSE(none);
  CHECK(none.error().expected == "at least one sample");
  const auto one = compute_features({7});
  CHECK(one[at_max] == 7.0);
  CHECK(one[at_mode] == 7.0);
  CHECK(one[at_norm] == 7.0);
  CHECK(one[at_kurt] == 3.0);
  for (const At k : {at_var, at_skew, at_range, at_m5, at_hfrq, at_sh}) CHECK(one[k] == 0.0);
  const auto two = compute_features({3, 5});
  CHECK(two[at_var] == 2.0);
  CHECK(two[at_kurt] == 3.0);
  CHECK(two[at_m5] == 0.0);
  CHECK(two[at_hfrq] == Approx(2.0));  // 2/T |X_1| = |-1 - 1|
  CHECK(two[at_sh] == Approx(2.0));
  const auto three = compute_features({0, 6, 0});
  CHECK(three[at_var] == Approx(12.0));
  CHECK(three[at_skew] == 0.0);  // one peak
  CHECK(three[at_kurt] == 3.0);
  CHECK(three[at_hfrq] == Approx(4.0));
}

TEST_CASE(
    "Extremes: a phase around M of no sample leaves its features out, of one to three counts") {
  CHECK(extract(with_phases(0, 5, 9.0))->size() == 12);
  for (const std::size_t each : {1U, 2U, 3U}) {
    const auto out = extract(with_phases(each, 5, 9.0));
    REQUIRE(out);
    REQUIRE(out->size() == 15);
    CHECK((*out)[0] == 9.0);
    CHECK((*out)[1] == 0.0);
    CHECK((*out)[2] == 0.0);
  }
}

TEST_CASE("Extremes: a sinusoid reads its amplitude at a prime length") {
  for (const std::size_t length : {std::size_t{907}, std::size_t{4999}, std::size_t{10007}}) {
    std::vector<double> signal;
    for (std::size_t i = 0; i < length; ++i)
      signal.push_back(1000.0 + 300.0 * std::cos(2.0 * M_PI * 5.0 * static_cast<double>(i) /
                                                 static_cast<double>(length)));
    CHECK(compute_features(signal)[at_hfrq] == Approx(300.0).epsilon(1e-9));
  }
}

TEST_CASE("Extremes: constant and saturated signals have no spread, exactly") {
  for (const double level : {0.0, 0.1, 65535.0}) {
    const auto out = compute_features(std::vector<double>(925, level));
    CHECK(out[at_mean] == Approx(level));
    CHECK(out[at_kurt] == 3.0);
    for (const At k : {at_var, at_skew, at_range, at_m5, at_hfrq, at_sh}) CHECK(out[k] == 0.0);
  }
}

TEST_CASE("Extremes: moments do not depend on the level or the unit of a signal") {
  // whole numbers up to 10, more low ones than high ones
  const auto ripple = [](std::size_t i) {
    const auto k = static_cast<double>(i * i % 21);
    return k * k / 20 - 10;
  };
  const auto moved = [&](std::size_t count, double level, double unit) {
    std::vector<double> out(count);
    for (std::size_t i = 0; i < count; ++i) out[i] = level + unit * std::round(ripple(i));
    return out;
  };
  for (const std::size_t count : {925U, 30'000U}) {
    const auto plain = compute_features(moved(count, 0, 1));
    REQUIRE(plain[at_var] > 10);
    for (const auto& [level, unit, within] : {std::tuple{1e12, 1.0, 1e-4},
                                              {-1e12, 1.0, 1e-4},
                                              {1e15, 1.0, 0.05},
                                              {0.8e-12, 1e-15, 1e-9}}) {
      INFO(count << " samples at " << level);
      const auto out = compute_features(moved(count, level, unit));
      // moments of the peaks, which differ by two: a mean at 1e15 is exact to a sixteenth
      CHECK(out[at_skew] == Approx(plain[at_skew]).margin(2 * within));
      CHECK(out[at_kurt] == Approx(plain[at_kurt]).margin(within));
      CHECK(out[at_var] / unit / unit == Approx(plain[at_var]).epsilon(within));
    }
  }
}

TEST_CASE("Extremes: one spike has the moments of its closed form") {
  constexpr double n = 925, height = 65535;
  std::vector<double> signal(static_cast<std::size_t>(n), 0.0);
  signal[400] = height;
  const auto out = compute_features(signal);
  const double p = 1.0 / n, m2 = p * (1 - p), m4 = m2 * (1 - 3 * m2);
  CHECK(out[at_var] == Approx(height * height * m2 * n / (n - 1)).epsilon(1e-12));
  CHECK(out[at_kurt] == Approx(m4 / (m2 * m2)).epsilon(1e-12));  // 923
  CHECK(out[at_skew] == 0.0);                                    // one peak
  CHECK(out[at_hfrq] == Approx(2.0 * height / n).epsilon(1e-9));
  CHECK(out[at_mode] == 0.0);
}

TEST_CASE("Extremes: NaN, infinity and counts with overflowing moments are refused by name") {
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    const auto out = extract(motion_trial({1, 2, bad}));
    REQUIRE_FALSE(out);
    CHECK(out.error().expected == "a finite number");
    CHECK(out.error().where == "trial.csv: sample 2, taxel 1");
  }
  const auto huge = extract(motion_trial({0, 1e300, 0, -1e300, 5}));
  REQUIRE_FALSE(huge);
  CHECK(huge.error().what.find("overflows") != std::string::npos);
  FeatureMatrix matrix = gaussian_classes(2, 4, 3, 4.0, 1);
  matrix.values(3, 1) = HUGE_VAL;
  const auto model = train(matrix);
  REQUIRE_FALSE(model);
  CHECK(model.error().where == "3.csv: f1");
}

TEST_CASE("Extremes: subnormal counts are a constant, up to the rounding that is documented") {
  const double least = std::numeric_limits<double>::denorm_min();
  const auto out = compute_features({least, 0, 3 * least, 0, least});
  for (const At k : {at_var, at_m5, at_hfrq, at_sh}) CHECK(out[k] == 0.0);
  CHECK(out[at_max] == 3 * least);
}

TEST_CASE("Extremes: duplicate trials, two identical classes and constant columns train and vote") {
  FeatureMatrix matrix = gaussian_classes(3, 6, 8, 2.0, 2);
  for (std::size_t r = 0; r < 6; ++r) {  // one class is six copies of one trial, another is its
                                         // twin
    std::copy(matrix.values.row(0).begin(), matrix.values.row(0).end(),
              matrix.values.row(r).begin());
    std::copy(matrix.values.row(0).begin(), matrix.values.row(0).end(),
              matrix.values.row(6 + r).begin());
  }
  for (std::size_t r = 0; r < matrix.size(); ++r) matrix.values(r, 7) = 42.0;
  trains_and_votes(matrix);
}

TEST_CASE("Extremes: a class with one trial is refused by its name") {
  FeatureMatrix matrix = gaussian_classes(2, 4, 3, 4.0, 3);
  matrix.labels[7] = "velvet";
  const auto model = train(matrix);
  REQUIRE_FALSE(model);
  CHECK(model.error().where == "label velvet");
}

TEST_CASE(
    "Extremes: columns from 1e-300 to 1e300, and subnormal ones, are each used at their scale") {
  FeatureMatrix matrix = gaussian_classes(4, 8, 8, 6.0, 4);
  const FeatureMatrix plain = matrix;
  const std::vector<double> scale = {1e-300, 1e300, 1e-150, 1e150, 1.0, 1e-30, 1e30, 1e-310};
  for (std::size_t r = 0; r < matrix.size(); ++r)
    for (std::size_t k = 0; k < 8; ++k) matrix.values(r, k) *= scale[k];
  trains_and_votes(matrix);
  const auto scaled_model = train(matrix).value(), plain_model = train(plain).value();
  for (std::size_t i = 0; i < plain_model.cores().size(); ++i) {
    CHECK(scaled_model.cores()[i].info().cv_errors == plain_model.cores()[i].info().cv_errors);
    CHECK(scaled_model.cores()[i].reducer().columns() ==
          plain_model.cores()[i].reducer().columns());
  }
}

TEST_CASE(
    "Extremes: C and gamma at the ends of double train, by both solvers alike, or are refused") {
  const FeatureMatrix matrix = gaussian_classes(2, 8, 4, 2.0, 5);
  for (const double c : {1e-308, 1.0, Grid::most_c}) {
    for (const double gamma : {1e-308, 1.0, 1e308}) {
      INFO("C " << c << ", gamma " << gamma);
      TrainOptions options;
      options.grid.c = {c};
      options.grid.gamma = {gamma};
      trains_and_votes(matrix, options);
      const auto own = train(matrix, options).value();
      options.search = Search::libsvm;
      const auto reference = train(matrix, options).value();
      CHECK(own.cores()[0].coefficient() == reference.cores()[0].coefficient());
      CHECK(own.cores()[0].bias() == reference.cores()[0].bias());
    }
  }
  for (const double bad : {0.0, -1.0, 1e308, HUGE_VAL, std::nan("")}) {
    TrainOptions options;
    options.grid.c = {bad};
    const auto refused = train(matrix, options);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().where == "grid C");
    options = {};
    options.grid.gamma = {bad};
    CHECK(train(matrix, options).has_value() == (bad == 1e308));
  }
}

TEST_CASE("Extremes: one taxel, two classes; and a vector with 1024 taxels") {
  trains_and_votes(gaussian_classes(2, 3, 1, 8.0, 6));
  std::vector<double> row;
  for (std::size_t k = 0; k < 1024; ++k) row.push_back(static_cast<double>(k));
  std::vector<std::vector<double>> rows(7, row);
  rows[3].back() = 5000.0;
  const auto out = extract(motion_trial(rows));
  REQUIRE(out);
  REQUIRE(out->size() == 12 * 1024);
  CHECK((*out)[1023] == 5000.0);             // F_max of the last taxel
  CHECK((*out)[1024 + 1000] == 1000.0);      // F_min
  CHECK((*out)[7 * 1024 + 1023] == 3977.0);  // F_range
  CHECK((*out)[7 * 1024 + 1022] == 0.0);
}

TEST_CASE("Extremes: 500 classes train and vote with a grid of one point") {
  FeatureMatrix matrix = gaussian_classes(500, 3, 12, 6.0, 7);
  for (std::size_t r = 0; r < matrix.size(); ++r) matrix.labels[r] = std::to_string(1000 + r / 3);
  TrainOptions options{.folds = 2};
  options.grid.c = {8};
  options.grid.gamma = {0x1p-5};
  options.grid.delta = {5e-2};
  const auto model = train(matrix, options);
  REQUIRE(model);
  CHECK(model->cores().size() == 124750);
  const auto vote = model->classify(matrix.values.row(4));
  REQUIRE(vote);
  CHECK(vote->winner == 1);
}

TEST_CASE("Extremes: every compiler and processor computes the same bits") {
  Hash hash;
  RandomEngine engine(17);
  std::vector<std::vector<double>> rows(313, std::vector<double>(5));
  for (auto& row : rows)
    for (double& v : row) v = static_cast<double>(random_below(engine, 65536));
  hash.add(*extract(motion_trial(rows)));
  FeatureMatrix matrix = gaussian_classes(4, 7, 30, 0.0, 8);
  for (std::size_t r = 0; r < matrix.size(); ++r)  // the input does not use a logarithm of the C
                                                   // library
    for (std::size_t k = 0; k < 30; ++k)
      matrix.values(r, k) = static_cast<double>(random_below(engine, 1000) + (r / 7) * k % 400);
  hash.add(train(matrix).value(), matrix);
  hash.add(train(matrix, {.reduction = Reduction::all}).value(), matrix);
  CHECK(hash.finite());
  CHECK(hash.value() == 0xf78cf42423c86256ULL);  // gcc 12 and clang 14
}

TEST_CASE(
    "Extremes: ten million samples of one or two taxels are computed; of more refused unread") {
  Trial trial;
  const auto fill = [&](std::size_t samples, std::size_t taxels) {
    constexpr std::array wave = {80.0, 0.0, -80.0, 0.0};  // 80 cos(pi i / 2)
    trial.taxels = taxels;
    trial.phase.assign(samples, Phase::motion);
    trial.counts.resize(samples * taxels);
    for (std::size_t i = 0; i < trial.counts.size(); ++i)
      trial.counts[i] = 1000.0 + wave[i / taxels % 4];
  };
  for (const auto& [samples, taxels] :
       {std::pair{std::size_t{200'000}, std::size_t{1}}, {10'000'000, 1}, {10'000'000, 2}}) {
    INFO(samples << " samples of " << taxels);
    fill(samples, taxels);
    const auto out = extract(trial);
    REQUIRE(out);
    REQUIRE(out->size() == 12 * taxels);
    for (std::size_t t = 0; t < taxels; ++t) {
      const auto feature = [&](At k) { return (*out)[k * taxels + t]; };
      CHECK(feature(at_mean) == 1000.0);
      CHECK(feature(at_mode) == 1000.0);
      CHECK(feature(at_hfrq) == Approx(80.0).epsilon(1e-9));
      CHECK(feature(at_var) == Approx(3200.0).epsilon(1e-4));
      CHECK(feature(at_sh) < 1e-3);
    }
  }
  fill(2'000'000, 3);
  const std::size_t before = allocations();
  const auto refused = extract(trial);
  CHECK(allocations() - before < 30);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::range);
  CHECK(refused.error().got == "2000000");
  FeatureStream stream(3);
  CHECK_FALSE(stream.add(Phase::motion, trial.counts));
  CHECK(stream.motion_frames() == 0);
}

}  // namespace weft::classifier::extremes_test
