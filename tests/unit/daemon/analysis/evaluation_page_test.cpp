// The page of `weft evaluate`.

#include "daemon/analysis/report/evaluation_page.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <string>

#include "tests/unit/classifier/support.hpp"

namespace weft::daemon::evaluation_page_test {
namespace {

using classifier::Learner;

std::vector<EvaluatedLearner> learners(const std::string& first_name) {
  const auto data = classifier::testing::gaussian_classes(3, 10, 4, 2.0, 1);
  const auto splits = classifier::stratified_splits(data.labels, 0.5, 2, 1);
  REQUIRE(splits);
  std::vector<EvaluatedLearner> out;
  for (const Learner learner : {Learner::pvalue, Learner::lda}) {
    auto evaluation = classifier::evaluate(data, *splits, learner, {}, {}, true);
    REQUIRE(evaluation);
    out.push_back({out.empty() ? first_name : "lda", std::move(*evaluation), ""});
  }
  return out;
}

std::string page_of(BenchKind bench, const std::string& name) {
  const std::vector<EvaluatedLearner> list = learners(name);
  const std::vector<GroupLeftOut> groups = {{"group <A>", 12, {0.5, 0.75}}};
  const std::vector<CurvePoint> curve = {{2, 4, {{name, 0.5, 0.1, {}}, {"lda", 0.6, 0.1, {}}}},
                                         {4, 4, {{name, 0.7, 0.1, {}}, {"lda", 0.8, 0.1, {}}}}};
  return render(
      evaluation_document({bench, "set.h5", {{"data", "a & b"}}, 1e-4, list, groups, curve}));
}

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
    ++count;
  return count;
}

TEST_CASE("every figure of an evaluation's page names its bench") {
  const std::string page = page_of(BenchKind::simulated, "pvalue");
  const std::size_t figures = count_of(page, "<figure");
  // accuracy, groups, curve, reliability of all and its tables, cores, timing, 2 confusions
  CHECK(figures == 9);
  for (std::size_t at = page.find("<table"); at != std::string::npos;
       at = page.find("<table", at + 1))
    CHECK(page.rfind("<figure", at) + 1 > page.rfind("</figure>", at) + 1);  // npos + 1 is 0
  CHECK(count_of(page, "<figcaption><span class=\"badge\">SIMULATED</span>") == figures);
  const std::string real = page_of(BenchKind::real, "pvalue");
  CHECK(count_of(real, "SIMULATED") == 0);
  CHECK(count_of(real, "<figcaption><span class=\"badge\">REAL BENCH</span>") == figures);
}

TEST_CASE("names on an evaluation's page cannot inject markup, and no number is nan") {
  const std::string page = page_of(BenchKind::unknown, "<script>alert(1)</script>");
  CHECK(page.find("<script") == std::string::npos);
  CHECK(page.find("group &lt;A&gt;") != std::string::npos);
  CHECK(page.find("a &amp; b") != std::string::npos);
  CHECK(page.find("nan") == std::string::npos);
}

TEST_CASE("rows of a reliability leave empty bins out and hold every answer") {
  classifier::CalibrationCheck check;
  check.reliability.bins = {{0.0, 0.5, 0, 0.0, 0.0}, {0.5, 1.0, 8, 0.9, 0.75}};
  check.bins = {{0, {0, 1, "nothing"}}, {4, {0.409, 0.929, "made up"}}};
  const auto rows = reliability_rows(check);
  REQUIRE(rows.size() == 2);
  CHECK(rows[0][2] == "recordings");
  CHECK(rows[1] ==
        std::vector<std::string>{"0.5 to 1.0", "8", "4", "0.900", "0.750", "0.409 to 0.929"});
  CHECK(bin_methods(check) == "made up");
}

TEST_CASE("each learner of a learning curve has its own line and name") {
  CurvePoint few{2, 4, {}}, many{8, 4, {}};
  const std::vector<std::string> names = {"pvalue", "pca", "all", "lda", "svc", "trees", "best"};
  for (const std::string& name : names) {
    few.values.push_back({name, 0.6, 0.1, {}});
    many.values.push_back({name, 0.99, 0.005, {}});  // all at the upper edge
  }
  const std::string figure = chart::draw(learning_curve({few, many}));
  for (const std::string& name : names) CHECK(count_of(figure, ">" + name + "</text>") == 1);
  for (std::size_t k = 0; k < names.size(); ++k)
    CHECK(count_of(figure, "<path class=\"curve family-" + std::to_string(k) + "\"") == 1);
}

}  // namespace
}  // namespace weft::daemon::evaluation_page_test
