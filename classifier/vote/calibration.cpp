#include "classifier/vote/calibration.hpp"

#include <algorithm>
#include <cmath>

#include "classifier/base/parallel.hpp"
#include "classifier/vote/coupling.hpp"

namespace weft::classifier {
namespace {

constexpr double least_probability = 1e-12;  // one trial must not decide the sharpness alone

Sigmoid core_sigmoid(const CrossDecisions& held_out, const std::vector<std::size_t>& rows_a,
                     const std::vector<std::size_t>& rows_b, Pair pair) {
  std::vector<double> f;
  std::vector<int> sign;
  for (const std::size_t r : rows_a) {
    f.push_back(held_out.against(r, pair.b));
    sign.push_back(1);
  }
  for (const std::size_t r : rows_b) {
    f.push_back(-held_out.against(r, pair.a));
    sign.push_back(-1);
  }
  return fit_sigmoid(f, sign);
}

double log_loss(const std::vector<std::vector<double>>& coupled,
                const std::vector<std::size_t>& truth, double power) {
  double sum = 0.0;
  for (std::size_t i = 0; i < coupled.size(); ++i) {
    std::vector<double> p = coupled[i];
    sharpen(p, power);
    sum -= std::log(std::max(p[truth[i]], least_probability));
  }
  return sum;
}

}  // namespace

// The largest is divided out first, so nothing underflows to 0 / 0.
void sharpen(std::vector<double>& p, double power) {
  if (power == 1.0) return;
  const double top = *std::max_element(p.begin(), p.end());
  double sum = 0.0;
  for (double& value : p) sum += value = std::pow(value / top, power);
  for (double& value : p) value /= sum;
}

// Golden section on the logarithm; the loss has one minimum as long as no probability is clipped.
double fit_sharpness(const std::vector<std::vector<double>>& coupled,
                     const std::vector<std::size_t>& truth) {
  const double ratio = (std::sqrt(5.0) - 1.0) / 2.0;
  double low = -std::log(8.0), high = std::log(8.0);
  const auto loss = [&](double x) { return log_loss(coupled, truth, std::exp(x)); };
  double left = high - ratio * (high - low), right = low + ratio * (high - low);
  double at_left = loss(left), at_right = loss(right);
  while (high - low > 1e-4) {
    if (at_left <= at_right) {
      high = right;
      right = left;
      at_right = at_left;
      at_left = loss(left = high - ratio * (high - low));
    } else {
      low = left;
      left = right;
      at_left = at_right;
      at_right = loss(right = low + ratio * (high - low));
    }
  }
  return std::exp((low + high) / 2.0);
}

std::vector<double> probabilities(const Calibration& calibration, std::size_t all_classes,
                                  std::span<const std::size_t> classes,
                                  std::span<const double> decision) {
  if (classes.size() < 2) return std::vector<double>(classes.size(), 1.0);
  std::vector<double> first_wins;
  first_wins.reserve(decision.size());
  for (std::size_t a = 0; a < classes.size(); ++a)
    for (std::size_t b = a + 1; b < classes.size(); ++b)
      first_wins.push_back(calibration.sigmoid[pair_index(classes[a], classes[b], all_classes)](
          decision[first_wins.size()]));
  std::vector<double> p = couple(first_wins, classes.size());
  sharpen(p, calibration.sharpness);
  return p;
}

std::vector<double> probabilities(const Calibration& calibration, const Ballot& ballot) {
  if (ballot.classes.size() < 2) return {};  // no core was asked
  const std::size_t all = ballot.votes.size();
  const std::vector<double> p = probabilities(calibration, all, ballot.classes, ballot.decision);
  std::vector<double> out(all);
  for (std::size_t k = 0; k < p.size(); ++k) out[ballot.classes[k]] = p[k];
  return out;
}

std::vector<Sigmoid> fit_sigmoids(const FabricModel& model, const CrossDecisions& held_out,
                                  std::size_t threads) {
  std::vector<std::vector<std::size_t>> rows(model.labels().size());
  for (std::size_t r = 0; r < held_out.own.size(); ++r) rows[held_out.own[r]].push_back(r);
  std::vector<Sigmoid> out(model.pairs().size());
  parallel_for(out.size(), threads, [&](std::size_t i) {
    const Pair pair = model.pairs()[i];
    out[i] = core_sigmoid(held_out, rows[pair.a], rows[pair.b], pair);
  });
  return out;
}

}  // namespace weft::classifier
