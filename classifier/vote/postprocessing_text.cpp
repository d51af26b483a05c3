#include "classifier/vote/postprocessing_text.hpp"

#include <algorithm>
#include <array>

#include "classifier/fabric/matrix_text.hpp"

namespace weft::classifier {
namespace {

constexpr std::size_t most_trials = 10'000'000;

void write_reject(LineWriter& out, const RejectRule& rule) {
  out.text("reject_kind", to_string(rule.kind));
  out.number("false_reject", rule.false_reject);
  out.numbers("reject_threshold", rule.threshold);
  out.numbers("spread", rule.spread);
  out.count("training_trials", rule.trial.rows());
  out.numbers("radius", rule.radius);
  write_rows(out, "trial", rule.trial);
}

RejectRule read_reject(LineReader& in, std::size_t classes, std::size_t features) {
  RejectRule out;
  const auto kind = reject_kind_from(in.text("reject_kind"));
  if (!kind) in.refuse(kind.error().what, kind.error().expected, kind.error().got);
  out.kind = kind.value_or(RejectKind::neighbour);
  out.false_reject = in.number("false_reject");
  const std::vector<double> threshold = in.numbers("reject_threshold", reject_kinds, true);
  if (threshold.size() == reject_kinds)
    std::copy(threshold.begin(), threshold.end(), out.threshold.begin());
  out.spread = in.positives("spread", classes);
  const std::size_t trials = in.count("training_trials", 1, most_trials);
  out.radius = in.positives("radius", in.ok() ? trials : 0);
  out.trial = read_rows(in, "trial", trials, features);
  return out;
}

void write_calibration(LineWriter& out, const Calibration& calibration) {
  out.number("sharpness", calibration.sharpness);
  for (const Sigmoid& s : calibration.sigmoid)
    out.numbers("slope,offset", std::array{s.slope, s.offset});
}

Calibration read_calibration(LineReader& in, std::size_t sigmoids) {
  Calibration out;
  out.sharpness = in.positive("sharpness");
  for (std::size_t i = 0; in.ok() && i < sigmoids; ++i) {
    const std::vector<double> s = in.numbers("slope,offset", 2);
    if (!in.ok()) break;
    if (s[0] > 0.0) in.refuse("a sigmoid that falls", "a slope of 0 or less", std::to_string(s[0]));
    out.sigmoid.push_back({s[0], s[1]});
  }
  return out;
}

}  // namespace

void write_postprocessing(LineWriter& out,
                          const std::optional<VotePostprocessing>& postprocessing) {
  out.count("aids", postprocessing ? 1 : 0);
  if (!postprocessing) return;
  write_rows(out, "class_mean", postprocessing->profile.mean);
  out.numbers("class_deviation", postprocessing->profile.deviation);
  write_calibration(out, postprocessing->calibration);
  write_reject(out, postprocessing->reject);
}

std::optional<VotePostprocessing> read_postprocessing(LineReader& in, std::size_t classes,
                                                      std::size_t features, std::size_t sigmoids) {
  if (in.count("aids", 0, 1) == 0) return std::nullopt;
  VotePostprocessing out;
  out.profile.mean = read_rows(in, "class_mean", classes, features);
  out.profile.deviation = in.positives("class_deviation", features);
  out.calibration = read_calibration(in, sigmoids);
  out.reject = read_reject(in, classes, features);
  return out;
}

}  // namespace weft::classifier
