// Error messages of the parser of a model file for a wrong line before a correct checksum.

#include <catch2/catch.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "classifier/base/line_io.hpp"
#include "classifier/learners/decision_tree.hpp"
#include "classifier/learners/learner_text.hpp"
#include "classifier/model/stored_model.hpp"
#include "tests/unit/classifier/stored_model.hpp"

namespace weft::classifier::model_file_lines_test {
namespace {

using namespace testing;

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

// Text with word `place` (from 0) of the first line that begins with `keyword` replaced, after the
// line with the number of trees.
std::string with_token(const std::string& text, const std::string& keyword, std::size_t place,
                       const std::string& word) {
  const std::size_t line = text.find("\n" + keyword + " ", text.find("\ntrees "));
  REQUIRE(line != std::string::npos);
  std::size_t from = line + 1 + keyword.size() + 1;
  for (; place > 0; --place) from = text.find(' ', from) + 1;
  std::string out = text;
  return with_checksum(out.replace(from, text.find_first_of(" \n", from) - from, word));
}

TEST_CASE("wrong trees before a correct checksum are refused, each with its fault") {
  const StoredModel model = trained(Learner::trees);
  const std::string text = saved(model);
  CHECK(with_token(text, "trees", 0, "1000") == text);
  const auto [keyword, word, part] = GENERATE(table<std::string, std::string, std::string>({
      {"trees", "0", "trees"},
      {"trees", "1001", "nodes"},
      {"nodes", "0", "nodes"},
      {"nodes", "99999999999", "nodes"},
      {"child", "0", "child"},
      {"child", "999", "child"},
      {"child", "18446744073709551615", "child"},
      {"feature", "9999", "feature"},
      {"threshold", "nan", "threshold"},
      {"threshold", "inf", "threshold"},
  }));
  CAPTURE(keyword, word);
  const auto stored = loaded(with_token(text, keyword, 0, word));
  REQUIRE_FALSE(stored);
  CHECK(stored.error().code == Errc::corrupt);
  CHECK(stored.error().where.find("line ") != std::string::npos);
  CHECK_FALSE(stored.error().expected.empty());
  CHECK_FALSE(stored.error().got.empty());
  CHECK(to_string(stored.error()).find(part) != std::string::npos);
}

// A root on one feature, a leaf of class 0, a leaf of shares; line 3 has their links.
struct TreeLines {
  std::vector<std::size_t> child{1, 0, 2};
  std::size_t mixed = 1;
  std::vector<double> shares{0.25, 0.75};

  [[nodiscard]] Status read() const {
    LineWriter out;
    out.count("nodes", child.size());
    out.counts("feature", std::vector<std::size_t>{1, 0, 0});
    out.counts("child", child);
    out.numbers("threshold", std::vector{0.5});
    out.count("mixed_leaves", mixed);
    out.numbers("shares", shares);
    LineReader in(out.str());
    DecisionTree::read(in, 1, 2);
    return in.status();
  }
};

TEST_CASE("a wrong child or class of a node is refused at its line, with the value") {
  CHECK(TreeLines{}.read());
  const auto [lines, where, part, expected, got] =
      GENERATE(table<TreeLines, std::string, std::string, std::string, std::string>({
          {{.child = {0, 0, 2}}, "line 3", "node 0", "two later nodes of 3", "0"},
          {{.child = {2, 0, 2}}, "line 3", "node 0", "two later nodes of 3", "2"},
          {{.child = {1, 0, 3}}, "line 5", "leaf 2", "less than 3", "3"},
          {{.child = {1, 0, 2}, .mixed = 0, .shares = {}}, "line 5", "leaf 2", "less than 2", "2"},
          {{.mixed = 3, .shares = std::vector(6, 0.5)}, "line 5", "mixed_leaves", "0 to 2", "3"},
          {{.shares = {1.0}}, "line 6", "shares", "2", "1"},
          {{.shares = {0.2, 0.3, 0.5}}, "line 6", "shares", "2", "3"},
      }));
  const Status refused = lines.read();
  REQUIRE_FALSE(refused);
  CHECK(refused.error().where == where);
  CHECK(refused.error().what.find(part) != std::string::npos);
  CHECK(refused.error().expected == expected);
  CHECK(refused.error().got == got);
}

TEST_CASE("shares of a leaf that are not a distribution are refused") {
  const auto [shares, got] = GENERATE(table<std::vector<double>, std::string>({
      {{0.5, 0.6}, "least 0.5, sum 1 and 0.1"},
      {{0.5, 0.5 + 1e-8}, "least 0.5, sum 1 and 1e-08"},
      {{-0.5, 1.5}, "least -0.5, sum 1 and 0"},
      {{1e308, 1e308}, "least 1e+308, sum 1 and inf"},
      {{0.0, 0.0}, "least 0, sum 1 and -1"},
  }));
  const Status refused = TreeLines{.shares = shares}.read();
  REQUIRE_FALSE(refused);
  CHECK(refused.error().where == "line 6");
  CHECK(refused.error().got == got);
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

TEST_CASE("knots that are not ascending are refused") {
  const std::string text = saved(trained(Learner::lda, View::ranked));
  const std::size_t first = text.find("\nrow ") + 1;
  const std::size_t second = text.find("\nrow ", first) + 1;
  const std::string row = text.substr(first, second - first);
  std::string swapped = text;
  swapped.erase(first, row.size());
  swapped.insert(text.find("\nrow ", second) + 1 - row.size(), row);
  const auto stored = loaded(with_checksum(swapped));
  REQUIRE_FALSE(stored);
  CHECK(stored.error().code == Errc::corrupt);
  CHECK(stored.error().got == "knot 1");
}

TEST_CASE("a training task reads back as it was written") {
  using Folds = std::vector<std::optional<std::size_t>>;
  std::set<std::string> texts;
  for (const Reduction reduction : {Reduction::pvalue, Reduction::pca, Reduction::all})
    for (const View view : tried_views())
      for (const auto& fold : Folds{std::nullopt, 0, 1, 2, 24, 1000}) {
        const std::string text = task_text({reduction, view, fold});
        CAPTURE(text);
        texts.insert(text);
        const auto task = task_from_text(text);
        REQUIRE(task);
        CHECK(task->reduction == reduction);
        CHECK(task->view == view);
        CHECK(task->fold == fold);
      }
  CHECK(texts.size() == 3 * tried_views().size() * 6);
}

TEST_CASE("an unreadable training task is refused") {
  const std::string text = task_text({Reduction::all, View::normal_scores, 3});
  const auto [from, to] = GENERATE(table<std::string, std::string>({
      {"reduction all", "reduction some"},
      {"reduction all\n", ""},
      {"view normal-scores", "view oblique"},
      {"folds 1", "folds 2"},
      {"folds 1", "folds 0"},
      {"fold 3", "fold -1"},
      {"fold 3\n", ""},
      {"fold 3\n", "fold 3\nfold 3\n"},
  }));
  CAPTURE(from, to);
  std::string altered = text;
  altered.replace(text.find(from), from.size(), to);
  const auto task = task_from_text(altered);
  REQUIRE_FALSE(task);
  CHECK(task.error().code == Errc::corrupt);
  CHECK(task.error().where.find("line ") != std::string::npos);
}

}  // namespace
}  // namespace weft::classifier::model_file_lines_test
