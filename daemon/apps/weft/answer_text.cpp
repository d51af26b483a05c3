#include "daemon/apps/weft/answer_text.hpp"

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>

#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

using Labels = std::vector<std::string>;

template <class Number>
json by_label(const Labels& labels, const std::vector<Number>& of_class) {
  json out;
  for (std::size_t k = 0; k < labels.size(); ++k) out[labels[k]] = of_class[k];
  return out;
}

constexpr std::size_t most_named = 10;  // of hundreds of fabrics nobody reads the last

// The winner first, then the others that got votes, most votes first; nothing without votes.
std::string votes_text(const Labels& labels, const classifier::Ballot& ballot) {
  if (ballot.votes.empty()) return {};
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < labels.size(); ++k)
    if (k != ballot.winner && ballot.votes[k] > 0) order.push_back(k);
  std::ranges::stable_sort(order, std::greater<>(), [&](auto k) { return ballot.votes[k]; });
  order.insert(order.begin(), ballot.winner);
  std::string out = "  (votes:";
  for (std::size_t i = 0; i < std::min(order.size(), most_named); ++i)
    out += " " + labels[order[i]] + " " + std::to_string(ballot.votes[order[i]]);
  if (order.size() > most_named)
    out += ", " + std::to_string(order.size() - most_named) + " more fabrics";
  return out + ")";
}

}  // namespace

std::string trained_banner(const classifier::Provenance& provenance) {
  return provenance.bench == "simulated" ? "The model was trained on SIMULATED data.\n" : "";
}

json answers_json(const classifier::TrainedLearner& learner, bool has_postprocessing,
                  const std::vector<PredictedTrial>& answered) {
  const Labels& labels = learner.labels();
  json out = json::array();
  for (const PredictedTrial& a : answered) {
    const classifier::Ballot& ballot = a.answer.ballot;
    json one{{"file", a.file}, {"label", labels[ballot.winner]}};
    if (!ballot.votes.empty()) one["votes"] = by_label(labels, ballot.votes);
    if (learner.cores() != nullptr) one["cores_asked"] = ballot.cores;
    if (!a.answer.probability.empty()) one["probability"] = by_label(labels, a.answer.probability);
    if (has_postprocessing) one["none_of_these"] = a.answer.none_of_these;
    if (!a.true_label.empty()) one["true_label"] = a.true_label;
    out.push_back(std::move(one));
  }
  return out;
}

std::string answer_line(const classifier::TrainedLearner& learner, const PredictedTrial& answered) {
  const classifier::Ballot& ballot = answered.answer.ballot;
  const Labels& labels = learner.labels();
  std::string out = answered.file + ": " + labels[ballot.winner];
  if (!answered.answer.probability.empty())
    out += " " + percent(answered.answer.probability[ballot.winner], 0) + " %";
  if (answered.answer.none_of_these) out += ", or none of these";
  return out + votes_text(labels, ballot) + "\n";
}

using recipes::Cleanup;
using recipes::RigFact;

std::string format_rig(Cleanup cleanup, RigFact rig) {
  const std::string cleanup_text =
      "; look at the bench before anything moves, and lift the probe by hand if a stage is dead: "
      "the next run homes z, upwards, before all else";
  // What is done finally begins only where the probe is up.
  if (cleanup == Cleanup::partial)
    return rig == RigFact::safe
               ? "the probe is up, but what the recipe does finally was not done to its end"
               : "the probe was up, but what the recipe does finally failed: where the stages "
                 "stand "
                 "is not known; look at the bench before anything moves";
  if (rig == RigFact::safe) return {};
  if (rig == RigFact::holding)
    return "the probe was not lifted: the stages stand where they were, and it may bear on the "
           "cloth" +
           cleanup_text;
  return "the probe was not lifted, as far as is known: the rig is " +
         std::string(recipes::to_string(rig)) + ", and the probe may still bear on the cloth" +
         cleanup_text;
}

}  // namespace weft::daemon::cli
