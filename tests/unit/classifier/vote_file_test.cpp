// Vote postprocessing in the model file.

#include <catch2/catch.hpp>
#include <limits>

#include "classifier/vote/postprocessing.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::vote_file_test {
namespace {

struct TrainingResult {
  FabricModel model;
  VotePostprocessing postprocessing;
};

TrainingResult training_result() {
  const FeatureMatrix matrix = testing::gaussian_classes(4, 6, 5, 1.5, 6);
  auto model = train(matrix, {});
  REQUIRE(model);
  auto postprocessing = fit_postprocessing(*model, matrix, {});
  REQUIRE(postprocessing);
  return {std::move(*model), std::move(*postprocessing)};
}

std::string format_text(const std::optional<VotePostprocessing>& postprocessing) {
  LineWriter out;
  write_postprocessing(out, postprocessing);
  return out.str();
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

TEST_CASE("stored aids answer exactly as those that were saved") {
  const TrainingResult before = training_result();
  const std::string text = format_text(before.postprocessing);
  LineReader in(text);
  const auto after = read_postprocessing(in, 4, 5, 6);
  in.finish();
  REQUIRE(in.ok());
  REQUIRE(after);
  CHECK(format_text(after) == text);
  const FeatureMatrix trials = testing::gaussian_classes(4, 5, 5, 1.5, 77);
  for (std::size_t r = 0; r < trials.size(); ++r) {
    const auto a = predict(before.model, before.postprocessing, trials.values.row(r));
    const auto b = predict(before.model, *after, trials.values.row(r));
    REQUIRE(a);
    REQUIRE(b);
    CHECK(a->probability == b->probability);
    CHECK(a->novelty == b->novelty);
    CHECK(a->none_of_these == b->none_of_these);
  }
}

TEST_CASE("a threshold that nothing exceeds survives, and so does the absence of aids") {
  VotePostprocessing postprocessing = training_result().postprocessing;
  postprocessing.reject.threshold[1] = std::numeric_limits<double>::infinity();
  const std::string text = format_text(postprocessing);
  LineReader in(text);
  CHECK(read_postprocessing(in, 4, 5, 6)->reject.threshold == postprocessing.reject.threshold);
  const std::string none = format_text(std::nullopt);
  LineReader empty(none);
  CHECK_FALSE(read_postprocessing(empty, 4, 5, 6));
  CHECK(empty.ok());
}

TEST_CASE("aids of another model and impossible values are refused with their line") {
  const std::string text = format_text(training_result().postprocessing);
  LineReader fewer(text);
  CHECK_FALSE((read_postprocessing(fewer, 3, 5, 3) && fewer.ok()));
  LineReader narrower(text);
  CHECK_FALSE((read_postprocessing(narrower, 4, 4, 6) && narrower.ok()));
  const auto [from, to] = GENERATE(table<std::string, std::string>({
      {"aids 1", "aids 2"},
      {"class_deviation ", "class_deviation -"},
      {"sharpness ", "sharpness -"},
      {"slope,offset -", "slope,offset "},
      {"reject_kind neighbour", "reject_kind mood"},
      {"reject_threshold ", "reject_threshold nan "},
      {"training_trials 24", "training_trials 25"},
      {"training_trials 24", "training_trials 9999999"},
      {"radius ", "radius -"},
      {"spread ", "spread 0 "},
  }));
  CAPTURE(from, to);
  const std::string altered = replaced(text, from, to);
  LineReader in(altered);
  static_cast<void>(read_postprocessing(in, 4, 5, 6));
  REQUIRE_FALSE(in.ok());
  CHECK(in.status().error().where.find("line ") != std::string::npos);
}

}  // namespace
}  // namespace weft::classifier::vote_file_test
