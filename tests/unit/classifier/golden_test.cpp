// Features, t, p, subsets, chosen grid points and votes compared with
// tests/golden/features/fabric.json, which make_fabric.py wrote with numpy, scipy and scikit-learn.

#include <algorithm>
#include <catch2/catch.hpp>
#include <fstream>
#include <nlohmann/json.hpp>

#include "classifier/base/student_t.hpp"
#include "classifier/fabric/model.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/selection/selection.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::golden_test {
namespace {

using testing::relative_difference;

constexpr std::size_t classes = 3, reps = 10, taxels = 4;

const nlohmann::json& golden() {
  static const nlohmann::json json = [] {
    std::ifstream in(WEFT_SOURCE_DIR "/tests/golden/features/fabric.json");
    return nlohmann::json::parse(in);
  }();
  return json;
}

// MurmurHash3's finaliser of (trial, number of the draw), as in make_fabric.py.
class Draws {
 public:
  Draws(std::size_t cls, std::size_t rep) : seed_(static_cast<std::uint32_t>(1000 * cls + rep)) {}
  int operator()(std::uint32_t n) {
    std::uint32_t h = seed_ * 0x9E3779B1U + drawn_++ * 0x85EBCA6BU;
    h = (h ^ (h >> 16)) * 0x85EBCA6BU;
    h = (h ^ (h >> 13)) * 0xC2B2AE35U;
    return static_cast<int>((h ^ (h >> 16)) % n);
  }

