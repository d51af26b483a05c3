#include "classifier/model/stored_model.hpp"

#include <bit>
#include <catch2/catch.hpp>
#include <limits>
#include <set>
#include <sstream>

#include "classifier/base/line_io.hpp"
#include "tests/unit/classifier/damaged_model.hpp"
#include "tests/unit/classifier/stored_model.hpp"
#include "tests/unit/source_text.hpp"

namespace weft::classifier::model_file_test {
namespace {

using namespace testing;

std::vector<Learner> stored_kinds() {
  return {Learner::pvalue, Learner::pca, Learner::all, Learner::lda, Learner::svc, Learner::trees};
}

// The bits of all parts of an answer.
std::vector<std::uint64_t> bits_of(const Prediction& answer) {
  std::vector<double> all(answer.ballot.votes.begin(), answer.ballot.votes.end());
  for (const auto* part : {&answer.ballot.support, &answer.ballot.decision, &answer.probability})
    all.insert(all.end(), part->begin(), part->end());
  all.insert(all.end(), answer.novelty.begin(), answer.novelty.end());
  all.push_back(static_cast<double>(answer.ballot.winner));
  all.push_back(answer.none_of_these ? 1.0 : 0.0);
  std::vector<std::uint64_t> out;
  for (const double value : all) out.push_back(std::bit_cast<std::uint64_t>(value));
  return out;
}

TEST_CASE("a stored model of any learner answers bit for bit as the one that was saved") {
  for (const Learner kind : stored_kinds())
    for (const View view : tried_views())
      for (const bool postprocess : {false, true}) {
        CAPTURE(to_string(kind), to_string(view), postprocess);
        const StoredModel before = trained(kind, view, postprocess);
        const std::string text = saved(before);
        const auto after = loaded(text);
        REQUIRE(after);
        CHECK(after->learner.kind() == kind);
        CHECK(after->learner.view().kind() == view);
        CHECK(saved(*after) == text);
        for (const Trial& trial : cloths(3, 9)) {
          const auto features = extract(trial, before.setup.options);
          REQUIRE(features);
          const auto a = predict(before.learner, before.postprocessing, *features);
          const auto b = predict(after->learner, after->postprocessing, *features);
          REQUIRE((a && b));
          CHECK(bits_of(*a) == bits_of(*b));
          CHECK(a->probability.empty() != postprocess);
        }
      }
}

TEST_CASE("a stored learner answers as the learner itself, and knows the cloths") {
  for (const Learner kind : stored_kinds()) {
    CAPTURE(to_string(kind));
    const StoredModel stored = trained(kind, View::ranked, true);
    std::size_t right = 0;
    const std::vector<Trial> trials = cloths(3, 9);
    const auto reply = classify(stored, trials);
    REQUIRE(reply);
    REQUIRE(reply->size() == trials.size());
    for (std::size_t i = 0; i < trials.size(); ++i) {
      const std::size_t winner = (*reply)[i].ballot.winner;
      CHECK(winner == *stored.learner.classify(*extract(trials[i], {})));
      right += stored.learner.labels()[winner] == trials[i].label ? 1 : 0;
    }
    CHECK(right >= 25);  // of 27
  }
}

TEST_CASE("a learner without cores refuses kinds of vote that are for cores") {
  const StoredModel stored = trained(Learner::lda);
  for (const VoteKind kind : {VoteKind::soft, VoteKind::dag, VoteKind::shortlist}) {
    const auto reply = classify(stored, cloths(1, 1), {.kind = kind});
    REQUIRE_FALSE(reply);
    CHECK(to_string(reply.error()).find("lda") != std::string::npos);
  }
}

// The file was written by the last program that supported only version 3.
TEST_CASE("a file of version 3 is read, and stored as the version of today") {
  const std::string text = weft::testing::source_text("tests/golden/model/version_3.weft");
  REQUIRE(text.starts_with("weft-fabric-model 3\n"));
  const auto stored = loaded(text);
  REQUIRE(stored);
  CHECK(stored->learner.kind() == Learner::pvalue);
  CHECK(stored->learner.view().kind() == View::plain);
  REQUIRE(stored->postprocessing);
  const std::string today = saved(*stored);
  CHECK(today.starts_with(model_file_header));
  const auto again = loaded(today);
  REQUIRE(again);
  const std::vector<double> features(stored->learner.feature_names().size(), 3.0);
  const auto a = predict(stored->learner, stored->postprocessing, features);
  const auto b = predict(again->learner, again->postprocessing, features);
  REQUIRE((a && b));
  CHECK(bits_of(*a) == bits_of(*b));
  CHECK_FALSE(loaded(replaced(text, "reduction pvalue", "reduction lda")));
}

// The file was written by the last program that supported only version 4.
TEST_CASE("a file of version 4 with compressed features is read as such") {
  const std::string text = weft::testing::source_text("tests/golden/model/version_4.weft");
  REQUIRE(text.starts_with("weft-fabric-model 4\n"));
  const auto stored = loaded(text);
  REQUIRE(stored);
  CHECK(stored->learner.kind() == Learner::lda);
  CHECK(stored->learner.view().kind() == View::compressed);
  const auto again = loaded(saved(*stored));
  REQUIRE(again);
  const std::vector<double> features(stored->learner.feature_names().size(), 3.0);
  CHECK(*stored->learner.prepared(features) == *again->learner.prepared(features));
  CHECK_FALSE(loaded(replaced(text, "compressed 1", "compressed 0")));
}

// The file was written by the last program that supported only version 5.
TEST_CASE("a file of version 5 with ranked features is read as such, and knows no trees") {
  const std::string text = weft::testing::source_text("tests/golden/model/version_5.weft");
  REQUIRE(text.starts_with("weft-fabric-model 5\n"));
  const auto stored = loaded(text);
  REQUIRE(stored);
  CHECK(stored->learner.kind() == Learner::svc);
  CHECK(stored->learner.view().kind() == View::ranked);
  const std::string today = saved(*stored);
  CHECK(older_body(text) == older_body(today));
  const std::string trees = older_body(saved(trained(Learner::trees)));
  CHECK(loaded(weft::classifier::with_checksum("weft-fabric-model 6", trees)));
  CHECK_FALSE(loaded(weft::classifier::with_checksum("weft-fabric-model 5", trees)));
}

TEST_CASE("a model keeps the digests of its trials, which depend on samples and phases alone") {
  StoredModel stored = trained(Learner::lda);
  std::vector<Trial> trials = cloths(3, 6);
  stored.trained_on = content_digests(trials);
  const auto again = loaded(saved(stored));
  REQUIRE(again);
  CHECK(again->trained_on == stored.trained_on);
  CHECK(std::set(again->trained_on.begin(), again->trained_on.end()).size() == trials.size());
  Trial other = trials[4];
  other.file = other.label = other.group = "else";
  CHECK(content_digest(other) == stored.trained_on[4]);
  other.counts[7] += 1e-9;
  CHECK(content_digest(other) != stored.trained_on[4]);
  other = trials[4];
  other.phase[8] = Phase::rest;
  CHECK(content_digest(other) != stored.trained_on[4]);
  CHECK(loaded(replaced(saved(stored), "trained_on 18", "trained_on 17")).error().code ==
        Errc::corrupt);
}

TEST_CASE("bench kind, data set and training options travel with a model") {
  const auto stored = loaded(saved(trained(Learner::pvalue)));
  REQUIRE(stored);
  CHECK(stored->provenance.bench == "simulated");
  CHECK(stored->provenance.dataset_sha256 == "abc123");
  CHECK(stored->provenance.training == "seed 1, \"two\nlines\" and a \\");
  CHECK(stored->setup.exploration == "M1");
  CHECK(stored->setup.sample_period_s == 0.028);
  CHECK(stored->learner.cores()->cores()[0].info().selected.size() ==
        stored->learner.cores()->cores()[0].info().inputs);
}

TEST_CASE("a truncated model file is refused, wherever it ends") {
  const std::string text = saved(trained(Learner::pvalue));
  for (std::size_t length = 0; length < text.size(); length += 1 + text.size() / 200)
    CHECK_FALSE(loaded(text.substr(0, length)));
  CHECK_FALSE(loaded(text.substr(0, text.size() - 1)));
}

TEST_CASE("one altered byte anywhere is noticed") {
  const std::string text = saved(trained(Learner::pvalue));
  for (std::size_t at = 0; at < text.size(); at += 1 + text.size() / 200) {
    std::string altered = text;
    altered[at] = static_cast<char>(altered[at] ^ 0x04);
    CHECK_FALSE(loaded(altered));
  }
}

TEST_CASE("another version and another file are told apart from damage") {
  const std::string text = saved(trained(Learner::all));
  for (const char* other : {"weft-fabric-model 2", "weft-model 2"})
    CHECK(loaded(replaced(text, std::string(model_file_header), other)).error().code ==
          Errc::unsupported);
  CHECK(loaded(replaced(text, "modality fabric", "modality vibro")).error().code == Errc::parse);
  CHECK(loaded(replaced(text, "modality fabric", "modality weave")).error().code == Errc::corrupt);
  CHECK(loaded(replaced(text, "stages 0\n", "stages 1\nmotion_frames 9\nsample_rate_hz 9\n"))
            .error()
            .code == Errc::unsupported);
  CHECK(loaded("t_s,ch1\n0,1\n").error().code == Errc::parse);
  CHECK(loaded("").error().code == Errc::parse);
}

TEST_CASE("a trial of another sensor or with other phases is refused by name") {
  const StoredModel stored = trained(Learner::pvalue);
  std::vector<Trial> trials = cloths(1, 2);
  for (Phase& phase : trials[1].phase)
    if (phase == Phase::end) phase = Phase::none;
  const auto phases = classify(stored, trials);
  REQUIRE_FALSE(phases);
  CHECK(phases.error().expected == "SPME");
  CHECK(phases.error().got == "SPM");
  CHECK(phases.error().where == trials[1].file);
  const std::vector<Trial> other_sensor{motion_trial({{1, 2}, {3, 4}})};
  const auto other = classify(stored, other_sensor);
  REQUIRE_FALSE(other);
  CHECK(other.error().expected == "3 taxels");
  CHECK(other.error().got == "2 taxels");
}

TEST_CASE("a model with features other than those of its setup is not written") {
  StoredModel stored = trained(Learner::pvalue);
  stored.setup.taxels = 4;
  std::ostringstream out;
  CHECK_FALSE(save_model(stored, out));
  CHECK(out.str().empty());
}

TEST_CASE("numbers in lines come back bit for bit") {
  const std::vector<double> values{0.1,
                                   -0.0,
                                   1.0 / 3.0,
                                   std::numeric_limits<double>::denorm_min(),
                                   std::numeric_limits<double>::max(),
                                   1e23};
  LineWriter out;
  out.numbers("x", values);
  LineReader in(out.str());
  const std::vector<double> back = in.numbers("x", values.size());
  REQUIRE(back.size() == values.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    CHECK(std::bit_cast<std::uint64_t>(back[i]) == std::bit_cast<std::uint64_t>(values[i]));
}

}  // namespace
}  // namespace weft::classifier::model_file_test
