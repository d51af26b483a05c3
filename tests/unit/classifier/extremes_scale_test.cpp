// Features at the limits of double: scaled, trained on, predicted, and refused by name.

#include <catch2/catch.hpp>
#include <limits>
#include <optional>

#include "classifier/learn/feature_view.hpp"
#include "classifier/learners/learner.hpp"
#include "classifier/vote/postprocessing.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::extremes_scale_test {
namespace {

using testing::gaussian_classes;

TEST_CASE("Extremes: a spread below the least double is none, and differences do not overflow") {
  const double least = std::numeric_limits<double>::denorm_min();
  const double top = largest_feature;
  Matrix rows(4, 4);
  for (std::size_t r = 0; r < 4; ++r) {
    const bool odd = r % 2 == 1;
    rows(r, 0) = odd ? least : 0.0;
    rows(r, 1) = odd ? 8 * least : 0.0;
    rows(r, 2) = odd ? top : -top;
    rows(r, 3) = least;
  }
  const Scaler scaler = fit_scaler(rows);
  CHECK(scaler.deviation[0] == 1.0);
  CHECK(scaler.deviation[1] == 4 * least);
  CHECK(scaler.deviation[2] == Approx(top));
  CHECK(scaler.deviation[3] == 1.0);
  const Matrix z = scaled(scaler, rows);
  for (std::size_t r = 0; r < 4; ++r) {
    const double side = r % 2 == 1 ? 1.0 : -1.0;
    CHECK(std::abs(z(r, 0)) <= least);
    CHECK(z(r, 1) == side);
    CHECK(z(r, 2) == Approx(side));
    CHECK(z(r, 3) == 0.0);
  }
}

TEST_CASE("Extremes: a column that is constant up to rounding is ignored at any size") {
  FeatureMatrix matrix = gaussian_classes(3, 8, 4, 6.0, 21),
                fresh = gaussian_classes(3, 8, 4, 6.0, 22);
  RandomEngine engine(23);
  for (FeatureMatrix* one : {&matrix, &fresh})
    for (std::size_t r = 0; r < one->size(); ++r) {
      one->values(r, 2) = 3e22 * (1.0 + 1e-14 * testing::normal(engine));
      one->values(r, 3) = 3e22;
    }
  fresh.values(0, 3) = std::nextafter(3e22, 0.0);
  const Scaler scaler = fit_scaler(matrix.values);
  const Matrix z = scaled(scaler, fresh.values);
  for (std::size_t r = 0; r < fresh.size(); ++r)
    for (const std::size_t k : {2U, 3U}) CHECK(std::abs(z(r, k)) < 1e-3);
  for (const Learner learner :
       {Learner::svc, Learner::lda, Learner::trees, Learner::all, Learner::pca, Learner::pvalue}) {
    CAPTURE(to_string(learner));
    const auto model = train_learner(matrix, learner, {});
    REQUIRE(model);
    const auto postprocessing = fit_postprocessing(model->trained, matrix, {});
    REQUIRE((postprocessing && *postprocessing));
    // distances are not affected either: two columns separate the classes, two do not
    for (const std::size_t k : {2U, 3U}) CHECK((*postprocessing)->profile.deviation[k] > 1e12);
    std::size_t right = 0;
    for (std::size_t r = 0; r < fresh.size(); ++r) {
      const auto reply = predict(model->trained, *postprocessing, fresh.values.row(r));
      REQUIRE(reply);
      right += model->trained.labels()[reply->ballot.winner] == fresh.labels[r] ? 1 : 0;
    }
    CHECK(right >= 22);
  }
}

TEST_CASE(
    "Extremes: features beyond what can be subtracted are refused by name, up to there used") {
  const double most = std::numeric_limits<double>::max();
  const FeatureMatrix usual = gaussian_classes(3, 6, 4, 4.0, 11);
  for (const double bad : {most, -most, std::nextafter(largest_feature, HUGE_VAL)}) {
    FeatureMatrix matrix = usual;
    matrix.values(3, 1) = bad;
    const auto refused = train_learner(matrix, Learner::lda, {});
    REQUIRE_FALSE(refused);
    CHECK(refused.error().expected == "magnitude up to 2.2e307");
    CHECK(refused.error().where == "3.csv: f1");
  }
  FeatureMatrix wide = usual;
  for (std::size_t r = 0; r < wide.size(); ++r)
    wide.values(r, 1) = r % 2 == 0 ? largest_feature : -largest_feature;
  for (const Learner learner :
       {Learner::lda, Learner::svc, Learner::trees, Learner::all, Learner::pvalue}) {
    const auto model = train_learner(wide, learner, {});
    REQUIRE(model);
    for (std::size_t r = 0; r < wide.size(); ++r)
      CHECK(model->trained.classify(wide.values.row(r)));
    const auto refused = model->trained.classify(std::vector<double>{0, 0, most, 0});
    REQUIRE_FALSE(refused);
    CHECK(refused.error().expected == "magnitude up to 2.2e307");
    CHECK(refused.error().where == "f2");
  }
}

TEST_CASE("Extremes: answers, probabilities and the reject rule from 1e-300 to 1e300, and beyond") {
  FeatureMatrix matrix = gaussian_classes(3, 8, 8, 6.0, 4);
  const std::vector<double> scale = {1e-300, 1e300, 1e-150, 1e150, 1.0, 1e-30, 1e30, 1e-310};
  for (std::size_t r = 0; r < matrix.size(); ++r)
    for (std::size_t k = 0; k < 8; ++k) matrix.values(r, k) *= scale[k];
  const double least = std::numeric_limits<double>::denorm_min();
  for (const Learner learner :
       {Learner::svc, Learner::lda, Learner::trees, Learner::all, Learner::pvalue}) {
    INFO(to_string(learner));
    const auto model = train_learner(matrix, learner, {});
    REQUIRE(model);
    const auto postprocessing = fit_postprocessing(model->trained, matrix, {});
    REQUIRE(postprocessing);
    std::size_t right = 0;
    const auto query = [&](std::span<const double> features) -> std::optional<Prediction> {
      const auto reply = predict(model->trained, *postprocessing, features);
      if (!reply) {
        CHECK(reply.error().what.find("not finite") != std::string::npos);
        return std::nullopt;
      }
      double sum = 0.0;
      for (const double p : reply->probability) {
        CHECK((p >= 0.0 && p <= 1.0));
        sum += p;
      }
      CHECK(sum == Approx(1.0));
      return *reply;
    };
    for (std::size_t r = 0; r < matrix.size(); ++r) {
      const auto reply = query(matrix.values.row(r));
      REQUIRE(reply);
      right += model->trained.labels()[reply->ballot.winner] == matrix.labels[r] ? 1 : 0;
    }
    CHECK(right >= matrix.size() - 2);
    for (const double far : {1.0, -1.0, 1e300, -1e300, least, 1e-300, largest_feature}) {
      const auto reply = query(std::vector<double>(8, far));
      if (reply && std::abs(far) >= 1.0) CHECK(reply->none_of_these);  // far in every small column
    }
  }
}

}  // namespace
}  // namespace weft::classifier::extremes_scale_test