 private:
  std::uint32_t seed_;
  std::uint32_t drawn_ = 0;
};

struct PhaseRecipe {
  Phase phase;
  std::size_t samples;
  int level;
};

Trial synthetic_trial(std::size_t cls, std::size_t rep) {
  Draws draw(cls, rep);
  Trial out;
  out.file = "synthetic";
  out.taxels = taxels;
  std::vector<int> offset(taxels);
  for (int& o : offset) o = draw(90);
  const std::vector<PhaseRecipe> recipe = {{Phase::rest, 7, 900},
                                           {Phase::press, 11, 1500},
                                           {Phase::motion, 97 + rep % 3, 1500},
                                           {Phase::end, 5, 950}};
  for (const PhaseRecipe& p : recipe) {
    for (std::size_t i = 0; i < p.samples; ++i) {
      out.phase.push_back(p.phase);
      for (std::size_t k = 0; k < taxels; ++k) {
        const int period = static_cast<int>(6 + cls / 2 + k);
        const int slope = static_cast<int>(5 + cls % 2);
        const int wave = std::abs(2 * (static_cast<int>(i) % period) - period) * slope;
        const int moving = p.phase == Phase::motion ? wave : 0;
        out.counts.push_back(p.level + 40 * static_cast<int>(k) + 6 * static_cast<int>(cls) +
                             offset[k] + moving + draw(120));
      }
    }
  }
  return out;
}

FeatureMatrix synthetic_matrix() {
  std::vector<Trial> trials;
  for (std::size_t c = 0; c < classes; ++c) {
    for (std::size_t r = 0; r < reps; ++r) {
      trials.push_back(synthetic_trial(c, r));
      trials.back().label = std::string(1, static_cast<char>('a' + c));
    }
  }
  return build_feature_matrix(trials).value();
}

std::vector<std::size_t> rows_of(std::size_t cls, const char* part) {
  std::vector<std::size_t> out;
  for (const std::size_t r : golden()[part].get<std::vector<std::size_t>>()) {
    out.push_back(cls * reps + r);
  }
  return out;
}

std::vector<std::size_t> pair_rows(const nlohmann::json& pair) {
  auto rows = rows_of(pair["a"], "train");
  const auto b = rows_of(pair["b"], "train");
  rows.insert(rows.end(), b.begin(), b.end());
  return rows;
}

std::vector<int> pair_sign() {
  std::vector<int> sign(golden()["train"].size(), 1);
  sign.resize(2 * sign.size(), -1);
  return sign;
}

std::vector<Fold> build_folds(const nlohmann::json& pair) {
  std::vector<Fold> out;
  for (const auto& validate : pair["folds"]) {
    Fold fold;
    fold.validate = validate.get<std::vector<std::size_t>>();
    for (std::size_t i = 0; i < pair_sign().size(); ++i) {
      const bool held =
          std::find(fold.validate.begin(), fold.validate.end(), i) != fold.validate.end();
      if (!held) fold.train.push_back(i);
    }
    out.push_back(fold);
  }
  return out;
}

TrainOptions options_of(const nlohmann::json& figures) {
  TrainOptions options;
  options.reduction = testing::reduction_named(figures["reduction"].get<std::string>());
  options.nested = figures["nested"];
  return options;
}

TEST_CASE("Feature names and values equal the Python reference's on synthetic trials") {
  const FeatureMatrix matrix = synthetic_matrix();
  CHECK(matrix.names == golden()["names"].get<std::vector<std::string>>());
  double worst = 0.0;
  for (std::size_t r = 0; r < matrix.size(); ++r) {
    for (std::size_t k = 0; k < matrix.names.size(); ++k) {
      worst = std::max(worst, relative_difference(matrix.values(r, k), golden()["features"][r][k]));
    }
  }
  CHECK(worst < 1e-9);
}

TEST_CASE("Features of trials with one to a dozen samples equal the Python reference's") {
  for (const auto& edge : golden()["edge"]) {
    const auto features =
        extract(testing::motion_trial(edge["counts"].get<std::vector<std::vector<double>>>()));
    REQUIRE(features);
    const auto want = edge["features"].get<std::vector<double>>();
    REQUIRE(features->size() == want.size());
    for (std::size_t k = 0; k < want.size(); ++k) {
      INFO("samples " << edge["counts"].size() << ", feature " << k);
      CHECK(std::abs((*features)[k] - want[k]) <= 1e-9 * std::abs(want[k]) + 1e-12);
    }
  }
}

TEST_CASE("t, p and the subset of every delta equal the Python reference's") {
  const FeatureMatrix matrix = synthetic_matrix();
  const TrainOptions options;
  for (const auto& pair : golden()["pairs"]) {
    const auto sign = pair_sign();
    const auto t = testing::t_of_all(matrix.values.take(pair_rows(pair)), sign);
    const double df = static_cast<double>(sign.size()) - 2.0;
    for (std::size_t k = 0; k < t.size(); ++k) {
      CHECK(relative_difference(t[k], pair["t"][k]) < 1e-9);
      CHECK(relative_difference(two_sided_p(t[k], df), pair["p"][k]) < 1e-9);
    }
    const auto ranked = rank_by_t(t);
    for (std::size_t d = 0; d < options.grid.delta.size(); ++d) {
      const auto size = subset_size(t, ranked, df, options.grid.delta[d], options.cap);
      const std::vector<std::size_t> subset(ranked.begin(),
                                            ranked.begin() + static_cast<std::ptrdiff_t>(size));
      CHECK(subset == pair["subsets"][d].get<std::vector<std::size_t>>());
    }
  }
}

TEST_CASE("Every core chooses the grid point of the Python reference, given its folds") {
  const FeatureMatrix matrix = synthetic_matrix();
  auto test_rows = rows_of(0, "test");
  for (const std::size_t c : {1U, 2U}) {
    const auto more = rows_of(c, "test");
    test_rows.insert(test_rows.end(), more.begin(), more.end());
  }
  for (const auto& pair : golden()["pairs"]) {
    for (const auto& want : pair["cores"]) {
      INFO(want["reduction"] << " nested " << want["nested"] << " " << pair["a"] << pair["b"]);
      const auto core = testing::lone_core(matrix.values.take(pair_rows(pair)), pair_sign(),
                                           build_folds(pair), options_of(want));
      REQUIRE(core);
      CHECK(core->info().cv_errors == want["cv_errors"].get<std::size_t>());
      CHECK(core->info().c == want["c"].get<double>());
      CHECK(core->info().gamma == want["gamma"].get<double>());
      CHECK(core->info().inputs == want["inputs"].get<std::size_t>());
      if (core->info().inputs == want["selected"].size()) {
        CHECK(core->reducer().columns() == want["selected"].get<std::vector<std::size_t>>());
      }
      for (std::size_t i = 0; i < test_rows.size(); ++i) {
        const double f = core->decide(matrix.values.row(test_rows[i]));
        CHECK(f == Approx(want["decision"][i].get<double>()).epsilon(1e-6).margin(1e-6));
      }
    }
  }
}

TEST_CASE("The vote over all cores equals the Python reference's") {
  const FeatureMatrix matrix = synthetic_matrix();
  std::vector<std::size_t> train_rows, test_rows;
  for (std::size_t c = 0; c < classes; ++c) {
    for (const std::size_t r : rows_of(c, "train")) train_rows.push_back(r);
    for (const std::size_t r : rows_of(c, "test")) test_rows.push_back(r);
  }
  for (const auto& want : golden()["votes"]) {
    TrainOptions options = options_of(want);
    // all pairs have the same sizes and the reference the same seed: the same folds
    options.make_folds = [](std::span<const int>) { return build_folds(golden()["pairs"][0]); };
    const auto model = train(select_rows(matrix, train_rows), options);
    REQUIRE(model);
    std::vector<std::size_t> predictions;
    for (const Vote& vote : testing::votes_on(*model, select_rows(matrix, test_rows)))
      predictions.push_back(vote.winner);
    CHECK(predictions == want["predictions"].get<std::vector<std::size_t>>());
  }
}

}  // namespace
}  // namespace weft::classifier::golden_test
