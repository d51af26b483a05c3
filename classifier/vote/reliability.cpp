#include "classifier/vote/reliability.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace weft::classifier {
namespace {

Status check_input(const Matrix& probability, std::span<const std::size_t> answer,
                   std::span<const std::size_t> truth, std::size_t bins) {
  if (bins == 0 || probability.rows() == 0)
    return fail({.code = Errc::invalid_argument,
                 .where = "reliability",
                 .what = "nothing to compare",
                 .expected = "at least one trial and one bin"});
  if (answer.size() != probability.rows() || truth.size() != probability.rows())
    return fail({.code = Errc::invalid_argument,
                 .where = "reliability",
                 .what = "sizes disagree",
                 .expected = std::to_string(probability.rows()) + " answers and true classes",
                 .got = std::to_string(answer.size()) + " and " + std::to_string(truth.size())});
  for (const auto columns : {answer, truth})
    for (const std::size_t c : columns)
      if (c >= probability.cols())
        return fail({.code = Errc::range,
                     .where = "reliability",
                     .what = "class beyond the last",
                     .expected = "< " + std::to_string(probability.cols()),
                     .got = std::to_string(c)});
  for (const double p : probability.data())
    if (!(p >= 0.0 && p <= 1.0))
      return fail({.code = Errc::range,
                   .where = "reliability",
                   .what = "not a probability",
                   .expected = "0 to 1",
                   .got = std::to_string(p)});
  return {};
}

double squared_error(std::span<const double> p, std::size_t truth) {
  double sum = 0.0;
  for (std::size_t k = 0; k < p.size(); ++k) {
    const double d = p[k] - (k == truth ? 1.0 : 0.0);
    sum += d * d;
  }
  return sum;
}

// Sums become means.
void finish(Reliability& out) {
  const auto n = static_cast<double>(out.trials);
  out.brier /= n;
  out.log_loss /= n;
  for (ReliabilityBin& bin : out.bins) {
    if (bin.count == 0) continue;
    out.calibration_error += std::abs(bin.predicted - bin.observed) / n;
    bin.predicted /= static_cast<double>(bin.count);
    bin.observed /= static_cast<double>(bin.count);
  }
}

}  // namespace

std::size_t reliability_bin(double stated, std::size_t bins) {
  return std::min(bins - 1, static_cast<std::size_t>(stated * static_cast<double>(bins)));
}

Result<Reliability> reliability(const Matrix& probability, std::span<const std::size_t> answer,
                                std::span<const std::size_t> truth, std::size_t bins) {
  if (auto ok = check_input(probability, answer, truth, bins); !ok) return pass(ok.error());
  Reliability out;
  out.trials = probability.rows();
  const auto width = static_cast<double>(bins);
  for (std::size_t b = 0; b < bins; ++b)
    out.bins.push_back(
        {static_cast<double>(b) / width, static_cast<double>(b + 1) / width, 0, 0, 0});
  for (std::size_t r = 0; r < out.trials; ++r) {
    const auto p = probability.row(r);
    const double stated = p[answer[r]];
    ReliabilityBin& bin = out.bins[reliability_bin(stated, bins)];
    ++bin.count;
    bin.predicted += stated;
    bin.observed += answer[r] == truth[r] ? 1.0 : 0.0;
    out.brier += squared_error(p, truth[r]);
    out.log_loss -= std::log(std::max(p[truth[r]], 1e-12));
  }
  finish(out);
  return out;
}

}  // namespace weft::classifier
