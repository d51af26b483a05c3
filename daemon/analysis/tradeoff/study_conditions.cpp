#include "daemon/analysis/tradeoff/measure_classifier.hpp"
#include "protocols/base/closest.hpp"

#include <algorithm>
#include <array>
#include <set>

#include "classifier/features/layout.hpp"
#include "daemon/base/text/format.hpp"
#include "recipes/schema/diagnostic.hpp"

namespace weft::daemon {
namespace {

using classifier::Learner;
using classifier::VoteKind;

constexpr std::array<std::string_view, 7> family_names = {
    "features", "learner", "slide", "speed", "exploration", "vote", "stop"};  // in the order of
                                                                              // TradeoffFamily
constexpr std::size_t family_count = static_cast<std::size_t>(TradeoffFamily::stop) + 1;
static_assert(family_names.size() == family_count);

constexpr std::array<std::size_t, 7> feature_counts = {1, 2, 5, 10, 20, 40, 80};
constexpr std::array slides_s = {0.5, 1.0, 2.0, 4.0, 8.0, 16.0};
constexpr std::array<std::size_t, 4> shortlists = {2, 3, 5, 10};
constexpr std::array sure_at = {0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 0.999};
constexpr std::array learners = {std::pair{Learner::pvalue, "p-value cores"},
                                 std::pair{Learner::pca, "PCA cores"},
                                 std::pair{Learner::all, "all-feature cores"},
                                 std::pair{Learner::lda, "LDA"},
                                 std::pair{Learner::svc, "SVC"},
                                 std::pair{Learner::trees, "trees"},
                                 std::pair{Learner::best, "best of all"}};

bool has_count(Learner learner) {
  return learner == Learner::pvalue || learner == Learner::pca;
}

bool votes(Learner learner) {
  return has_count(learner) || learner == Learner::all || learner == Learner::cores_best;
}

std::string why_not(Learner learner, const std::string& reason) {
  const bool choice = learner == Learner::best || learner == Learner::cores_best;
  return choice ? "a choice of learners differs by split" : reason;
}

/// Adds the choices of one family after another. Each function returns the reason if there are
/// none, or an empty text.
class Planner {
 public:
  Planner(const Dataset& dataset, const Material& base, std::size_t labels, StudyCondition standard)
      : dataset_(&dataset), base_(&base), labels_(labels), standard_(std::move(standard)) {
    out_.arms.push_back(standard_);
  }

  void add(TradeoffFamily family) {
    const std::size_t before = out_.arms.size();
    family_ = to_string(family);
    constexpr std::array adders{&Planner::add_counts,       &Planner::add_learners,
                                &Planner::add_slides,       &Planner::add_speeds,
                                &Planner::add_explorations, &Planner::add_votes,
                                &Planner::add_stops};  // in the order of TradeoffFamily
    static_assert(adders.size() == family_count);
    const std::string why = (this->*adders.at(static_cast<std::size_t>(family)))();
    if (out_.arms.size() == before) out_.left_out.emplace_back(family_, why);
  }
  TradeoffPlan take() { return std::move(out_); }

 private:
  StudyCondition& add(std::string name) {
    out_.arms.push_back(standard_);
    out_.arms.back().name = std::move(name);
    out_.arms.back().family = family_;
    return out_.arms.back();
  }

  std::string add_counts() {
    if (!has_count(standard_.learner))
      return why_not(standard_.learner, "default learner without feature count");
    const std::size_t all = base_->features.names.size();
    std::set<std::size_t> counts{all};
    for (const std::size_t n : feature_counts)
      if (n < all) counts.insert(n);
    counts.erase(std::min(standard_.cap, all));
    for (const std::size_t n : counts) add("N " + std::to_string(n)).cap = n;
    return "only one feature";
  }

  std::string add_learners() {
    for (const auto& [learner, name] : learners)
      if (learner != standard_.learner) add(name).learner = learner;
    return {};
  }

  std::string add_slides() {
    for (const double s : slides_s)
      if (s < base_->longest_slide_s) add(general(s) + " s").slide_s = s;
    return "no slide longer than " + general(slides_s.front()) + " s";
  }

