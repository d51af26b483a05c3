// The headline of the audit in the three forms of a report.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "tests/unit/daemon/analysis/report_fixture.hpp"

namespace audit_headline_test {

using namespace weft::daemon;
using nlohmann::json;

namespace {

AuditHeadline confounded() {
  return {
      "M1", "confounded", "", "", StrongestProbe{"pad pattern", 0.75, 0.5, 0.02, 1.0, 0.5, true},
      99};
}

AuditHeadline unmade() {
  return {"M2", "cannot_tell", "one_recording", "each label has one recording"};
}

}  // namespace

TEST_CASE("report.json has each exploration's verdict and probe, and the worst verdict of all") {
  ReportInput input = report_test::campaign().input();
  CHECK(json::parse(report_test::report_json(input))["audit"].is_null());
  input.audit = {unmade(), confounded()};
  const json audit = json::parse(report_test::report_json(input))["audit"];
  CHECK(audit["verdict"] == "confounded");
  CHECK(audit["bench"] == "simulated");
  CHECK(audit["quick"] == true);
  const json& first = audit["explorations"]["M1"];
  CHECK(first["verdict"] == "confounded");
  CHECK(first["why"].is_null());
  CHECK(first["permutations"] == 99);
  CHECK(first["probe"] == json{{"name", "pad pattern"},
                               {"accuracy", 0.75},
                               {"full_accuracy", 1.0},
                               {"chance", 0.5},
                               {"share", 0.5},
                               {"p", 0.02},
                               {"named", true}});
  const json& second = audit["explorations"]["M2"];
  CHECK(second["why"] == "one_recording");
  CHECK(second["probe"].is_null());
  CHECK(second["reason"] == "each label has one recording");
}

TEST_CASE("page and terminal have the probe's figure beside the full features' and chance") {
  ReportInput input = report_test::campaign().input();
  const std::string sentence =
      "Accuracy from pad pattern alone 75.0 %, from all features 100.0 %, by chance 50.0 % "
      "(SIMULATED).";
  CHECK(format_headline(confounded(), BenchKind::simulated).ends_with(sentence));
  CHECK(format_headline(confounded(), BenchKind::real).find("SIMULATED") == std::string::npos);
  const std::string before = report_test::report_html(input);
  CHECK(before.find("75.0 %, from all") == std::string::npos);
  input.audit = {confounded()};
  CHECK(report_test::report_html(input).find(sentence) != std::string::npos);
  CHECK(summary_text(input).find("confounded") != std::string::npos);
}

TEST_CASE("of several verdicts the one that weighs most counts; none is none") {
  const AuditHeadline clean{"M1", "no_sign", "", ""}, failed{"M1", "", "", "too few"};
  CHECK(overall_verdict(std::vector{clean, unmade()}) == "cannot_tell");
  CHECK(overall_verdict(std::vector{clean, failed}) == "no_sign");
  CHECK(overall_verdict(std::vector{failed}).empty());
  CHECK(quick_form_note(std::vector{failed}).empty());
}

}  // namespace audit_headline_test
