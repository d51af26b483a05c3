#include "tests/bench/measure_reject.hpp"

#include <algorithm>

#include "classifier/vote/calibration.hpp"
#include "classifier/vote/novelty.hpp"
#include "classifier/vote/postprocessing.hpp"

namespace weft::classifier {
namespace {

CrossDecisions without(const CrossDecisions& whole, std::size_t label_index,
                       std::span<const std::size_t> rows) {
  const auto moved = [&](std::size_t c) { return c - (c > label_index ? 1 : 0); };
  CrossDecisions out{{}, Matrix(rows.size(), whole.against.cols() - 1)};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    out.own.push_back(moved(whole.own[rows[i]]));
    for (std::size_t c = 0; c < whole.against.cols(); ++c)
      if (c != label_index) out.against(i, moved(c)) = whole.against(rows[i], c);
  }
  return out;
}

// Test scores of one rule, over all models.
struct Scores {
  std::vector<double> known;
  std::vector<double> unknown;
  std::size_t refused = 0;
  std::size_t accepted_right = 0;
};

// P(unknown > known) + P(equal) / 2.
double measure_separation(Scores& scores) {
  std::sort(scores.known.begin(), scores.known.end());
  double sum = 0.0;
  for (const double u : scores.unknown) {
    const auto [low, high] = std::equal_range(scores.known.begin(), scores.known.end(), u);
    sum += static_cast<double>(low - scores.known.begin()) + static_cast<double>(high - low) / 2.0;
  }
  return sum /
         (static_cast<double>(scores.known.size()) * static_cast<double>(scores.unknown.size()));
}

class Campaign {
 public:
  Campaign() {
    for (std::size_t k = 0; k < reject_kinds; ++k) figures_[k].kind = static_cast<RejectKind>(k);
  }

  Status show(const FabricModel& model, VotePostprocessing postprocessing,
              const FeatureMatrix& test, const std::string& left_out) {
    for (RejectRates& f : figures_) f.left_out.push_back({left_out, 0, 0});
    for (std::size_t r = 0; r < test.size(); ++r) {
      const auto reply = predict(model, postprocessing, test.values.row(r));
      if (!reply) return pass(reply.error(), test.files[r]);
      const bool right = model.labels()[reply->ballot.winner] == test.labels[r];
      for (std::size_t k = 0; k < reject_kinds; ++k) {
        postprocessing.reject.kind = static_cast<RejectKind>(k);
        count(k, reply->novelty[k], postprocessing.reject.refuses(reply->novelty),
              test.labels[r] == left_out, right);
      }
    }
    return {};
  }

  std::array<RejectRates, reject_kinds> finish() {
    for (std::size_t k = 0; k < reject_kinds; ++k) {
      RejectRates& f = figures_[k];
      Scores& s = scores_[k];
      std::size_t accepted = 0;
      for (const LeftOut& one : f.left_out) accepted += one.accepted;
      const auto known = static_cast<double>(s.known.size());
      f.false_accept = static_cast<double>(accepted) / static_cast<double>(s.unknown.size());
      f.false_accept_ci95 = wilson_interval(accepted, s.unknown.size());
      f.false_reject = static_cast<double>(s.refused) / known;
      const std::size_t saved = s.known.size() - s.refused;
      f.right_of_accepted =
          saved == 0 ? 0.0 : static_cast<double>(s.accepted_right) / static_cast<double>(saved);
      f.separation = measure_separation(s);
    }
    return figures_;
  }

 private:
  void count(std::size_t k, double score, bool refused, bool unknown, bool right) {
    Scores& s = scores_[k];
    (unknown ? s.unknown : s.known).push_back(score);
    if (unknown) {
      ++figures_[k].left_out.back().trials;
      figures_[k].left_out.back().accepted += refused ? 0 : 1;
    } else {
      s.refused += refused ? 1 : 0;
      s.accepted_right += !refused && right ? 1 : 0;
    }
  }

  std::array<RejectRates, reject_kinds> figures_;
  std::array<Scores, reject_kinds> scores_;
};

}  // namespace

FabricModel without_label(const FabricModel& model, std::size_t label_index) {
  std::vector<std::string> labels = model.labels();
  labels.erase(labels.begin() + static_cast<std::ptrdiff_t>(label_index));
  std::vector<FabricCore> cores;
  for (std::size_t i = 0; i < model.pairs().size(); ++i)
    if (model.pairs()[i].a != label_index && model.pairs()[i].b != label_index)
      cores.push_back(model.cores()[i]);
  return {std::move(labels), model.feature_names(), model.reduction(), std::move(cores)};
}

Result<std::array<RejectRates, reject_kinds>> measure_reject(const FeatureMatrix& train_part,
                                                             const FeatureMatrix& test_part,
                                                             const TrainOptions& options,
                                                             double false_reject) {
  const auto model = train(train_part, options);
  if (!model) return pass(model.error());
  if (model->labels().size() < 3)
    return fail({.code = Errc::invalid_argument,
                 .where = "measure_reject",
                 .what = "too few fabrics to leave one out",
                 .expected = "at least 3",
                 .got = std::to_string(model->labels().size())});
  if (auto ok = check(test_part); !ok) return pass(ok.error());
  if (auto known = class_numbers(test_part, model->labels()); !known) return pass(known.error());
  if (test_part.size() == 0)
    return fail(
        {.code = Errc::invalid_argument, .where = "measure_reject", .what = "nothing to test"});
  const auto held_out = cross_decisions(*model, train_part, options);
  if (!held_out) return pass(held_out.error());
  Campaign campaign;
  for (std::size_t u = 0; u < model->labels().size(); ++u) {
    std::vector<std::size_t> rows;
    for (std::size_t r = 0; r < train_part.size(); ++r)
      if (held_out->own[r] != u) rows.push_back(r);
    const FabricModel rest = without_label(*model, u);
    auto postprocessing = fit_postprocessing(rest, select_rows(train_part, rows),
                                             without(*held_out, u, rows), options, false_reject);
    if (!postprocessing) return pass(postprocessing.error());
    if (auto ok = campaign.show(rest, std::move(*postprocessing), test_part, model->labels()[u]);
        !ok)
      return pass(ok.error());
  }
  return campaign.finish();
}

}  // namespace weft::classifier
