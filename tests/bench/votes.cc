// Kinds of vote, calibration and unknown fabrics: on the demo campaign (simulated), on growing
// numbers of made-up fabrics, and on recordings of real fabrics if they exist.

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "classifier/evaluate/calibration_check.hpp"
#include "classifier/evaluate/splits.hpp"
#include "classifier/features/trial.hpp"
#include "classifier/learners/learner.hpp"
#include "classifier/vote/postprocessing.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/dataset/import.hpp"
#include "tests/bench/classifier_set.hpp"
#include "tests/bench/figures.hpp"
#include "tests/bench/measure_reject.hpp"
#include "tests/bench/vote_costs.hpp"

namespace {

using namespace weft;
using namespace weft::classifier;
using bench::Figure;

const std::filesystem::path campaign = "out/demo/dataset.h5";
const std::filesystem::path fabricslide = "../shared/data/fabricslide";

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Set {
  std::string name;
  FeatureMatrix train, test;
};

std::optional<Set> set_of(std::string name, const Result<FeatureMatrix>& all,
                          const Result<Split>& split) {
  if (all && split)
    return Set{std::move(name), select_rows(*all, split->train), select_rows(*all, split->test)};
  std::printf("%s left out: %s\n", name.c_str(),
              to_string(all ? split.error() : all.error()).c_str());
  return std::nullopt;
}

Result<Split> random_split(const FeatureMatrix& all, double fraction) {
  auto splits = stratified_splits(all.labels, fraction, 1, 1);
  if (!splits) return pass(splits.error());
  return std::move(splits->front());
}

std::optional<Set> simulated_set() {
  const auto dataset = daemon::read_hdf5(campaign);
  if (!dataset) {
    std::printf("no simulated campaign (script/demo): %s\n", to_string(dataset.error()).c_str());
    return std::nullopt;
  }
  const auto all = build_feature_matrix(daemon::complete_trials(*dataset, "M1"));
  return set_of("SIMULATED M1", all, all ? random_split(*all, 0.4) : pass(all.error()));
}

// Repetition 0 trains, repetition 1 tests.
std::optional<Set> real_set(std::string name, std::string_view filter, double window_s) {
  if (!std::filesystem::is_directory(fabricslide)) {
    std::printf("no recordings of real fabrics in %s\n", fabricslide.c_str());
    return std::nullopt;
  }
  const auto dataset = daemon::import_fabricslide(fabricslide, filter);
  if (!dataset) return set_of(std::move(name), pass(dataset.error()), Split{});
  std::vector<Trial> trials;
  for (const Trial& stroke : daemon::complete_trials(*dataset)) {
    if (window_s == 0.0) {
      trials.push_back(stroke);
      continue;
    }
    auto cut = cut_windows(stroke, {window_s, 0.0, 1.0 / dataset->info.taxel_rate_hz});
    if (!cut) return set_of(std::move(name), pass(cut.error()), Split{});
    trials.insert(trials.end(), cut->begin(), cut->end());
  }
  const auto all = build_feature_matrix(trials);
  if (!all) return set_of(std::move(name), all, Split{});
  return set_of(
      std::move(name), all,
      grouped_split(all->groups, std::vector<std::string>{"0"}, std::vector<std::string>{"1"}));
}

std::string text(double v, const char* format = "%.3g") {
  char out[32];
  std::snprintf(out, sizeof out, format, v);
  return out;
}

Status add_votes(const Set& set, const FabricModel& model, const ClassProfile& profile,
                 std::size_t shortlist, std::vector<Figure>& out, bool shortlist_only = false) {
  const auto costs = compare_votes(model, profile, set.test, seconds_now, shortlist);
  if (!costs) return pass(costs.error());
  for (const VoteCost& c : *costs) {
    if (shortlist_only && c.kind != VoteKind::shortlist) continue;
    const std::string kind =
        c.kind == VoteKind::shortlist
            ? "shortlist of " + std::to_string(std::min(shortlist, model.labels().size()))
            : std::string(to_string(c.kind));
    const std::string note = text(c.cores_per_trial, "%.0f") +
                             " cores asked; answers as majority " + std::to_string(c.as_majority) +
                             " of " + std::to_string(c.trials);
    out.push_back({set.name + ": " + kind + ", accuracy", c.accuracy, "", "majority",
                   costs->front().accuracy, note});
    out.push_back({set.name + ": " + kind + ", time", c.seconds_per_trial * 1e6, "us", "majority",
                   costs->front().seconds_per_trial * 1e6, ""});
  }
  return {};
}

Result<Reliability> reliability_of(const Set& set, const FabricModel& model,
                                   const VotePostprocessing& postprocessing) {
  const auto truth = class_numbers(set.test, model.labels());
  if (!truth) return pass(truth.error());
  Matrix p(set.test.size(), model.labels().size());
  std::vector<std::size_t> winner;
  for (std::size_t r = 0; r < set.test.size(); ++r) {
    const auto reply = predict(model, postprocessing, set.test.values.row(r));
    if (!reply) return pass(reply.error(), set.test.files[r]);
    winner.push_back(reply->ballot.winner);
    std::copy(reply->probability.begin(), reply->probability.end(), p.row(r).begin());
  }
  return reliability(p, winner, *truth);
}

Status add_calibration(const Set& set, const FabricModel& model,
                       const VotePostprocessing& postprocessing, std::vector<Figure>& out) {
  VotePostprocessing plain = postprocessing;
  plain.calibration.sharpness = 1.0;
  const auto before = reliability_of(set, model, plain);
  const auto after = reliability_of(set, model, postprocessing);
  if (!before || !after) return pass(before ? after.error() : before.error());
  const std::string peer = "coupling without sharpness";
  out.push_back({set.name + ": calibration error", after->calibration_error, "", peer,
                 before->calibration_error,
                 "sharpness " + text(postprocessing.calibration.sharpness)});
  out.push_back({set.name + ": Brier", after->brier, "", peer, before->brier, ""});
  out.push_back({set.name + ": log loss", after->log_loss, "nats", peer, before->log_loss, ""});
  std::printf("Reliability, %s:\n", set.name.c_str());
  for (const ReliabilityBin& b : after->bins)
    if (b.count > 0)
      std::printf("  %.1f to %.1f  %5zu trials  predicted %.3f  observed %.3f\n", b.low, b.high,
                  b.count, b.predicted, b.observed);
  return {};
}

Status add_reject(const Set& set, const TrainOptions& options, std::vector<Figure>& out) {
  const auto rules = measure_reject(set.train, set.test, options);
  if (!rules) return pass(rules.error());
  for (const RejectRates& f : *rules) {
    const std::string name = set.name + ": unknown fabric by " + std::string(to_string(f.kind));
    std::string each;
    for (const LeftOut& one : f.left_out)
      each +=
          " " + one.label + " " + std::to_string(one.accepted) + "/" + std::to_string(one.trials);
    out.push_back({name + ", false accept", f.false_accept, "", "chance (all accepted but 5 %)",
                   0.95,
                   "95 % interval " + text(f.false_accept_ci95.low) + " to " +
                       text(f.false_accept_ci95.high) + "; accepted:" + each});
    out.push_back({name + ", false reject", f.false_reject, "", "asked for", 0.05,
                   "right of the accepted: " + text(f.right_of_accepted)});
    out.push_back({name + ", separation", f.separation, "", "chance", 0.5, ""});
  }
  return {};
}

// Uses the cores that `weft train --learner cores-best` takes.
Status measure(const Set& plain, std::vector<Figure>& out) {
  TrainOptions options;
  const auto chosen = train_learner(plain.train, Learner::cores_best, options);
  if (!chosen) return pass(chosen.error(), plain.name);
  const TrainedLearner& learner = chosen->trained;
  const FabricModel* model = learner.cores();
  options.reduction = model->reduction();
  options.cap = chosen->recipe.cap;
  const Set set{plain.name, learner.prepared(plain.train), learner.prepared(plain.test)};
  const double start = seconds_now();
  const auto postprocessing = fit_postprocessing(*model, set.train, options);
  if (!postprocessing) return pass(postprocessing.error(), set.name);
  out.push_back({set.name + ": calibration and reject rule learnt", seconds_now() - start, "s",
                 "target", 1.0, to_string(chosen->recipe) + " cores"});
  if (auto ok = add_votes(set, *model, postprocessing->profile, 20, out); !ok) return ok;
  if (auto ok = add_votes(set, *model, postprocessing->profile, 5, out, true); !ok) return ok;
  if (auto ok = add_calibration(set, *model, *postprocessing, out); !ok) return ok;
  return add_reject(set, options, out);
}

// Votes only, with growing numbers of fabrics; 8 trials of each train, up to 1000 trials test.
Status grow(std::size_t fabrics, std::vector<Figure>& out) {
  const auto all = build_feature_matrix(bench::made_trials(fabrics, 12, 5));
  if (!all) return pass(all.error());
  const auto split = random_split(*all, 8.0 / 12.0);
  auto set = set_of("MADE UP, " + std::to_string(fabrics) + " fabrics", all, split);
  if (!set) return pass(split.error());
  std::vector<std::size_t> some;
  const std::size_t stride = set->test.size() / 1000 + 1;
  for (std::size_t r = 0; r < set->test.size(); r += stride) some.push_back(r);
  set->test = select_rows(set->test, some);
  const auto model = train(set->train, {});
  if (!model) return pass(model.error(), set->name);
  const auto profile = fit_profile(set->train, model->labels());
  if (!profile) return pass(profile.error(), set->name);
  return add_votes(*set, *model, *profile, 20, out);
}

}  // namespace

int main() {
  std::vector<Figure> figures;
  const auto keep = [](const Status& done) {
    if (!done) std::printf("left out: %s\n", to_string(done.error()).c_str());
  };
  if (const auto set = simulated_set()) keep(measure(*set, figures));
  if (const auto set = real_set("REAL fabricslide strokes", "*", 0.0)) keep(measure(*set, figures));
  if (const auto set = real_set("REAL fabricslide 2.8 s windows", "*V*10mmps_*", 2.8))
    keep(measure(*set, figures));
  for (const std::size_t fabrics : {17U, 50U, 100U, 500U}) keep(grow(fabrics, figures));
  return bench::report("votes", figures);
}