  std::string add_speeds() {
    std::set<double> speeds;
    for (const auto& speed : base_->speed_mm_s)
      if (speed) speeds.insert(*speed);
    if (speeds.empty()) return "speeds not recorded";
    if (speeds.size() == 1) return "only one speed recorded";
    for (const double speed : speeds) add(general(speed) + " mm/s").speed_mm_s = speed;
    return {};
  }

  std::string add_explorations() {
    const auto present = list_explorations(*dataset_);
    for (const std::string& name : present)
      if (name != standard_.exploration) add(name).exploration = name;
    for (std::size_t a = 0; a < present.size(); ++a)
      for (std::size_t b = a + 1; b < present.size(); ++b) {
        const std::string both = present[a] + "+" + present[b];
        if (both != standard_.exploration) add(both).exploration = both;
      }
    return "only one exploration in the data set";
  }

  std::string add_votes() {
    if (!votes(standard_.learner))
      return why_not(standard_.learner, "default learner without voting cores");
    if (labels_ < 3) return "only one core for two labels";
    add("soft vote").vote.kind = VoteKind::soft;
    add("DAG").vote.kind = VoteKind::dag;
    for (const std::size_t k : shortlists)
      if (k < labels_) add("short-list of " + std::to_string(k)).vote = {VoteKind::shortlist, k};
    return {};
  }

  std::string add_stops() {
    if (standard_.exploration.find('+') != std::string::npos)
      return "combined explorations have no common time";
    if (base_->longest_slide_s <= 2 * least_slide_s) return "no slide longer than 1 s";
    for (const double sure : sure_at) add("sure " + general(sure)).sure = sure;
    return {};
  }

  const Dataset* dataset_;
  const Material* base_;
  std::size_t labels_;
  StudyCondition standard_;
  std::string family_;
  TradeoffPlan out_;
};

}  // namespace

std::string_view to_string(TradeoffFamily family) {
  return family_names.at(static_cast<std::size_t>(family));
}

Result<TradeoffFamily> tradeoff_family_from(std::string_view word) {
  for (const TradeoffFamily family : all_tradeoff_families())
    if (to_string(family) == word) return family;
  return fail({.code = Errc::invalid_argument,
               .what = "unknown factor to vary",
               .expected = joined(family_names),
               .got = std::string(word),
               .hint = did_you_mean(word, std::vector(family_names.begin(), family_names.end()))});
}

std::vector<TradeoffFamily> all_tradeoff_families() {
  std::vector<TradeoffFamily> out;
  for (std::size_t i = 0; i < family_names.size(); ++i)
    out.push_back(static_cast<TradeoffFamily>(i));
  return out;
}

TradeoffPlan plan_tradeoff(const Dataset& dataset, const Material& base, std::size_t labels,
                           const std::string& exploration,
                           const ClassifierTradeoffOptions& options) {
  StudyCondition standard;
  standard.name = standard.family = "default";
  standard.exploration = exploration;
  standard.learner = options.learner;
  standard.cap = options.training.cap;
  Planner planner(dataset, base, labels, std::move(standard));
  for (const TradeoffFamily family : all_tradeoff_families())
    if (std::ranges::find(options.vary, family) != options.vary.end()) planner.add(family);
  return planner.take();
}

std::vector<Setting> list_settings(const StudyCondition& arm,
                                   const ClassifierTradeoffOptions& options) {
  std::vector<Setting> out{{"learner", std::string(classifier::to_string(arm.learner))}};
  if (has_count(arm.learner)) out.emplace_back("N", static_cast<double>(arm.cap));
  if (votes(arm.learner))
    out.emplace_back("vote", std::string(classifier::to_string(arm.vote.kind)));
  if (arm.vote.kind == VoteKind::shortlist)
    out.emplace_back("shortlist", static_cast<double>(arm.vote.shortlist));
  if (arm.sure) {
    out.emplace_back("sure_probability", *arm.sure);
    out.emplace_back("least_slide_s", least_slide_s);
  }
  if (arm.slide_s > 0)
    out.emplace_back("slide_s", arm.slide_s);
  else
    out.emplace_back("slide_s", std::string("whole"));
  if (!arm.exploration.empty()) out.emplace_back("exploration", arm.exploration);
  if (arm.speed_mm_s) out.emplace_back("tested_speed_mm_s", *arm.speed_mm_s);
  out.emplace_back("norm",
                   std::string(options.features.norm == classifier::Norm::rms ? "rms" : "l2"));
  return out;
}

}  // namespace weft::daemon
