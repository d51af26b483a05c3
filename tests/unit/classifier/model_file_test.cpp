#include "classifier/fabric/model_file.hpp"

#include <bit>
#include <catch2/catch.hpp>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>

#include "classifier/fabric/line_text.hpp"
#include "protocols/base/crc.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::model_file_test {
namespace {

constexpr std::size_t taxels = 3;

// Two or more cloths that differ in level and ripple, with all four phases.
std::vector<Trial> cloths(std::size_t classes, std::size_t per_class) {
  RandomEngine engine(7);
  std::vector<Trial> out;
  for (std::size_t i = 0; i < classes * per_class; ++i) {
    const double c = static_cast<double>(i / per_class);
    Trial trial;
    trial.file = std::to_string(i) + ".csv";
    trial.label = "cloth " + std::to_string(i / per_class);
    trial.taxels = taxels;
    for (std::size_t k = 0; k < 64; ++k) {
      trial.phase.push_back(k < 8    ? Phase::rest
                            : k < 16 ? Phase::press
                            : k < 56 ? Phase::motion
                                     : Phase::end);
      for (std::size_t t = 0; t < taxels; ++t)
        trial.counts.push_back(100.0 + 2.0 * c + (1.0 + c) * testing::normal(engine));
    }
    out.push_back(std::move(trial));
  }
  return out;
}

StoredModel trained(Learner kind, View view = View::plain, bool with_aids = false) {
  TrainOptions options;
  options.threads = 1;
  const auto matrix = build_feature_matrix(cloths(3, 6), {}, 1);
  REQUIRE(matrix);
  auto learner = train_recipe(*matrix, {kind, 20, view}, options);
  REQUIRE(learner);
  StoredModel out{std::move(*learner),
                  {taxels, {true, true, true}, {}, 0.0, 0.0, 0.028, "M1"},
                  {"simulated", "abc123", "0.1.0", "seed 1, \"two\nlines\" and a \\"}};
  if (!with_aids) return out;
  auto aids = learn_aids(out.learner, *matrix, options);
  REQUIRE(aids);
  out.aids = std::move(*aids);
  return out;
}

std::vector<Learner> stored_kinds() {
  return {Learner::pvalue, Learner::pca, Learner::all, Learner::lda, Learner::svc, Learner::trees};
}

std::string saved(const StoredModel& stored) {
  std::ostringstream out;
  REQUIRE(save_model(stored, out));
  return out.str();
}

Result<StoredModel> loaded(const std::string& text) {
  std::istringstream in(text);
  return load_model(in);
}

// `text` with a checksum that fits, so that what is tested is the parser behind it.
std::string sealed(std::string text) {
  text.resize(text.rfind("crc32 "));
  char line[32];
  std::snprintf(line, sizeof line, "crc32 %08x\n",
                crc32({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}));
  return text + line;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return sealed(text.replace(at, from.size(), to));
}

// Bits of everything that an answer says.
std::vector<std::uint64_t> bits_of(const Answer& answer) {
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
    for (const View view : all_views())
      for (const bool with_aids : {false, true}) {
        CAPTURE(to_string(kind), to_string(view), with_aids);
        const StoredModel before = trained(kind, view, with_aids);
        const std::string text = saved(before);
        const auto after = loaded(text);
        REQUIRE(after);
        CHECK(after->learner.kind() == kind);
        CHECK(after->learner.view().kind() == view);
        CHECK(saved(*after) == text);
        for (const Trial& trial : cloths(3, 9)) {
          const auto a = classify(before, trial);
          const auto b = classify(*after, trial);
          REQUIRE((a && b));
          CHECK(bits_of(*a) == bits_of(*b));
          CHECK(a->probability.empty() != with_aids);
        }
      }
}

TEST_CASE("a stored learner answers as the learner itself, and knows the cloths") {
  for (const Learner kind : stored_kinds()) {
    CAPTURE(to_string(kind));
    const StoredModel stored = trained(kind, View::ranked, true);
    std::size_t right = 0;
    for (const Trial& trial : cloths(3, 9)) {
      const auto said = classify(stored, trial);
      REQUIRE(said);
      CHECK(said->ballot.winner == *stored.learner.classify(*extract(trial, {})));
      right += stored.learner.labels()[said->ballot.winner] == trial.label ? 1 : 0;
    }
    CHECK(right >= 25);  // of 27
  }
}

TEST_CASE("a learner without cores refuses kinds of vote that are for cores") {
  const StoredModel stored = trained(Learner::lda);
  for (const VoteKind kind : {VoteKind::soft, VoteKind::dag, VoteKind::shortlist}) {
    const auto said = classify(stored, cloths(1, 1)[0], {.kind = kind});
    REQUIRE_FALSE(said);
    CHECK(to_string(said.error()).find("lda") != std::string::npos);
  }
}

// The file was written by the last program that knew version 3 only.
TEST_CASE("a file of version 3 is read, and stored as the version of today") {
  std::ifstream file(std::string(WEFT_SOURCE_DIR) + "/tests/golden/model/version_3.weft");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  REQUIRE(text.starts_with("weft-fabric-model 3\n"));
  const auto stored = loaded(text);
  REQUIRE(stored);
  CHECK(stored->learner.kind() == Learner::pvalue);
  CHECK(stored->learner.view().kind() == View::plain);
  REQUIRE(stored->aids);
  const std::string today = saved(*stored);
  CHECK(today.starts_with(model_file_header));
  const auto again = loaded(today);
  REQUIRE(again);
  const std::vector<double> features(stored->learner.feature_names().size(), 3.0);
  const auto a = answer(stored->learner, stored->aids, features);
  const auto b = answer(again->learner, again->aids, features);
  REQUIRE((a && b));
  CHECK(bits_of(*a) == bits_of(*b));
  CHECK_FALSE(loaded(replaced(text, "reduction pvalue", "reduction lda")));
}

// The file was written by the last program that knew version 4 only.
TEST_CASE("a file of version 4 with compressed features is read as such") {
  std::ifstream file(std::string(WEFT_SOURCE_DIR) + "/tests/golden/model/version_4.weft");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
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

// The file was written by the last program that knew version 5 only.
TEST_CASE("a file of version 5 with ranked features is read as such, and knows no trees") {
  std::ifstream file(std::string(WEFT_SOURCE_DIR) + "/tests/golden/model/version_5.weft");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  REQUIRE(text.starts_with("weft-fabric-model 5\n"));
  const auto stored = loaded(text);
  REQUIRE(stored);
  CHECK(stored->learner.kind() == Learner::svc);
  CHECK(stored->learner.view().kind() == View::ranked);
  const std::string today = saved(*stored);
  CHECK(text.substr(text.find('\n'), text.rfind("crc32 ") - text.find('\n')) ==
        today.substr(today.find('\n'), today.rfind("crc32 ") - today.find('\n')));
  const std::string trees = saved(trained(Learner::trees));
  CHECK(loaded(trees));
  CHECK_FALSE(loaded(replaced(trees, "weft-fabric-model 6", "weft-fabric-model 5")));
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

TEST_CASE("a model file cut short anywhere is refused") {
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
  CHECK(loaded(replaced(text, "weft-fabric-model 6", "weft-fabric-model 2")).error().code ==
        Errc::unsupported);
  CHECK(loaded("t_s,ch1\n0,1\n").error().code == Errc::parse);
  CHECK(loaded("").error().code == Errc::parse);
}

TEST_CASE("a wrong line behind a right checksum is refused with its number") {
  const std::string text = saved(trained(Learner::pvalue));
  const auto [from, to] = GENERATE(table<std::string, std::string>({
      {"taxels 3", "taxels 4"},
      {"taxels 3", "taxels 0"},
      {"taxels 3", "taxels many"},
      {"phases SPME", "phases MESP"},
      {"bench simulated", "bench reel"},
      {"labels 3", "labels 2"},
      {"labels 3", "labels 1"},
      {"labels 3", "labels 9999"},
      {"label cloth 1", "label cloth 0"},
      {"feature mean.P", "feature mean.Q"},
      {"column ", "column 9"},
      {"inputs ", "inputs 9"},
      {"bias ", "bias nan "},
      {"gamma ", "gamma inf\nx "},
      {"gamma ", "gamma -"},
      {"\ngamma ", "\ngamma 0\ngamma "},
      {"columns ", "columns 9"},
      {"mode_bin_counts ", "mode_bin_counts -"},
      {"support_vectors ", "support_vectors 9"},
      {"deviation ", "deviation -"},
      {"crc32 ", "more\ncrc32 "},
  }));
  CAPTURE(from, to);
  const auto stored = loaded(replaced(text, from, to));
  REQUIRE_FALSE(stored);
  CHECK(stored.error().code == Errc::corrupt);
  CHECK(stored.error().where.find("line ") != std::string::npos);
  CHECK_FALSE(stored.error().expected.empty());
  CHECK_FALSE(stored.error().got.empty());
}

TEST_CASE("a wrong line of a learner without cores is refused with its number") {
  const auto [kind, from, to] = GENERATE(table<Learner, std::string, std::string>({
      {Learner::lda, "learner lda", "learner best"},
      {Learner::lda, "learner lda", "learner svc"},
      {Learner::lda, "learner lda", "learner pvalue"},
      {Learner::lda, "view compressed", "view plain"},
      {Learner::lda, "view compressed", "view oblique"},
      {Learner::lda, "weight ", "weight nan "},
      {Learner::lda, "bias ", "bias 1 "},
      {Learner::lda, "deviation ", "deviation -"},
      {Learner::svc, "learner svc", "learner lda"},
      {Learner::svc, "gamma ", "gamma -"},
      {Learner::svc, "support_vectors 18", "support_vectors 17"},
      {Learner::svc, "support_vectors 18", "support_vectors 99999999"},
      {Learner::svc, "support_vectors 18", "support_vectors 0"},
      {Learner::svc, "machine ", "machine 9"},
      {Learner::svc, "rows ", "rows 9"},
      {Learner::svc, "coefficients ", "coefficients inf "},
  }));
  CAPTURE(from, to);
  const auto stored = loaded(replaced(saved(trained(kind, View::compressed)), from, to));
  REQUIRE_FALSE(stored);
  CHECK(stored.error().code == Errc::corrupt);
  CHECK(stored.error().where.find("line ") != std::string::npos);
  CHECK_FALSE(stored.error().expected.empty());
  CHECK_FALSE(stored.error().got.empty());
}

// Text with word `place` (from 0) of the first line that begins with `keyword`, from the line on
// that says how many trees there are.
std::string with_word(const std::string& text, const std::string& keyword, std::size_t place,
                      const std::string& word) {
  const std::size_t line = text.find("\n" + keyword + " ", text.find("\ntrees "));
  REQUIRE(line != std::string::npos);
  std::size_t from = line + 1 + keyword.size() + 1;
  for (; place > 0; --place) from = text.find(' ', from) + 1;
  std::string out = text;
  return sealed(out.replace(from, text.find_first_of(" \n", from) - from, word));
}

TEST_CASE("wrong trees behind a right checksum are refused, each for what is wrong") {
  const StoredModel model = trained(Learner::trees);
  const std::string text = saved(model);
  CHECK(with_word(text, "trees", 0, "1000") == text);
  const auto [keyword, word, says] = GENERATE(table<std::string, std::string, std::string>({
      {"trees", "0", "trees"},
      {"trees", "1001", "nodes"},
      {"child", "0", "leads nowhere"},
      {"child", "999", "leads nowhere"},
      {"child", "18446744073709551615", "leads nowhere"},
      {"feature", "9999", "beyond the last"},
      {"threshold", "nan", "threshold"},
      {"threshold", "inf", "threshold"},
  }));
  CAPTURE(keyword, word);
  const auto stored = loaded(with_word(text, keyword, 0, word));
  REQUIRE_FALSE(stored);
  CHECK(stored.error().code == Errc::corrupt);
  CHECK(stored.error().where.find("line ") != std::string::npos);
  CHECK(to_string(stored.error()).find(says) != std::string::npos);
}

TEST_CASE("shares of a leaf that are no distribution are refused") {
  LineWriter good;
  good.count("nodes", 1);
  good.counts("feature", std::vector<std::size_t>{0});
  good.counts("child", std::vector<std::size_t>{2});
  good.numbers("threshold", {});
  good.count("mixed_leaves", 1);
  const auto read_with = [&](const std::vector<double>& shares) {
    LineWriter out = good;
    out.numbers("shares", shares);
    const std::string text = out.str();
    LineReader in(text);
    DecisionTree::read(in, 1, 2);
    return in.status();
  };
  CHECK(read_with({0.25, 0.75}));
  for (const std::vector<double>& shares :
       std::vector<std::vector<double>>{{0.5, 0.6}, {-0.5, 1.5}, {1e308, 1e308}, {0.0, 0.0}}) {
    const Status refused = read_with(shares);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().message == "shares of a leaf are no distribution");
  }
}

TEST_CASE("a wrong line of the knots of ranks is refused with its number") {
  const auto [from, to] = GENERATE(table<std::string, std::string>({
      {"knots 18", "knots 0"},
      {"knots 18", "knots 17"},
      {"knots 18\nrow ", "knots 18\nrow 1e300 "},
      {"knots 18\nrow ", "knots 18\nrow nan "},
  }));
  const View view = GENERATE(View::ranked, View::normal_scores);
  CAPTURE(from, to, to_string(view));
  const std::string text = saved(trained(Learner::lda, view));
  const auto stored = loaded(replaced(text, from, to));
  REQUIRE_FALSE(stored);
  CHECK(stored.error().code == Errc::corrupt);
  CHECK(stored.error().where.find("line ") != std::string::npos);
  CHECK_FALSE(loaded(replaced(text, "view " + std::string(to_string(view)), "view compressed")));
}

TEST_CASE("knots that fall are refused") {
  const std::string text = saved(trained(Learner::lda, View::ranked));
  const std::size_t first = text.find("\nrow ") + 1;
  const std::size_t second = text.find("\nrow ", first) + 1;
  const std::string row = text.substr(first, second - first);
  std::string swapped = text;
  swapped.erase(first, row.size());
  swapped.insert(text.find("\nrow ", second) + 1 - row.size(), row);
  const auto stored = loaded(sealed(swapped));
  REQUIRE_FALSE(stored);
  CHECK(to_string(stored.error()).find("fall") != std::string::npos);
}

TEST_CASE("a trial of another sensor or with other phases is refused by name") {
  const StoredModel stored = trained(Learner::pvalue);
  Trial fewer_phases = cloths(1, 1)[0];
  for (Phase& phase : fewer_phases.phase)
    if (phase == Phase::end) phase = Phase::none;
  const auto phases = classify(stored, fewer_phases);
  REQUIRE_FALSE(phases);
  CHECK(to_string(phases.error()).find("expected SPME, got SPM") != std::string::npos);
  Trial other_sensor = testing::motion_trial({{1, 2}, {3, 4}});
  CHECK(to_string(classify(stored, other_sensor).error()).find("expected 3 taxels, got 2") !=
        std::string::npos);
}

TEST_CASE("a model whose features are not those of its setup is not written") {
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
