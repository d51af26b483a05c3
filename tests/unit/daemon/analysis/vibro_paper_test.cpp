// The paper of 2023 beside made-up results: its averages and gains, and the conditions for showing
// them.

#include <catch2/catch.hpp>

#include <nlohmann/json.hpp>

#include "daemon/analysis/tradeoff/vibro_paper.hpp"

namespace weft::daemon::vibro_paper_test {
namespace {

namespace vibro = classifier::vibro;
using vibro::Family;
using vibro::Protocol;

// Every learner has the paper's average accuracy; windows of 2 s are slower by a half, and parts
// have half the F-score.
VibroTradeoff made_up(bool papers_recipe) {
  VibroTradeoff out;
  out.papers_recipe = papers_recipe;
  for (const char* source : {"S", "SXYZ"})
    for (const double window_s : {1.0, 2.0})
      for (const Family family : {Family::smmrp, Family::fft, Family::smmrpfft})
        for (const Protocol protocol : {Protocol::random, Protocol::blocks}) {
          double more = 0.0;
          for (const classifier::Learner learner : papers_learners()) {
            VibroPoint p{learner,        family,   window_s,
                         source,         protocol, {classifier::Confusion({"a"})},
                         1e-3 * window_s};
            p.result.f_score = (protocol == Protocol::random ? 0.8 : 0.4) + (window_s - 1) * 0.1;
            p.result.accuracy = p.result.f_score + 0.001 * more++;
            p.result.explained = family == Family::smmrp ? 0.9 : 0.97;
            p.result.answer_s = 1e-3;
            out.points.push_back(p);
          }
        }
  return out;
}

const VibroAverage& find(const std::vector<VibroAverage>& all, const std::string& source,
                         double window_s, Family family, Protocol protocol) {
  return *std::ranges::find_if(all, [&](const VibroAverage& a) {
    return a.source == source && a.window_s == window_s && a.family == family &&
           a.protocol == protocol;
  });
}

TEST_CASE("Averages are means over the paper's ten of each source, window, set and protocol") {
  const auto averages = compute_averages(made_up(true));
  REQUIRE(averages.size() == 2 * 2 * 3 * 2);
  const VibroAverage& a = find(averages, "S", 2.0, Family::smmrp, Protocol::random);
  CHECK(a.learners == 10);
  CHECK(a.f_score == Approx(0.9));
  CHECK(a.accuracy == Approx(0.9045));  // 0.9 to 0.909
  CHECK(a.explained == Approx(0.9));
  CHECK(a.answer_s == Approx(3e-3));
  CHECK(a.classify_s == Approx(1e-3));
  VibroTradeoff two = made_up(true);
  std::erase_if(two.points, [](const VibroPoint& p) {
    return p.learner != classifier::Learner::nb && p.learner != classifier::Learner::knn;
  });
  two.points.push_back(two.points.back());
  two.points.back().learner = classifier::Learner::lda;  // not a learner of the paper
  two.points.back().result.f_score = 0.0;
  two.points.push_back(two.points.front());
  two.points.back().window_s = 0.5;  // not a window length of the paper
  const auto few = compute_averages(two);
  CHECK(few.back().learners == 2);
  CHECK(few.back().f_score == Approx(0.5));
}

TEST_CASE("Gains are shares of what windows of 1 s reach, over all learners and sets") {
  const VibroTradeoff tradeoff = made_up(true);
  const auto gains = compute_gains(tradeoff, compute_averages(tradeoff));
  REQUIRE(gains.size() == 4);
  for (const VibroGain& g : gains) {
    CHECK(g.f_score == Approx(g.protocol == Protocol::random ? 0.125 : 0.25));
    CHECK(g.f_score_points == Approx(0.1));
    CHECK(g.answer_s == Approx(0.5));
    CHECK(g.classify_s == Approx(0.0).margin(1e-12));
    CHECK(g.is_papers == (g.source == "SXYZ" && g.protocol == Protocol::random));
  }
  // Without one of its learners the average is not the paper's.
  VibroTradeoff nine = made_up(true);
  std::erase_if(nine.points,
                [](const VibroPoint& p) { return p.learner == classifier::Learner::xgb; });
  for (const VibroGain& g : compute_gains(nine, compute_averages(nine))) CHECK_FALSE(g.is_papers);
  // Windows of one length have no gain, and neither have different sets of features.
  VibroTradeoff one = made_up(true);
  std::erase_if(one.points,
                [](const VibroPoint& p) { return p.window_s == 2.0 && p.family == Family::fft; });
  CHECK(compute_gains(one, compute_averages(one)).empty());
}

TEST_CASE("The paper's figures stand only beside its own recipe") {
  for (const bool papers : {true, false}) {
    const VibroTradeoff tradeoff = made_up(papers);
    const auto random = averages_json(tradeoff, Protocol::random);
    const auto blocks = averages_json(tradeoff, Protocol::blocks);
    CHECK(random["papers_recipe"] == papers);
    CHECK(blocks["papers_recipe"] == false);
    REQUIRE(random["averages"].size() == 12);
    std::size_t with_explained = 0, with_average = 0;
    for (const auto& a : random["averages"]) {
      if (a["paper"].is_null()) continue;
      CHECK(a["source"] == "SXYZ");
      with_average += a["paper"]["f_score"].is_null() ? 0 : 1;
      with_explained += a["paper"]["explained"].is_null() ? 0 : 1;
    }
    CHECK(with_average == (papers ? 4 : 0));
    CHECK(with_explained == (papers ? 3 : 0));
    for (const auto& a : blocks["averages"]) CHECK(a["paper"].is_null());
    CHECK(random["gains"].back()["paper"].is_null() == !papers);
    if (papers) CHECK(random["gains"].back()["paper"]["time"] == papers_time_gain);
    const std::string shown = render(vibro_tables(tradeoff, ""));
    for (const char* figure : {"0.984", "3.59", "4.69 ms"})
      CHECK((shown.find(figure) != std::string::npos) == papers);
  }
}

TEST_CASE("Its table gives the averages that it prints, and the variance of three components") {
  for (const PapersRow& row : papers_table_1()) {
    double sum = 0.0;
    REQUIRE(row.f_score.size() == papers_table_learners().size());
    for (const double f : row.f_score) sum += f;
    CHECK(sum / static_cast<double>(row.f_score.size()) == Approx(row.average).margin(0.005));
  }
  CHECK(papers_explained(Family::fft, 2.0) == 0.97);
  CHECK_FALSE(papers_explained(Family::fft, 1.0));
  CHECK_FALSE(papers_explained(Family::wide, 2.0));
}

TEST_CASE("The paper's recipe is its windows, its split, its components and its channels") {
  std::vector<vibro::Recording> recordings(4);
  for (std::size_t r = 0; r < 4; ++r) {
    recordings[r].label = r < 2 ? "a" : "b";
    recordings[r].channels = {{"S", 8000, "1"}, {"X", 200, "1"}, {"Y", 200, "1"}, {"Z", 200, "1"}};
  }
  vibro::ProtocolOptions protocol;
  protocol.protocol = Protocol::random;
  protocol.per_recording = 50;  // two recordings of a texture
  CHECK(is_papers_recipe(recordings, protocol, vibro::Combine::mean, 3));
  CHECK_FALSE(is_papers_recipe(recordings, protocol, vibro::Combine::concat, 3));
  CHECK_FALSE(is_papers_recipe(recordings, protocol, vibro::Combine::mean, 0));
  vibro::ProtocolOptions other = protocol;
  other.protocol = Protocol::blocks;
  CHECK_FALSE(is_papers_recipe(recordings, other, vibro::Combine::mean, 3));
  other = protocol;
  other.per_recording = 100;
  CHECK_FALSE(is_papers_recipe(recordings, other, vibro::Combine::mean, 3));
  recordings[1].channels.pop_back();
  CHECK_FALSE(is_papers_recipe(recordings, protocol, vibro::Combine::mean, 3));
}

}  // namespace
}  // namespace weft::daemon::vibro_paper_test
